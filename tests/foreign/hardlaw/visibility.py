"""What the believed model cannot follow even after a refit of its free parameters: is the effect visible?

Levenberg-Marquardt with one-sided differences on noise-free recordings from the true start. Only used to
choose and label strengths; the program under test never sees it.
"""

import numpy as np

from . import motion
from .system import build, relaxed, scales


def replay(rig, values, recordings, tolerance=1e-6, effects=()):
    """Signals of a model driven by the inputs of recordings from their start states, one array each; None if it fails."""
    runs = []
    for r in recordings:
        s, states = build(rig, values, effects)
        n = len(rig.bodies())
        y = relaxed(s, states, r["q0"][:n], r["v0"][:n])
        samples = len(r["t"])
        idle = motion.Control(0.0, 0.0, np.zeros(1), 0, np.inf, 1.0)
        w = motion.work(s, states, scales(s, states, r["typical"], rig))
        nothing = np.zeros((samples, max(s.n, len(s.sensors))))
        _, clean, _ = motion.record(s, y, r["t"], r["u"].copy(), nothing, nothing, np.zeros(len(s.sensors)), idle, False, tolerance, w)
        if not np.isfinite(clean).all():
            return None
        runs.append(clean)
    return runs


def residual(rig, values, recordings, sigma, effects):
    present = [{**e, "parameters": {k: values["%d %s" % (i, k)] for k in e["parameters"]}} for i, e in enumerate(effects)]
    runs = replay(rig, values, recordings, effects=present)
    if runs is None:
        return None
    return np.concatenate([((run - r["clean"]) / sigma).ravel() for run, r in zip(runs, recordings)])


# Over the noise: so much is visible without being known to the per cent.
PLAIN = 30.0

# And so little is as good as nothing.
HIDDEN = 0.1

# Rounds in a row that gain little before a refit ends: it crawls along a valley before it gets on.
PATIENCE = 3

# Other valleys are looked for below this, from so many starts, each number off by up to this factor's logarithm.
DOUBTFUL, STARTS, OFF = 5.0, 6, 1.2

# A number this many times as large or as small as it is makes another rig, which takes long to simulate.
FARTHEST = 50.0


def after_refit(rig, values, recordings, sigma, effects=(), rounds=40, enough=HIDDEN):
    """RMS of what a refit leaves, over the noise `sigma` of each sensor; `values`: where it starts. Less than `enough` is not made less.

    Ended early, it would call visible what the rig's own parameters can follow: a coupling of two bodies of a linear
    chain, of which four rounds left one to three times the noise, and a search that went on nothing; or a hidden mode, of
    which the first round that gained less than a fiftieth left 18.6 times the noise, and the seventh after it 0.67.
    `effects` are in the model and refitted too, from the parameters that they have."""
    values = dict(values)
    free = list(rig.free)
    for i, e in enumerate(effects):
        for name, value in e["parameters"].items():
            values["%d %s" % (i, name)] = value
            if value != 0.0 and name not in ("side", "exponent"):
                free.append("%d %s" % (i, name))
    reach = {name: sorted((values[name] / FARTHEST, values[name] * FARTHEST)) for name in free}
    at = residual(rig, values, recordings, sigma, effects)
    if at is None:
        return np.inf
    cost, damp, idle = at @ at, 1e-3, 0
    for _ in range(rounds):
        jac = np.empty((len(at), len(free)))
        for i, name in enumerate(free):
            moved = dict(values)
            moved[name] *= 1.0 + 1e-4
            there = residual(rig, moved, recordings, sigma, effects)
            if there is None:
                return np.sqrt(cost / len(at))
            jac[:, i] = (there - at) / 1e-4  # by the logarithm: parameters keep their sign
        before = cost
        for _ in range(8):
            a = jac.T @ jac
            step = np.linalg.solve(a + damp * np.diag(np.diag(a) + 1e-12 * np.trace(a) + 1e-300), -jac.T @ at)
            tried = {n: values[n] * np.exp(np.clip(d, -0.7, 0.7)) for n, d in zip(free, step)}
            tried = {n: np.clip(value, *reach[n]) for n, value in tried.items()}
            trial = residual(rig, {**values, **tried}, recordings, sigma, effects)
            if trial is not None and trial @ trial < cost:
                values.update(tried)
                at, cost = trial, trial @ trial
                damp = max(1e-9, 0.2 * damp)
                break
            damp *= 6.0
        plain = cost > PLAIN**2 * len(at)
        idle = idle + 1 if cost > (0.8 if plain else 0.98) * before else 0
        little = cost < enough**2 * len(at)
        if idle >= (1 if plain else PATIENCE) or cost == before or little:
            break
    return float(np.sqrt(cost / len(at)))


def from_anywhere(rig, values, recordings, sigma, effects, enough, starts):
    """The least that `after_refit` leaves from the true numbers and from `starts` others, or the first that is less than `enough`.

    Of a delay before a two-mass drive the refit from the true numbers left 2.1 times the noise, and one from a soft shaft and
    a light load 0.4: what a local refit leaves is what its valley leaves. More than DOUBTFUL is taken as it is."""
    left = after_refit(rig, values, recordings, sigma, effects, enough=enough)
    random = np.random.default_rng(len(rig.free))
    for _ in range(starts):
        if not enough < left < DOUBTFUL:
            break
        start = {n: v * np.exp(random.uniform(-OFF, OFF)) if n in rig.free else v for n, v in values.items()}
        left = min(left, after_refit(rig, start, recordings, sigma, effects, enough=enough))
    return left
