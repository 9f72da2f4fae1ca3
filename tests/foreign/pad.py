#!/usr/bin/env python3
"""Recordings of masses on pads whose law no effect has, written by somebody else's physics.

A pad answers an extension x with the force A sinh(x / a). One block stands on one pad. A tower has two masses: the lower
one on a pad twice as long and three times as wide, the upper one on the lower by a pad as the block's. Along each

    m q'' = sum of the pads' forces - c q' + u

under a force u that is held between samples. The integrator is Gauss-Legendre's implicit method of order 4 with its
stages found by iteration, in steps of a fortieth of a sample. It shares no code and no method with the project's
simulator.

Only the standard library; the seeds are fixed. Run without arguments to rewrite, in tests/foreign/pad,

    block.fit.csv, block.check.csv    one block, noisy: a law is learned from them
    tower.csv                         two masses, noisy: another shape with pads of the same law
    truth.json                        what was true

or with --check to compare what is there with what would be written (exit status 1 if it differs).
"""

import json
import math
import random
from pathlib import Path

from keep import keep
from mass_spring_damper import gauss

# N and m of the pad; kg, N s/m.
FORCE, LENGTH = 3.0, 0.02
BLOCK = {"mass": [0.5], "damping": [1.1]}
TOWER = {"mass": [1.2, 0.4], "damping": [2.0, 0.7]}
# Times as long and as wide as the block's pad.
PADS = {"block": [(1.0, 1.0)], "tower": [(2.0, 3.0), (1.0, 1.0)]}
RATE_HZ, SECONDS, PARTS = 200, 6.0, 40
HELD_S = (0.05, 0.5)
NOISE_M = 5e-5
LARGEST_N = {"block.fit": 9.0, "block.check": 9.0, "tower": 6.0}
SEEDS = {"block.fit": 21, "block.check": 22, "tower": 23}
ROOT3 = math.sqrt(3.0)
# Gauss-Legendre, order 4.
STAGES = ((0.25, 0.25 - ROOT3 / 6.0), (0.25 + ROOT3 / 6.0, 0.25))


def rates(state, force, device, pads):
    """Velocities and accelerations; the force acts on the last mass."""
    count = len(device["mass"])
    q, v = state[:count], state[count:]
    pushed = [-c * speed for c, speed in zip(device["damping"], v)]
    pushed[-1] += force
    for i, (length, width) in enumerate(pads):
        x = q[i] - (q[i - 1] if i > 0 else 0.0)
        answer = width * FORCE * math.sinh(x / (length * LENGTH))
        pushed[i] -= answer
        if i > 0:
            pushed[i - 1] += answer
    return list(v) + [f / m for f, m in zip(pushed, device["mass"])]


def step(state, force, device, pads, h):
    slopes = [rates(state, force, device, pads)] * 2
    for _ in range(60):
        before = slopes
        at = [[x + h * sum(a * k[i] for a, k in zip(row, slopes)) for i, x in enumerate(state)] for row in STAGES]
        slopes = [rates(stage, force, device, pads) for stage in at]
        if max(abs(a - b) for k, l in zip(slopes, before) for a, b in zip(k, l)) < 1e-13:
            break
    return [x + 0.5 * h * (k + l) for x, k, l in zip(state, *slopes)]


def levels(source, count, largest):
    """Random levels, each held for a random time, from rest."""
    values = [0.0] * 20
    while len(values) < count:
        level = round(source.uniform(-largest, largest), 6)
        values += [level] * round(RATE_HZ * source.uniform(*HELD_S))
    return values[:count]


def recording(name):
    """The text of one CSV file."""
    source = random.Random(SEEDS[name])
    shape = name.split(".")[0]
    device = BLOCK if shape == "block" else TOWER
    count = round(SECONDS * RATE_HZ)
    forces = levels(source, count, LARGEST_N[name])
    masses = len(device["mass"])
    state, rows = [0.0] * (2 * masses), []
    for i, force in enumerate(forces):
        seen = [q + NOISE_M * gauss(source) for q in state[:masses]]
        rows.append("%.3f,%.6f," % (i / RATE_HZ, force) + ",".join("%.7f" % q for q in seen))
        for _ in range(PARTS):
            state = step(state, force, device, PADS[shape], 1.0 / (RATE_HZ * PARTS))
    names = ["q_m"] if masses == 1 else ["lower_m", "upper_m"]
    lines = ["# Masses on pads at %d Hz; written by tests/foreign/pad.py" % RATE_HZ, ",".join(["t", "u_N"] + names)]
    return "\n".join(lines + rows) + "\n"


def main():
    folder = Path(__file__).resolve().parent / "pad"
    files = {name + ".csv": recording(name) for name in SEEDS}
    truth = {"force_N": FORCE, "length_m": LENGTH, "noise_m": NOISE_M, "block": BLOCK, "tower": TOWER, "pads": PADS}
    files["truth.json"] = json.dumps(truth, indent=1) + "\n"
    keep(folder, files, __doc__)


if __name__ == "__main__":
    main()
