#!/usr/bin/env python3
"""Coefficients of firmware/mpc/src/math.rs: the minimax rational x P(x^2) / Q(x^2) of tanh on [0, C].

Remez exchange in double precision, Q(0) = 1. Usage: tanh_minimax.py [M N C]
M, N: degrees of P and Q in x^2. Prints the coefficients and the levelled error.
Beyond C the argument is clamped, so the value there stays at tanh(C) to within the error.
"""
import math
import sys


def solve(a, b):
    """Gaussian elimination with partial pivoting."""
    n = len(b)
    rows = [row[:] + [b[i]] for i, row in enumerate(a)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda r: abs(rows[r][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for r in range(i + 1, n):
            factor = rows[r][i] / rows[i][i]
            for c in range(i, n + 1):
                rows[r][c] -= factor * rows[i][c]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (rows[i][n] - sum(rows[i][c] * x[c] for c in range(i + 1, n))) / rows[i][i]
    return x


def evaluate(p, q, x):
    z = x * x
    return x * sum(c * z**i for i, c in enumerate(p)) / sum(c * z**i for i, c in enumerate(q))


def fit(m, n, xs, weights, rounds=30):
    """Weighted least squares of x P - tanh Q, reweighted by 1 / Q so that it is the error of P / Q."""
    q = [1.0] + [0.0] * n
    for _ in range(rounds):
        size = m + n + 1
        a, b = [[0.0] * size for _ in range(size)], [0.0] * size
        for x, w in zip(xs, weights):
            z, t = x * x, math.tanh(x)
            v = w / sum(c * z**i for i, c in enumerate(q)) ** 2
            row = [x * z**k for k in range(m + 1)] + [-t * z**k for k in range(1, n + 1)]
            for i in range(size):
                b[i] += v * row[i] * t
                for j in range(size):
                    a[i][j] += v * row[i] * row[j]
        sol = solve(a, b)
        p, q = sol[:m + 1], [1.0] + sol[m + 1:]
    return p, q


def minimax(m, n, c, grid=400):
    """Lawson's iteration: weights grow where the error is large until it is level."""
    xs = [c * math.sin(0.5 * math.pi * (i + 0.5) / grid) for i in range(grid)]
    weights, best = [1.0 / grid] * grid, None
    for k in range(150):
        p, q = fit(m, n, xs, weights, 30 if k == 0 else 2)
        errors = [abs(evaluate(p, q, x) - math.tanh(x)) for x in xs]
        if best is None or max(errors) < best[2]:
            best = p, q, max(errors)
        weights = [w * e for w, e in zip(weights, errors)]
        total = sum(weights)
        weights = [w / total for w in weights]
    return best


if __name__ == "__main__":
    m, n, c = (int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])) if len(sys.argv) == 4 else (3, 3, 7.0)
    p, q, worst = minimax(m, n, c)
    print("P", " ".join(f"{v:.9e}" for v in p))
    print("Q", " ".join(f"{v:.9e}" for v in q))
    print(f"error {worst:.3e}, beyond C {1.0 - math.tanh(c):.3e}")
