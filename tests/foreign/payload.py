#!/usr/bin/env python3
"""Recordings of a mass on a spring whose payload and sensor zero differ by recording.

    m x'' + c x' + k x = 0, let go at rest from x0
    x = x0 exp(-s t) (cos(w t) + s / w sin(w t)), s = c / (2 m), w^2 = k / m - s^2

The closed form is written down and nothing is integrated. Shares no code with the project's
simulator. Only the standard library; the seeds are fixed. Run without arguments to rewrite
tests/foreign/payload, or with --check to compare (exit status 1 if they differ).
"""

import math
import random
from pathlib import Path

from keep import keep
from mass_spring_damper import gauss

RATE_HZ = 100
STIFFNESS_N_M = 120.0
DAMPING_N_S_M = 1.4
START_M = 0.05
NOISE_M = 1e-4

# Seed, mass with its payload (kg) and zero of the sensor (m) of each recording.
RECORDINGS = {
    "first": (1, 2.0, 0.0015),
    "second": (2, 2.6, -0.0008),
    "third": (3, 3.5, 0.0004),
    "unseen": (4, 4.4, -0.002),
}


def recording(name, rows):
    """The text of one CSV file."""
    seed, mass, zero = RECORDINGS[name]
    source = random.Random(seed)
    decay = DAMPING_N_S_M / (2.0 * mass)
    omega = math.sqrt(STIFFNESS_N_M / mass - decay * decay)
    lines = [
        "# A mass on a spring, let go, at %d Hz; written by tests/foreign/payload.py" % RATE_HZ,
        "t,q_m",
    ]
    for row in range(rows):
        t = row / RATE_HZ
        wave = math.cos(omega * t) + decay / omega * math.sin(omega * t)
        q = START_M * math.exp(-decay * t) * wave + zero
        lines.append("%.2f,%.6f" % (t, q + NOISE_M * gauss(source)))
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    folder = Path(__file__).resolve().parent / "payload"
    files = {"%s.csv" % name: recording(name, 500) for name in RECORDINGS}
    keep(folder, files, __doc__)
