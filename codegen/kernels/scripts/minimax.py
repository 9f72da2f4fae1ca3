#!/usr/bin/env python3
"""Coefficients of codegen/nn/kernels/math/exponential.rs: minimax fits by Lawson's iteration.

Usage: minimax.py. Prints, for each function, numerator and denominator, lowest power first, and the
levelled error. Each fit minimises |weight(x) (f(x) - s(x) P(v(x)) / Q(v(x)))| over an interval.
"""
import math
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[3] / "firmware/mpc/scripts"))
from tanh_minimax import solve  # noqa: E402


def horner(c, v):
    total = 0.0
    for a in reversed(c):
        total = total * v + a
    return total


def fit(f, s, v, weight, m, n, low, high, grid=300, rounds=120):
    """Levels the weighted error of s P(v) / Q(v), Q(0) = 1, by reweighted least squares."""
    xs = [low + (high - low) * 0.5 * (1 - math.cos(math.pi * (i + 0.5) / grid)) for i in range(grid)]
    lawson, best = [1.0 / grid] * grid, None
    p, q = [1.0], [1.0] + [0.0] * n
    for k in range(rounds):
        for _ in range(12 if k == 0 else 2):
            size = m + n + 1
            a, b = [[0.0] * size for _ in range(size)], [0.0] * size
            for x, w in zip(xs, lawson):
                t, y = v(x), f(x)
                scale = w * (weight(x) / horner(q, t)) ** 2
                row = [s(x) * t**i for i in range(m + 1)] + [-y * t**i for i in range(1, n + 1)]
                for i in range(size):
                    b[i] += scale * row[i] * y
                    for j in range(size):
                        a[i][j] += scale * row[i] * row[j]
            solution = solve(a, b)
            p, q = solution[: m + 1], [1.0] + solution[m + 1 :]
        errors = [abs(weight(x) * (f(x) - s(x) * horner(p, v(x)) / horner(q, v(x)))) for x in xs]
        if best is None or max(errors) < best[2]:
            best = p, q, max(errors)
        lawson = [w * e for w, e in zip(lawson, errors)]
        total = sum(lawson)
        lawson = [w / total for w in lawson]
    return best


if __name__ == "__main__":
    half = 0.5 * math.log(2.0)
    cases = {
        "EXP, e^r = 1 + r P(r)": (lambda r: math.expm1(r), lambda r: r, lambda r: r, lambda r: math.exp(-r), 4, 0, -half, half),
        "TANH, near: x + x^3 P(x^2)": (lambda x: math.tanh(x) - x, lambda x: x**3, lambda x: x * x, lambda x: 1 / math.tanh(x), 4, 0, 1e-2, 0.65),
        "LN_1P, x P(x) / Q(x)": (math.log1p, lambda x: x, lambda x: x, lambda x: 1 / math.log1p(x), 3, 3, 1e-6, 1.0),
        "ERF, x P(x^2) / Q(x^2)": (math.erf, lambda x: x, lambda x: x * x, lambda x: 1.0, 5, 5, 0.0, 4.0),
    }
    for name, case in cases.items():
        p, q, worst = fit(*case)
        print(name)
        print("  P", ", ".join(f"{c:.9e}" for c in p))
        if len(q) > 1:
            print("  Q", ", ".join(f"{c:.9e}" for c in q))
        print(f"  error {worst:.2e}")
