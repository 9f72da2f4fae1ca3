#!/usr/bin/env python3
"""Recordings of a finger between two tendons that both rub in their guides, written by somebody else's physics.

One bend of constant curvature; one motor takes one tendon in and lets the other out, both taut throughout:

    T_e = p + k (g u - r q) - d r q'        T_w = p - k (g u - r q) + d r q'
    J q'' = r (T_e - T_w) - K q - c q' - sign(q') r (m_e T_e + m_w T_w)        while it moves
    q' = 0 as long as |r (T_e - T_w) - K q| <= r (m_e T_e + m_w T_w)           while it sticks
    x = L (1 - cos q) / q

The input is held between samples, so between two samples this is a linear equation with constant right-hand side as
long as the direction of motion does not change: its solution and the instant of the next stop are closed formulas.
Nothing is integrated step by step and nothing is smoothed. Shares no code, no method and no step size with the
project's simulator.

Only the standard library; the seeds are fixed. Run without arguments to rewrite, in tests/foreign/finger,

    exact.csv, exact.toml    noise-free, and the rig as it is: for the simulator
    fit.csv, check.csv       noisy, two inputs: for diagnosis
    believed.toml            the rig as its maker takes it to be: numbers that are off, and dry tendons left out
    truth.json               what was true

or with --check to compare what is there with what would be written (exit status 1 if it differs).
"""

import json
import math
import random
from pathlib import Path

from keep import keep
from mass_spring_damper import gauss, multisine

TRUTH = {
    "inertia_kg_m2": 7.4e-5,
    "stiffness_N_m_rad": 0.43,
    "damping_N_m_s_rad": 2.3e-3,
    "friction_east": 0.17,
    "friction_west": 0.22,
}
BELIEVED = {"inertia_kg_m2": 7e-5, "stiffness_N_m_rad": 0.4, "damping_N_m_s_rad": 2e-3}
TENDON_N_M, TENDON_N_S_M, PRETENSION_N = 5000.0, 2.0, 12.0
RADIUS_M, PULLEY_M, LENGTH_M = 0.010, 0.008, 0.1
RATE_HZ, SECONDS = 100, 6.0
NOISE_M = {"exact": 0.0, "fit": 1e-4, "check": 1e-4}
SEEDS = {"exact": 7, "fit": 5, "check": 6}


class Slip:
    """Motion in one direction under a held input: a damped oscillation about `rest`."""

    def __init__(self, q, v, u, sign):
        inertia, stiffness, damping, east, west = TRUTH.values()
        less = sign * RADIUS_M**2 * (east - west)
        k = stiffness + (2.0 * RADIUS_M**2 - less) * TENDON_N_M
        c = damping + (2.0 * RADIUS_M**2 - less) * TENDON_N_S_M
        taken = TENDON_N_M * PULLEY_M * u
        force = RADIUS_M * (2.0 * taken - sign * ((east + west) * PRETENSION_N + (east - west) * taken))
        self.a = c / (2.0 * inertia)
        self.w = math.sqrt(k / inertia - self.a**2)
        self.rest = force / k
        self.x, self.v = q - self.rest, v

    def at(self, t):
        """Angle and velocity after t seconds."""
        a, w, x, v = self.a, self.w, self.x, self.v
        decay, cos, sin = math.exp(-a * t), math.cos(w * t), math.sin(w * t)
        angle = self.rest + decay * (x * cos + (v + a * x) / w * sin)
        velocity = decay * (v * cos - ((a * a + w * w) * x + a * v) / w * sin)
        return angle, velocity

    def turning(self):
        """Seconds until the velocity is next zero: v cos(w t) = ((a^2 + w^2) x + a v)/w sin(w t)."""
        a, w, x, v = self.a, self.w, self.x, self.v
        angle = math.atan2(v, ((a * a + w * w) * x + a * v) / w) % math.pi
        return (angle if v != 0.0 and angle > 1e-13 else math.pi) / w


def tensions(q, v, u):
    """Of the tendon in the east and the one in the west, N."""
    taken = TENDON_N_M * (PULLEY_M * u - RADIUS_M * q) - TENDON_N_S_M * RADIUS_M * v
    return PRETENSION_N + taken, PRETENSION_N - taken


