"""Integration between events, and a recording of it.

Dormand-Prince 5(4) with the step chosen by its own error estimate. Contacts keep their mode (at rest,
sliding forward, sliding backward) within a step; a step in which one would turn round or break away is
cut by bisection to where it happens. Kinks and jumps of other laws (gaps, stops, slack) are met by the
error control. Nothing is smoothed.
"""

from collections import namedtuple

import numpy as np
from numba import njit

from . import laws
from .laws import AC_DELAY, AC_PLAY, FR_J, SE_GAIN, SE_LAG, SE_OFFSET, SE_PLAY, SE_STATE, STICK

TOLERANCE = 1e-9  # error of one step over the size of the motion

STEPS = 3000  # in one sample interval; beyond that the motion is given up as too stiff (not a number)

Work = namedtuple("Work", "f mass press reaction who matrix right k trial scale modes")
Control = namedtuple("Control", "kp kd reference sensor limit smooth")

# Dormand and Prince, "A family of embedded Runge-Kutta formulae", 1980, table 2.
NODE = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
WEIGHT = np.array([
    [0, 0, 0, 0, 0, 0],
    [1 / 5, 0, 0, 0, 0, 0],
    [3 / 40, 9 / 40, 0, 0, 0, 0],
    [44 / 45, -56 / 15, 32 / 9, 0, 0, 0],
    [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0],
    [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0],
    [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
])
FIFTH_LESS_FOURTH = np.array(
    [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])


def work(s, states, scale):
    """Scratch memory for one run. scale: size of each state, against which errors are measured."""
    n, count, tendons = s.n, s.frictions.shape[0], s.tendons.shape[0]
    actuators = s.actuators.shape[0]
    press = (np.zeros(count), np.zeros(n), np.zeros(n), np.zeros(tendons), np.zeros(actuators), np.ones(count))
    return Work(np.zeros(n), np.zeros(n), press, np.zeros(count), np.zeros(count, np.int64),
                np.zeros((count, count)), np.zeros(count), np.zeros((7, states)), np.zeros(states),
                scale.copy(), np.zeros(count, np.int64))


@njit(cache=True)
def attempt(s, y, t, h, u, slope, modes, w):
    """One step of length h into w.trial, where w.k[6] is the rate; its error over the tolerance of the scale."""
    size = y.shape[0]
    now = np.empty_like(u)
    for stage in range(7):
        for i in range(size):
            total = 0.0
            for j in range(stage):
                total += WEIGHT[stage, j] * w.k[j, i]
            w.trial[i] = y[i] + h * total
        for a in range(u.shape[0]):
            now[a] = u[a] + slope[a] * NODE[stage] * h
        laws.rates(s, w.trial, t + NODE[stage] * h, now, modes, w.k[stage], w)
    worst = 0.0
    for i in range(size):
        error = 0.0
        for j in range(7):
            error += FIFTH_LESS_FOURTH[j] * w.k[j, i]
        worst = max(worst, abs(h * error) / max(w.scale[i], abs(w.trial[i])))
    return worst


@njit(cache=True)
def turned(s, t, modes, w):
    """Whether at the end of the step in w.trial a sliding contact has turned round or a resting one let go."""
    for j in range(s.frictions.shape[0]):
        if modes[j] != STICK:
            if modes[j] * laws.along(s, j, w.trial, s.n) < 0.0:
                return True
        elif broken(s, j, w.trial, t, w) != 0:
            return True
    return False


@njit(cache=True)
def broken(s, j, y, t, w):
    """+1 or -1 where resting contact j gives way to that side, else 0; reactions as of the last rates()."""
    q = laws.along(s, j, y, 0)
    if -w.reaction[j] > laws.hold(s, j, 1, q, t, w.press):
        return 1
    if w.reaction[j] > laws.hold(s, j, -1, q, t, w.press):
        return -1
    return 0


@njit(cache=True)
def release(s, y, t, u, modes, w):
    """Lets go of every resting contact that does not hold, one after another."""
    for _ in range(s.frictions.shape[0]):
        laws.rates(s, y, t, u, modes, w.k[0], w)
        worst, who, way = 0.0, -1, 0
        for j in range(s.frictions.shape[0]):
            if modes[j] == STICK:
                side = broken(s, j, y, t, w)
                if side != 0 and abs(w.reaction[j]) > worst:
                    worst, who, way = abs(w.reaction[j]), j, side
        if who < 0:
            return
        modes[who] = way


@njit(cache=True)
def settle_contacts(s, y, t, u, modes, w):
    """After an event: contacts that turned round come to rest, and slide on if they cannot hold."""
    n = s.n
    for j in range(s.frictions.shape[0]):
        if modes[j] != STICK:
            v = laws.along(s, j, y, n)
            if modes[j] * v <= 0.0:
                weight = 0.0
                for i in range(n):
                    weight += s.frictions[j, FR_J + i] ** 2 / s.inertia[i]
                for i in range(n):
                    y[n + i] -= s.frictions[j, FR_J + i] / s.inertia[i] / weight * v
                modes[j] = STICK
    release(s, y, t, u, modes, w)


@njit(cache=True)
def advance(s, y, t, end, u, slope, modes, h, tolerance, w):
    """From t to end with inputs u + slope (time - t); returns the step to go on with. y and modes change."""
    size = y.shape[0]
    start = t
    events, steps = 0, 0
    now = u.copy()
    release(s, y, t, now, modes, w)
    while t < end:
        steps += 1
        if steps > STEPS:
            y[:] = np.nan
            return h
        left = end - t
        h = min(h, left)
        if left - h < 1e-9 * (end - start):
            h = left
        error = attempt(s, y, t, h, now, slope, modes, w)
        if error > tolerance and h > 1e-10 * (end - start):
            h *= max(0.2, 0.9 * (tolerance / error) ** 0.2)
            continue
        grown = h * min(4.0, 0.9 * (tolerance / max(error, 1e-30)) ** 0.2)
        if turned(s, t + h, modes, w) and events < 200:
            low, high = 0.0, h
            for _ in range(60):
                middle = 0.5 * (low + high)
                attempt(s, y, t, middle, now, slope, modes, w)
                if turned(s, t + middle, modes, w):
                    high = middle
                else:
                    low = middle
                if high - low < 1e-12 * (end - start):
                    break
            attempt(s, y, t, high, now, slope, modes, w)
            y[:] = w.trial
            t += high
            for a in range(u.shape[0]):
                now[a] = u[a] + slope[a] * (t - start)
            settle_contacts(s, y, t, now, modes, w)
            events += 1
            h = max(high, 1e-3 * grown)
            continue
        for i in range(size):
            y[i] = w.trial[i]
        t += h
        for a in range(u.shape[0]):
            now[a] = u[a] + slope[a] * (t - start)
        h = grown
    return h


@njit(cache=True)
def measure(s, y, t, u, modes, w, out):
    """Signals of all sensors, without noise."""
    laws.rates(s, y, t, u, modes, w.k[0], w)
    for k in range(s.sensors.shape[0]):
        row = s.sensors[k]
        value = y[int(row[SE_STATE])] if row[SE_STATE] >= 0 else laws.reading(s, k, y, w.press[3])
        out[k] = row[SE_GAIN] * value + row[SE_OFFSET]


@njit(cache=True)
def fill_lags(s, y, u, modes, w, act_state, t):
    """Lags start with the first value that passes through them."""
    for a in range(s.actuators.shape[0]):
        if s.actuators[a, laws.AC_STATE] >= 0:
            y[int(s.actuators[a, laws.AC_STATE])] = laws.shaped(u[a], s.actuators[a])
    laws.rates(s, y, t, u, modes, w.k[0], w)
    for k in range(s.sensors.shape[0]):
        if s.sensors[k, SE_STATE] >= 0:
            y[int(s.sensors[k, SE_STATE])] = laws.reading(s, k, y, w.press[3])


@njit(cache=True)
def inputs_at(s, t, k, now, inputs, held, u):
    """Inputs behind delay and play at the time `now` of interval k; returns when the next delayed one arrives."""
    until = np.inf
    for a in range(s.actuators.shape[0]):
        delay = s.actuators[a, AC_DELAY]
        j = k
        while j > 0 and t[j] + delay > now + 1e-12 * (t[k] - t[k - 1]):
            j -= 1
        if delay > 0.0 and j + 1 <= k:
            until = min(until, t[j + 1] + delay)
        half = 0.5 * s.actuators[a, AC_PLAY]
        held[a] = min(max(held[a], inputs[j, a] - half), inputs[j, a] + half)
        u[a] = held[a]
    return until


@njit(cache=True)
def record(s, y, t, inputs, disturbance, noise, quantum, control, linear, tolerance, w):
    """Signals (samples, sensors) with noise, the same without, and states (samples, states).

    `inputs` (samples, actuators) is what is asked for and becomes what was applied where a controller adds
    to actuator 0. `disturbance` (samples, n): unmeasured generalised forces, held between samples.
    """
    samples, actuators, sensors = t.shape[0], s.actuators.shape[0], s.sensors.shape[0]
    measured = np.zeros((samples, sensors))
    clean = np.zeros((samples, sensors))
    states = np.zeros((samples, y.shape[0]))
    modes = w.modes
    u = np.zeros(actuators)
    slope = np.zeros(actuators)
    held = np.zeros(actuators)  # behind the play
    sensed = np.zeros(sensors)  # behind a sensor's play
    load = s.load.copy()
    h = 1e30
    last, rate = 0.0, 0.0
    for k in range(samples):
        if not np.isfinite(y[0]):
            states[k:] = np.nan
            clean[k:] = np.nan
            break
        if k == 0:
            for a in range(actuators):
                u[a] = inputs[0, a]
                held[a] = u[a]
            fill_lags(s, y, u, modes, w, held, t[0])
        if control.kp == 0.0:
            # An input holds from its own sample on: a tension follows it at once. A controller measures first.
            inputs_at(s, t, k, t[k], inputs, held, u)
        measure(s, y, t[k], u, modes, w, clean[k])
        for m in range(sensors):
            if s.sensors[m, SE_PLAY] > 0.0:
                half = 0.5 * s.sensors[m, SE_PLAY]
                if k == 0:
                    sensed[m] = clean[k, m]
                sensed[m] = min(max(sensed[m], clean[k, m] - half), clean[k, m] + half)
                clean[k, m] = sensed[m]
            measured[k, m] = clean[k, m] + noise[k, m]
            if quantum[m] > 0.0:
                measured[k, m] = quantum[m] * np.rint(measured[k, m] / quantum[m])
        states[k] = y
        if control.kp != 0.0:
            seen = measured[k, control.sensor]
            if k > 0:
                rate += control.smooth * ((seen - last) / (t[k] - t[k - 1]) - rate)
            last = seen
            asked = inputs[k, 0] + control.kp * (control.reference[k] - seen) - control.kd * rate
            inputs[k, 0] = min(max(asked, -control.limit), control.limit)
        if k + 1 == samples:
            break
        for i in range(s.n):
            s.load[i] = load[i] + disturbance[k, i]
        begin = t[k]
        while begin < t[k + 1]:
            end = t[k + 1]
            end = min(end, inputs_at(s, t, k, begin, inputs, held, u))
            for a in range(actuators):
                slope[a] = (inputs[k + 1, a] - inputs[k, a]) / (t[k + 1] - t[k]) if linear else 0.0
            h = advance(s, y, begin, end, u, slope, modes, h, tolerance, w)
            begin = end
    s.load[:] = load
    return measured, clean, states
