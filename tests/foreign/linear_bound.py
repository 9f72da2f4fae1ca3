"""The least error that a linear controller can have, for a mass on a spring whose position is measured with noise.

usage: linear_bound.py RIG.toml RECORDING.csv NOISE DELAY [COMMAND_CHANGE...]

RIG.toml has one body, spring, damper, actuator and sensor. Position is measured once a period with white noise, NOISE
times what it ranges over in RECORDING.csv, and DELAY seconds (less than a period) before the command is held. After a
quarter of the run a load sets in and stays. The reference is taken to cost nothing: with the plant's own numbers and a
preview a controller follows it without error. What is left is noise and load. Summed over a run, the squared response to
one step of load is that to white changes with the variance load^2 / steps: the best linear controller is the Kalman
filter of that plant with the regulator for e^2 + rho du^2 (Kwakernaak and Sivan, Linear optimal control systems, 1972,
chapter 6), and the covariance of the two together, a Lyapunov equation, is its error. There is no friction, and the
command has no limits. rho near 0: whatever the command does. For a COMMAND_CHANGE, rho is such that the command changes
by so much a period, root mean square. The same loop is simulated with its one step beside it. SI; prints a JSON object.
"""

import csv
import itertools
import json
import sys
import tomllib

import numpy as np

# Of the published staircase and its load (docs/explanation/comparison.md): three levels of 333 periods; a part of half the input's range.
STEPS = 999
LOAD = 0.2
# Every parameter of a drawn plant lies within this part of the rig's.
SPREAD = 0.2
# rho of a command that may do anything.
FREE = 1e-14
RUNS = 400


def exponential(a):
    """By its series, of a matrix that was halved until it is small."""
    halvings = max(0, int(np.ceil(np.log2(max(1e-9, np.abs(a).sum(1).max()))))) + 4
    term = total = np.eye(len(a))
    for k in range(1, 20):
        term = term @ a / (k * 2.0**halvings)
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total


def held(mass, stiffness, damping, seconds):
    """[x, v] after `seconds` from [x, v] and a force that is held: a, b."""
    rates = np.zeros((3, 3))
    rates[0, 1] = 1.0
    rates[1] = np.array([-stiffness, -damping, 1.0]) / mass
    whole = exponential(rates * seconds)
    return whole[:2, :2], whole[:2, 2]


def riccati(a, b, q, r):
    """Gain L of u = -L x and cost-to-go of x'qx + r u^2, by iteration from q."""
    p = q.copy()
    for _ in range(100_000):
        gain = (b @ p @ a) / (r + b @ p @ b)
        following = q + a.T @ p @ (a - np.outer(b, gain))
        following = (following + following.T) / 2
        if np.abs(following - p).max() <= 1e-13 * np.abs(p).max():
            return gain, following
        p = following
    raise SystemExit("the Riccati equation did not settle")


def lyapunov(a, q):
    """X = a X a' + q."""
    n = len(a)
    return np.linalg.solve(np.eye(n * n) - np.kron(a, a), q.reshape(-1)).reshape(n, n)


