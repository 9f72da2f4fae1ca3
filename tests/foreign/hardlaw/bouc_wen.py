"""The Bouc-Wen hysteresis benchmark, with its published parameters, written by this integrator.

    python -m hardlaw.bouc_wen --out DIR

Noel and Schoukens, "Hysteretic benchmark with a dynamic nonlinearity", 2016 (nonlinearbenchmark.org):

    m y'' + c y' + k y + z = u,    z' = a y' - b (g |y'| |z|^(nu-1) z + d y' |z|^nu)

with m 2 kg, c 10 N s/m, k 5e4 N/m, a 5e4 N/m, b 1e3, g 0.8, d -1.1, nu 1. The vocabulary's law has the memory Z = z/a,
hence alpha = a, beta = b g = 800 1/m, gamma = b d = -1100 1/m, exponent 1. Inputs at 750 Hz: multisines of 50 N RMS between
5 and 150 Hz, and a sine that sweeps from 20 to 50 Hz at 10 Hz a minute with 40 N. Between samples the input is a straight line
(`hold = "linear"`); the published recordings were integrated at 15 kHz and filtered, so these are another
realisation of the same device and not the same numbers. Noise of 8e-6 m RMS on what is fitted, none on the two tests.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

from . import motion
from .effects import Typical
from .system import Rig, build, relaxed, scales

RATE_HZ, NOISE_M, SEED = 750.0, 8e-6, 5
TRUE = {"alpha": 5e4, "beta": 800.0, "gamma": -1100.0, "exponent": 1.0}


def rig():
    found = Rig("Bouc-Wen benchmark")
    found.add("body", name="mass", motion="slide", inertia=2.0, free=["inertia"])
    found.add("spring", name="spring", **{"from": "ground"}, to="mass", stiffness=5e4, free=["stiffness"])
    found.add("damper", name="damper", **{"from": "ground"}, to="mass", damping=10.0, free=["damping"])
    found.add("actuator", name="shaker", drives="mass", input="u_N", hold="linear", gain=1.0)
    found.add("sensor", name="gauge", reads="mass.position", signal="y_m")
    return found


def multisine(rng, samples):
    """All lines of a period of 8192 samples between 5 and 150 Hz at random phases, 50 N RMS."""
    period = 8192
    lines = np.arange(int(np.ceil(5.0 / RATE_HZ * period)), int(150.0 / RATE_HZ * period) + 1)
    spectrum = np.zeros(period // 2 + 1, complex)
    spectrum[lines] = np.exp(2j * np.pi * rng.uniform(size=len(lines)))
    x = np.fft.irfft(spectrum, period)
    x *= 50.0 / np.sqrt(np.mean(x * x))
    return np.resize(x, samples)


def sweep(seconds=180.0):
    """20 to 50 Hz at 10 Hz a minute, 40 N."""
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    return 40.0 * np.sin(2.0 * np.pi * (20.0 * t + 0.5 * (10.0 / 60.0) * t * t))


def respond(found, u, tolerance=1e-10):
    """Positions from rest."""
    effects = [{"kind": "hysteresis", "component": "spring", "parameters": TRUE}]
    s, states = build(found, found.values(), effects)
    size = Typical(position={"mass": (-1e-3, 1e-3)}, speed={"mass": 0.2}, extension={"spring": 1e-3})
    w = motion.work(s, states, scales(s, states, size, found))
    n = len(u)
    t = np.arange(n) / RATE_HZ
    idle = motion.Control(0.0, 0.0, np.zeros(1), 0, np.inf, 1.0)
    zero = np.zeros((n, 1))
    _, clean, _ = motion.record(s, relaxed(s, states, np.zeros(1), np.zeros(1)), t, u[:, None].copy(), zero, zero, np.zeros(1), idle, True, tolerance, w)
    return t, clean[:, 0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([SEED])
    found = rig()
    # What its owner believes: the linear part, each number a few per cent off; what hysteresis adds to the stiffness is not known.
    believed = {"mass.inertia": 2.08, "spring.stiffness": 9.0e4, "damper.damping": 14.0}
    (out / "rig.toml").write_text(found.toml(believed, {}))
    runs = {"fit-a": multisine(rng, 8192), "fit-b": multisine(rng, 8192), "check": multisine(rng, 8192),
            "test-multisine": multisine(rng, 8192), "test-sweep": sweep()}
    for name, u in runs.items():
        u = np.array([float("%.6g" % v) for v in u])
        t, y = respond(found, u)
        noise = 0.0 if name.startswith("test") else NOISE_M
        seen = y + noise * rng.standard_normal(len(y))
        rows = ["%.9g,%.6g,%.9g" % row for row in zip(t, u, seen)]
        (out / (name + ".csv")).write_text("\n".join(["t,u_N,y_m", *rows]) + "\n")
        finer = respond(found, u[:2000], 1e-13)[1]
        print("%-15s RMS %.3e m, integrated to within %.1e m" % (name, y.std(), np.abs(finer - y[:2000]).max()), file=sys.stderr)
    (out / "truth.json").write_text(json.dumps({"effects": [{"kind": "hysteresis", "component": "spring", "parameters": TRUE}],
                                                "parameters": {"mass.inertia": 2.0, "spring.stiffness": 5e4, "damper.damping": 10.0}}, indent=1) + "\n")


if __name__ == "__main__":
    main()
