#!/usr/bin/env python3
"""Recordings of a damper on a test stand: the stand imposes the motion, a load cell shows the force.

    x = sum of sines, whose derivatives are written down
    F = c v + F_c sign(v) + offset of the load cell

Nothing is integrated. Shares no code with the project's simulator. Only the standard library; the
seeds are fixed. Run without arguments to rewrite rigs/damper-stand.fit.csv and
rigs/damper-stand.test.csv, or with --check to compare (exit status 1 if they differ).
"""

import math
import random
from pathlib import Path

from keep import keep
from mass_spring_damper import gauss

RATE_HZ = 200
DAMPING_N_S_M = 84.0
FRICTION_N = 23.0
OFFSET_N = -3.5
NOISE_M, NOISE_N = 2e-5, 0.4

# Amplitude (m), frequency (Hz) and phase of each sine.
MOTIONS = {
    "fit": (3, [(0.030, 0.5, 0.0), (0.006, 2.3, 1.0)]),
    "test": (8, [(0.022, 0.8, 0.4), (0.010, 1.7, 2.0)]),
}


def recording(name, rows):
    """The text of one CSV file."""
    seed, sines = MOTIONS[name]
    source = random.Random(seed)
    lines = [
        "# A damper on a test stand at %d Hz; written by tests/foreign/damper_stand.py" % RATE_HZ,
        "t,x_m,f_N",
    ]
    for row in range(rows):
        t = row / RATE_HZ
        angles = [(a, 2.0 * math.pi * f, 2.0 * math.pi * f * t + p) for a, f, p in sines]
        x = sum(a * math.sin(angle) for a, _, angle in angles)
        v = sum(a * w * math.cos(angle) for a, w, angle in angles)
        force = DAMPING_N_S_M * v + math.copysign(FRICTION_N, v) + OFFSET_N
        x += NOISE_M * gauss(source)
        force += NOISE_N * gauss(source)
        lines.append("%.4f,%.6f,%.3f" % (t, x, force))
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    folder = Path(__file__).resolve().parents[2] / "rigs"
    files = {"damper-stand.%s.csv" % name: recording(name, 1600) for name in MOTIONS}
    keep(folder, files, __doc__)