class Loop:
    """State [x, v, w, s]: w is the force of the period before, the load of now included; s what the sensor will show."""

    def __init__(self, plant, period, delay, noise, load):
        a, b = held(*plant, period)
        early_a, early_b = held(*plant, period - delay)
        self.a = np.zeros((4, 4))
        self.a[:2, :2], self.a[:2, 2], self.a[2, 2] = a, b, 1.0
        self.a[3, :2], self.a[3, 2] = early_a[0], early_b[0]
        self.b = np.array([*b, 1.0, early_b[0]])
        self.loaded = np.array([0.0, 0.0, 1.0, 0.0])
        self.shown = np.array([0.0, 0.0, 0.0, 1.0])
        self.noise, self.load = noise, load
        white = np.outer(self.loaded, self.loaded) * load**2 / STEPS
        # The filter is the regulator of the transposed plant.
        _, prior = riccati(self.a.T, self.shown, white, noise**2)
        self.gain = prior @ self.shown / (self.shown @ prior @ self.shown + noise**2)

    def regulator(self, rho):
        cost = np.zeros((4, 4))
        cost[0, 0] = 1.0
        return riccati(self.a[:3, :3], self.b[:3], cost[:3, :3], rho)[0]

    def error(self, rho):
        """Root mean square of position and of the command's change."""
        control = np.append(self.regulator(rho), 0.0)
        keep = np.eye(4) - np.outer(self.gain, self.shown)
        n = 4
        # What is, and what is with what the filter does not know (after its update).
        joint = np.zeros((2 * n, 2 * n))
        joint[:n, :n] = self.a - np.outer(self.b, control)
        joint[:n, n:] = np.outer(self.b, control)
        joint[n:, n:] = keep @ self.a
        white = np.concatenate([self.loaded, keep @ self.loaded]) * self.load / STEPS**0.5
        shown = np.concatenate([np.zeros(n), -self.gain * self.noise])
        covariance = lyapunov(joint, np.outer(white, white) + np.outer(shown, shown))
        row = np.concatenate([control, -control])
        return covariance[0, 0] ** 0.5, (row @ covariance @ row) ** 0.5

    def simulated(self, rho):
        """The same of runs that start at rest, with one step of load after a quarter."""
        control = np.append(self.regulator(rho), 0.0)
        random = np.random.default_rng(1)
        state, known = np.zeros((4, RUNS)), np.zeros((4, RUNS))
        squares = np.zeros(RUNS)
        for k in range(STEPS):
            if k == STEPS // 4:
                state[2] += self.load
            shown = state[3] + self.noise * random.standard_normal(RUNS)
            known = known + np.outer(self.gain, shown - known[3])
            squares += state[0] ** 2
            moves = -control @ known
            state = self.a @ state + np.outer(self.b, moves)
            known = self.a @ known + np.outer(self.b, moves)
        return (squares.mean() / STEPS) ** 0.5


def weight(loop, wanted):
    """rho of a command that changes by `wanted` a period, by bisection of its logarithm."""
    low, high = -14.0, 0.0
    for _ in range(40):
        middle = (low + high) / 2
        if loop.error(10.0**middle)[1] > wanted:
            low = middle
        else:
            high = middle
    return 10.0**high


def number(entry):
    """A parameter of a rig, with or without bounds."""
    return float(entry["value"] if isinstance(entry, dict) else entry)


def main():
    path, recording = sys.argv[1:3]
    with open(path, "rb") as file:
        rig = tomllib.load(file)
    for part in ["body", "spring", "damper", "actuator", "sensor"]:
        if len(rig.get(part, [])) != 1:
            sys.exit(f"{path}: expected one [[{part}]], found {len(rig.get(part, []))}")
    signal = rig["sensor"][0]["signal"]
    with open(recording, newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    if not rows or signal not in rows[0]:
        sys.exit(f"{recording}: expected rows with a column `{signal}`")
    positions = [float(row[signal]) for row in rows]
    if not np.isfinite(positions).all():
        sys.exit(f"{recording}: expected a number in every row of `{signal}`")
    share, delay = float(sys.argv[3]), float(sys.argv[4])
    noise = share * (max(positions) - min(positions))
    low, high = rig["actuator"][0]["limit"]
    load = LOAD * (high - low) / 2
    period = 1 / rig["control"]["rate_hz"]
    plant = [
        number(rig["body"][0]["inertia"]),
        number(rig["spring"][0]["stiffness"]),
        number(rig["damper"][0]["damping"]),
    ]
    loop = Loop(plant, period, delay, noise, load)
    bounds = []
    for wanted in [None, *map(float, sys.argv[5:])]:
        rho = FREE if wanted is None else weight(loop, wanted)
        error, change = loop.error(rho)
        bounds.append({"rms": error, "command_change": change, "rms_simulated": loop.simulated(rho)})
    corners = itertools.product([1 - SPREAD, 1 + SPREAD], repeat=3)
    drawn = [Loop([p * c for p, c in zip(plant, corner)], period, delay, noise, load) for corner in corners]
    free = [loop.error(FREE)[0] for loop in drawn]
    print(json.dumps({"noise": noise, "load": load, "bounds": bounds, "drawn": [min(free), max(free)]}))


main()
