"""Inputs and references that a sensible engineer would use: rest, multisine, steps, slow triangle, chirp.

Each is between -1 and 1; `tau` is 1/omega of the rig's main resonance or bandwidth, so that nothing here has
a scale of its own.
"""

import numpy as np

PARTS = ("multisine", "steps", "triangle", "chirp", "slow")


def multisine(rng, t, tau, lowest=0.05, highest=3.0, count=24):
    """Logarithmically spaced tones at random phases."""
    omega = np.geomspace(lowest, highest, count) / tau
    phase = rng.uniform(0.0, 2.0 * np.pi, count)
    x = np.sin(np.outer(t, omega) + phase).sum(axis=1)
    return x / np.abs(x).max()


def steps(rng, t, tau):
    """Random levels held for random times."""
    x = np.zeros_like(t)
    begin = 0.0
    while begin < t[-1]:
        hold = rng.uniform(4.0, 20.0) * tau
        x[(t >= begin) & (t < begin + hold)] = rng.uniform(-1.0, 1.0)
        begin += hold
    return x


def triangle(rng, t, tau):
    """Slow ramps up and down."""
    period = rng.uniform(40.0, 90.0) * tau
    phase = (t / period + rng.uniform()) % 1.0
    return rng.uniform(0.6, 1.0) * (4.0 * np.abs(phase - 0.5) - 1.0)


def chirp(rng, t, tau):
    """One sweep from slow to fast."""
    low, high = 0.1 / tau, rng.uniform(1.5, 3.0) / tau
    span = max(t[-1] - t[0], 1e-12)
    return rng.uniform(0.5, 1.0) * np.sin(low * t + 0.5 * (high - low) * t * t / span)


def slow(rng, t, tau):
    """A slow multisine that turns often: what friction shows in."""
    return rng.uniform(0.4, 0.9) * multisine(rng, t, tau, 0.03, 0.5, 12)


def mixed(rng, t, tau, parts=None):
    """A rest, then three of the parts in random order, each at a random level, and a last rest."""
    t = t - t[0]
    chosen = parts or ["multisine", *rng.permutation(["steps", "triangle", "chirp", "slow"])[:2]]
    rest = min(6.0 * tau, 0.05 * t[-1])
    edges = np.concatenate([[rest], np.sort(rng.uniform(0.22, 0.5, 2).cumsum() * (t[-1] - rest) + rest), [t[-1] - rest]])
    x = np.zeros_like(t)
    for name, begin, end in zip(rng.permutation(chosen), edges[:-1], edges[1:]):
        inside = (t >= begin) & (t < end)
        if inside.sum() > 4:
            x[inside] = globals()[name](rng, t[inside] - begin, tau) * rng.uniform(0.6, 1.0)
    return x


def disturbance(rng, t, tau):
    """An unmeasured force with RMS 1: coloured noise, a sine, or both."""
    dt = np.diff(t, append=2 * t[-1] - t[-2])
    memory = tau * 10.0 ** rng.uniform(-0.5, 1.3)
    shocks = rng.standard_normal(len(t))
    x = np.zeros_like(t)
    for k in range(1, len(t)):
        keep = np.exp(-dt[k] / memory)
        x[k] = keep * x[k - 1] + np.sqrt(1.0 - keep * keep) * shocks[k]
    if rng.uniform() < 0.4:
        x = rng.uniform(0.0, 1.0) * x + np.sqrt(2.0) * np.sin(10.0 ** rng.uniform(-0.8, 0.5) / tau * t + rng.uniform(0, 6))
    return x / max(np.sqrt(np.mean(x * x)), 1e-12)