def step(q, v, u, dt):
    """Angle and velocity after dt seconds under the held input u, through every stop on the way."""
    _, stiffness, _, rub_east, rub_west = TRUTH.values()
    while True:
        east, west = tensions(q, v, u)
        assert east > 0.0 and west > 0.0, "a tendon goes slack"
        push = RADIUS_M * (east - west) - stiffness * q
        if v == 0.0 and abs(push) <= RADIUS_M * (rub_east * east + rub_west * west):
            return q, 0.0
        slip = Slip(q, v, u, math.copysign(1.0, v if v != 0.0 else push))
        turning = slip.turning()
        if turning >= dt:
            return slip.at(dt)
        q, v = slip.at(turning)[0], 0.0
        dt -= turning


def recording(name):
    """The text of one CSV file."""
    source = random.Random(SEEDS[name])
    times = [i / RATE_HZ for i in range(round(SECONDS * RATE_HZ))]
    # From rest: a step of the pulley would let a tendon go slack.
    tones = multisine(source, times, 0.3, 2.0, 0.5)
    inputs = [round(min(1.0, 2.0 * t) * u, 4) for t, u in zip(times, tones)]
    q, v = 0.0, 0.0
    lines = ["# A finger between two tendons at %d Hz; written by tests/foreign/finger.py" % RATE_HZ, "t,u_rad,x_m"]
    for t, u in zip(times, inputs):
        x = LENGTH_M * (1.0 - math.cos(q)) / q if abs(q) > 1e-6 else 0.5 * LENGTH_M * q
        if NOISE_M[name] > 0.0:
            lines.append("%.6f,%.4f,%.6f" % (t, u, x + NOISE_M[name] * gauss(source)))
        else:
            lines.append("%.6f,%.4f,%.12f" % (t, u, x))
        q, v = step(q, v, u, 1.0 / RATE_HZ)
    return "\n".join(lines) + "\n"


def rig(name, numbers, effects):
    """The text of a rig file."""
    tendons = "".join(
        """
[[tendon]]
name = "%s"
path = [{ chain = "spine", radius = %s, angle = %s }]
stiffness = %s
damping = %s
pretension = %s
"""
        % (side, RADIUS_M, angle, TENDON_N_M, TENDON_N_S_M, PRETENSION_N)
        for side, angle in (("east", 0.0), ("west", math.pi))
    )
    actuators = "".join(
        """
[[actuator]]
name = "%s"
drives = "%s"
input = "u_rad"
gain = %s
limit = [-0.7, 0.7]
"""
        % (does, side, gain)
        for does, side, gain in (("pull", "east", -PULLEY_M), ("pay_out", "west", PULLEY_M))
    )
    return (
        """# A finger between two tendons, %s; written by tests/foreign/finger.py
format = "sinew-rig/1"
name = "finger"

[[chain]]
name = "spine"
segments = 1
length = %s
stiffness = { value = %s }
damping = { value = %s }
inertia = { value = %s }
"""
        % (name, LENGTH_M, numbers["stiffness_N_m_rad"], numbers["damping_N_m_s_rad"], numbers["inertia_kg_m2"])
        + tendons
        + actuators
        + """
[[sensor]]
name = "tip_x"
reads = "spine.tip.x"
signal = "x_m"
"""
        + effects
    )


def rubbing(side, coefficient):
    return '\n[[effect]]\nkind = "load_dependent_friction"\ncomponent = "%s"\ncoefficient = %s\n' % (side, coefficient)


def main():
    folder = Path(__file__).resolve().parent / "finger"
    dry = rubbing("east", TRUTH["friction_east"]) + rubbing("west", TRUTH["friction_west"])
    files = {"%s.csv" % name: recording(name) for name in SEEDS}
    files["exact.toml"] = rig("as it is", TRUTH, dry)
    files["believed.toml"] = rig("as its maker takes it to be", BELIEVED, "")
    files["truth.json"] = json.dumps(TRUTH, indent=2) + "\n"

    keep(folder, files, __doc__)


if __name__ == "__main__":
    main()
