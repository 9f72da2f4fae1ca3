#!/usr/bin/env python3
"""Recordings of a mass on a spring, written by somebody else's physics.

    m q'' = u - k q - c q' - F sign(q')        while it moves
    q' = 0 as long as |u - k q| <= F           while it sticks

The input is held between samples, so between two samples this is a linear equation with constant
right-hand side as long as the direction of motion does not change. Its solution, and the instant at which
the velocity next vanishes, are closed formulas; nothing is integrated step by step and nothing is
smoothed. Shares no code, no method and no step size with the project's simulator, which is why it may
judge it.

Only the standard library; the seeds are fixed. Run without arguments to rewrite

    rigs/mass-spring-damper.fit.csv     noisy, for identification
    rigs/mass-spring-damper.test.csv    noisy, held out, another input
    tests/foreign/mass_spring_damper.exact.csv    noise-free, for sim/tests/simulator/foreign
    tests/foreign/mass_spring_damper.truth.json   what was true
    rigs/mass-spring-damper.truth.json  the effect that the rig lacks, for the end of the demo

or with --check to compare what is there with what would be written (exit status 1 if it differs).
"""

import json
import math
import random
from pathlib import Path

from keep import keep

TRUTH = {
    "mass_kg": 1.147,
    "stiffness_N_m": 43.6,
    "damping_N_s_m": 1.08,
    "coulomb_friction_N": 0.58,
}
RATE_HZ = 120
NOISE = 0.002  # standard deviation of the measurement noise over that of the motion
LIMIT_N = 20.0
SEEDS = {"fit": 3, "test": 8, "exact": 21}


class Slip:
    """Motion in one direction under a constant force: the damped oscillation about `rest`.

    With x = q - rest:  x(t) = e^(-a t) (x0 cos(w t) + (v0 + a x0)/w sin(w t)),  a = c/2m, w^2 = k/m - a^2.
    """

    def __init__(self, q, v, u, sign):
        m, k, c, friction = TRUTH.values()
        self.a = c / (2.0 * m)
        self.w = math.sqrt(k / m - self.a**2)
        self.rest = (u - sign * friction) / k
        self.x, self.v = q - self.rest, v

    def at(self, t):
        """Position and velocity after t seconds."""
        a, w, x, v = self.a, self.w, self.x, self.v
        decay, cos, sin = math.exp(-a * t), math.cos(w * t), math.sin(w * t)
        position = self.rest + decay * (x * cos + (v + a * x) / w * sin)
        velocity = decay * (v * cos - ((a * a + w * w) * x + a * v) / w * sin)
        return position, velocity

    def turning(self):
        """Seconds until the velocity is next zero: v cos(w t) = ((a^2 + w^2) x + a v)/w sin(w t)."""
        a, w, x, v = self.a, self.w, self.x, self.v
        angle = math.atan2(v, ((a * a + w * w) * x + a * v) / w) % math.pi
        # From rest the first zero is where it already stands; it next stops half a period later.
        return (angle if v != 0.0 and angle > 1e-13 else math.pi) / w


def step(q, v, u, dt):
    """Position and velocity after dt seconds under the constant force u, through every stop on the way."""
    _, k, _, friction = TRUTH.values()
    while True:
        push = u - k * q
        if v == 0.0 and abs(push) <= friction:
            return q, 0.0  # u is constant and so is q: it sticks until the next sample
        sign = math.copysign(1.0, v if v != 0.0 else push)
        slip = Slip(q, v, u, sign)
        turning = slip.turning()
        if turning >= dt:
            return slip.at(dt)
        q, v = slip.at(turning)[0], 0.0
        dt -= turning


def gauss(source):
    """One normal variate (Box-Muller): only random() is promised to be the same in every Python."""
    return math.sqrt(-2.0 * math.log(1.0 - source.random())) * math.cos(2.0 * math.pi * source.random())


def multisine(source, times, lowest_hz, highest_hz, peak):
    """A sum of 24 sines, logarithmically spaced, at random phases, scaled to a peak."""
    count = 24
    tones = [
        (lowest_hz * (highest_hz / lowest_hz) ** (i / (count - 1)), 2.0 * math.pi * source.random())
        for i in range(count)
    ]
    values = [sum(math.sin(2.0 * math.pi * f * t + phase) for f, phase in tones) for t in times]
    largest = max(abs(value) for value in values)
    return [peak * value / largest for value in values]


def steps(source, count, largest, shortest_s, longest_s):
    """Random levels, each held for a random time."""
    values = []
    while len(values) < count:
        level = source.uniform(-largest, largest)
        values += [level] * round(RATE_HZ * source.uniform(shortest_s, longest_s))
    return values[:count]


def command(source, seconds):
    """Rest, a multisine, steps, a slow multisine that turns often and sticks, and rest again."""
    def times(part):
        return [i / RATE_HZ for i in range(round(part * RATE_HZ))]

    rest = [0.0] * round(0.5 * RATE_HZ)
    left = seconds - 2.0
    values = rest
    values = values + multisine(source, times(0.4 * left), 0.15, 5.0, 16.0)
    values = values + steps(source, len(times(0.35 * left)), 0.95 * LIMIT_N, 0.4, 1.6)
    values = values + multisine(source, times(0.25 * left), 0.1, 1.0, 6.0)
    values = values + [0.0] * (round(seconds * RATE_HZ) - len(values))
    # What stands in the file is what was applied.
    return [round(max(-LIMIT_N, min(LIMIT_N, value)), 3) for value in values]


def recording(name, seconds, noise):
    """The text of one CSV file."""
    source = random.Random(SEEDS[name])
    inputs = command(source, seconds)
    q, v, positions = 0.0, 0.0, []
    for u in inputs:
        positions.append(q)
        q, v = step(q, v, u, 1.0 / RATE_HZ)
    mean = sum(positions) / len(positions)
    spread = math.sqrt(sum((q - mean) ** 2 for q in positions) / len(positions))
    lines = [
        "# Mass, spring and damper at %d Hz; written by tests/foreign/mass_spring_damper.py" % RATE_HZ,
        "t,u_N,q_m",
    ]
    for i, (u, q) in enumerate(zip(inputs, positions)):
        if noise > 0.0:
            lines.append("%.6f,%.3f,%.6f" % (i / RATE_HZ, u, q + noise * spread * gauss(source)))
        else:
            lines.append("%s,%.3f,%s" % (repr(i / RATE_HZ), u, repr(q)))
    return "\n".join(lines) + "\n", noise * spread


def main():
    root = Path(__file__).resolve().parents[2]
    files, truth = {}, dict(TRUTH)
    files["rigs/mass-spring-damper.fit.csv"], truth["fit_noise_m"] = recording("fit", 40.0, NOISE)
    files["rigs/mass-spring-damper.test.csv"], truth["test_noise_m"] = recording("test", 30.0, NOISE)
    files["tests/foreign/mass_spring_damper.exact.csv"], _ = recording("exact", 30.0, 0.0)
    truth = {key: round(value, 9) for key, value in truth.items()}
    files["tests/foreign/mass_spring_damper.truth.json"] = json.dumps(truth, indent=2) + "\n"
    friction = {"kind": "coulomb_friction", "component": "mass", "parameters": {"level": truth["coulomb_friction_N"]}}
    files["rigs/mass-spring-damper.truth.json"] = json.dumps({"effects": [friction]}, indent=2) + "\n"

    keep(root, files, __doc__)


if __name__ == "__main__":
    main()
