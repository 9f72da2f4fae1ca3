"""Forces and rates of a mechanism with concealed physics (CONTRACTS' vocabulary and a few laws outside it).

State y: positions q (n), velocities v (n), then memories. Every table is an array with one component a
row; the columns are named here and filled by system.py.
"""

import math

import numpy as np
from numba import njit

# Columns of the tables.
SP_FROM, SP_TO, SP_K, SP_REST, SP_K2, SP_K3, SP_GAP, SP_EPS, SP_OMEGA = range(9)
DA_FROM, DA_TO, DA_C, DA_LAW, DA_Q0 = range(5)
GR_BODY, GR_AMP, GR_ZERO, GR_HINGE = range(4)
RI_BODY, RI_AMP, RI_N, RI_PHASE = range(4)
ST_BODY, ST_AT, ST_K, ST_C, ST_SIDE = range(5)
TE_K, TE_C, TE_PRE, TE_UNI, TE_SLACK, TE_GAP, TE_ACT, TE_ARM = range(8)
AC_BODY, AC_GAIN, AC_DEAD, AC_CURVE, AC_LIMIT, AC_LAG, AC_STATE, AC_PLAY, AC_DELAY, AC_RATE, AC_BACK, AC_SAG = range(12)
FR_LP, FR_LM, FR_SP, FR_SM, FR_VS, FR_DP, FR_DM, FR_MU, FR_SOURCE, FR_EPS, FR_N, FR_WARM, FR_J = range(13)
ME_SPRING, ME_LAW, ME_A, ME_B, ME_C, ME_D, ME_STATE = range(7)
SE_WHAT, SE_AT, SE_GAIN, SE_OFFSET, SE_A, SE_B, SE_LAG, SE_STATE, SE_WAVE, SE_WAVE_N, SE_PLAY = range(11)
IN_EPS, IN_N, IN_PHASE = range(3)

LINEAR, SQUARE, ROOT, VAN_DER_POL = range(4)  # laws of a damper
BOUC_WEN, MAXWELL, DAHL, JENKIN, HEAT = range(5)  # laws of a memory; DAHL is between a body and the ground, and ME_SPRING is the body; HEAT is of a friction, and ME_SPRING is that
POSITION, VELOCITY, TENSION = range(3)  # what a sensor reads
NO_LOAD, ACTUATOR_LOAD, JOINT_LOAD, TENDON_LOAD = range(4)  # what presses on a friction
STICK = 0


@njit(cache=True)
def dead_band(x, half):
    """What is left of x beyond +-half."""
    if x > half:
        return x - half
    if x < -half:
        return x + half
    return 0.0


@njit(cache=True)
def shaped(u, row):
    """An input after dead zone, curvature, asymmetry and saturation, in this order; before its gain."""
    u = dead_band(u, row[AC_DEAD])
    u = u + row[AC_CURVE] * u * abs(u)
    if u < 0.0:
        u *= row[AC_BACK]
    return min(max(u, -row[AC_LIMIT]), row[AC_LIMIT])


@njit(cache=True)
def at(y, index):
    """Position (or, from n on, velocity) of a body; the ground's is zero."""
    return y[index] if index >= 0 else 0.0


@njit(cache=True)
def tendon_tension(row, n, y, pull):
    """Tension of one tendon; pull: the length its actuator lets out."""
    stretch, rate = -pull, 0.0
    for i in range(n):
        stretch += row[TE_ARM + i] * y[i]
        rate += row[TE_ARM + i] * y[n + i]
    if row[TE_GAP] > 0.0 and row[TE_K] > 0.0:
        # The band is centred on zero force; inside it nothing is transmitted.
        free = dead_band(stretch + row[TE_PRE] / row[TE_K], 0.5 * row[TE_GAP])
        tension = row[TE_K] * free + (row[TE_C] * rate if free != 0.0 else 0.0)
    else:
        tension = row[TE_PRE] + row[TE_K] * (stretch - row[TE_SLACK]) + row[TE_C] * rate
    if row[TE_UNI] > 0.0:
        tension = max(0.0, tension)
    return tension


@njit(cache=True)
def forces(s, y, t, u, f, dy, press):
    """Everything but dry friction: generalised forces f, rates of the memories in dy, and what presses
    on each friction (N or N m), for the input u of each actuator as held between its play and its lag."""
    n = s.n
    for i in range(n):
        f[i] = s.load[i]
    joint, drive = press[1], press[2]
    tension = press[3]
    for i in range(n):
        joint[i] = 0.0
        drive[i] = 0.0
    for k in range(s.actuators.shape[0]):
        row = s.actuators[k]
        value = shaped(u[k], row)
        if row[AC_STATE] >= 0:
            state = int(row[AC_STATE])
            if row[AC_RATE] > 0.0:
                # A servo that follows within a fiftieth of its slew: w' = clip((u - w)/tau, +-rate).
                dy[state] = min(max((value - y[state]) / row[AC_LAG], -row[AC_RATE]), row[AC_RATE])
            else:
                dy[state] = (value - y[state]) / row[AC_LAG]
            value = y[state]
        if row[AC_SAG] != 0.0:
            value *= 1.0 - row[AC_SAG] * t
        press[4][k] = row[AC_GAIN] * value
        body = int(row[AC_BODY])
        if body >= 0:
            drive[body] += row[AC_GAIN] * value
            f[body] += row[AC_GAIN] * value
    for k in range(s.springs.shape[0]):
        row = s.springs[k]
        a, b = int(row[SP_FROM]), int(row[SP_TO])
        x = at(y, b) - at(y, a) - row[SP_REST]
        stiffness = row[SP_K] * (1.0 + row[SP_EPS] * math.sin(row[SP_OMEGA] * t))
        force = -stiffness * dead_band(x, 0.5 * row[SP_GAP]) - row[SP_K2] * x * x - row[SP_K3] * x * x * x
        if b >= 0:
            f[b] += force
            joint[b] += force
        if a >= 0:
            f[a] -= force
            joint[a] -= force
    for k in range(s.memories.shape[0]):
        row = s.memories[k]
        if row[ME_LAW] == DAHL:
            # dF/dx = sigma (1 - F sign(v) / level), sigma = level / distance.
            i, m = int(row[ME_SPRING]), int(row[ME_STATE])
            v = y[n + i]
            dy[m] = row[ME_A] / row[ME_B] * (v - abs(v) * y[m] / row[ME_A])
            f[i] -= y[m]
            continue
        if row[ME_LAW] == HEAT:
            # The level is multiplied by exp(-y[m]); A: sliding speed whose end is 1/e, B: time constant.
            j, m = int(row[ME_SPRING]), int(row[ME_STATE])
            dy[m] = (abs(along(s, j, y, n)) / row[ME_A] - y[m]) / row[ME_B]
            press[5][j] = math.exp(-y[m])
            continue
        spring = s.springs[int(row[ME_SPRING])]
        a, b, m = int(spring[SP_FROM]), int(spring[SP_TO]), int(row[ME_STATE])
        x = at(y, b) - at(y, a) - spring[SP_REST]
        v = (y[n + b] if b >= 0 else 0.0) - (y[n + a] if a >= 0 else 0.0)
        if row[ME_LAW] == BOUC_WEN:
            z, power = y[m], row[ME_D]
            grown = abs(z) ** (power - 1.0) if power != 1.0 else 1.0
            dy[m] = v - row[ME_B] * abs(v) * grown * z - row[ME_C] * v * grown * abs(z)
            force = -row[ME_A] * z
        elif row[ME_LAW] == JENKIN:
            # A spring of stiffness A in series with a slider that gives way at the extension B.
            z = y[m]
            dy[m] = 0.0 if abs(z) >= row[ME_B] and z * v > 0.0 else v
            force = -row[ME_A] * z
        else:
            # y[m] is where the dashpot stands: the branch pulls with A (x - w), w' = (x - w)/B.
            dy[m] = (x - y[m]) / row[ME_B]
            force = -row[ME_A] * (x - y[m])
        if b >= 0:
            f[b] += force
            joint[b] += force
        if a >= 0:
            f[a] -= force
            joint[a] -= force
    for k in range(s.dampers.shape[0]):
        row = s.dampers[k]
        a, b = int(row[DA_FROM]), int(row[DA_TO])
        v = (y[n + b] if b >= 0 else 0.0) - (y[n + a] if a >= 0 else 0.0)
        if row[DA_LAW] == LINEAR:
            force = -row[DA_C] * v
        elif row[DA_LAW] == SQUARE:
            force = -row[DA_C] * v * abs(v)
        elif row[DA_LAW] == ROOT:
            force = -row[DA_C] * math.copysign(math.sqrt(abs(v)), v)
        else:
            q = (at(y, b) - at(y, a)) / row[DA_Q0]
            force = row[DA_C] * v * (1.0 - q * q)
        if b >= 0:
            f[b] += force
        if a >= 0:
            f[a] -= force
    for k in range(s.gravities.shape[0]):
        row = s.gravities[k]
        i = int(row[GR_BODY])
        f[i] -= row[GR_AMP] * math.sin(y[i] - row[GR_ZERO]) if row[GR_HINGE] > 0.0 else row[GR_AMP]
    for k in range(s.ripples.shape[0]):
        row = s.ripples[k]
        i = int(row[RI_BODY])
        f[i] += row[RI_AMP] * math.sin(row[RI_N] * y[i] + row[RI_PHASE])
    for k in range(s.stops.shape[0]):
        row = s.stops[k]
        i = int(row[ST_BODY])
        depth = row[ST_SIDE] * (y[i] - row[ST_AT])
        if depth > 0.0:
            f[i] -= row[ST_SIDE] * max(0.0, row[ST_K] * depth + row[ST_C] * row[ST_SIDE] * y[n + i])
    for k in range(s.tendons.shape[0]):
        row = s.tendons[k]
        act = int(row[TE_ACT])
        tension[k] = tendon_tension(row, n, y, press[4][act] if act >= 0 else 0.0)
        for i in range(n):
            f[i] -= row[TE_ARM + i] * tension[k]
            joint[i] -= row[TE_ARM + i] * tension[k]
    for j in range(s.frictions.shape[0]):
        row = s.frictions[j]
        load = 0.0
        source, i = int(row[FR_SOURCE]), int(s.pressed[j])
        if source == ACTUATOR_LOAD:
            load = abs(drive[i])
        elif source == JOINT_LOAD:
            load = abs(joint[i])
        elif source == TENDON_LOAD:
            load = abs(tension[i])
        press[0][j] = row[FR_MU] * load
    for k in range(s.sensors.shape[0]):
        row = s.sensors[k]
        if row[SE_STATE] >= 0:
            m = int(row[SE_STATE])
            dy[m] = (reading(s, k, y, tension) - y[m]) / row[SE_LAG]


@njit(cache=True)
def reading(s, k, y, tension):
    """What sensor k reads before its lag, after its curvature; before its gain."""
    row = s.sensors[k]
    i = int(row[SE_AT])
    if row[SE_WHAT] == POSITION:
        r = y[i]
    elif row[SE_WHAT] == VELOCITY:
        r = y[s.n + i]
    else:
        r = tension[i]
    return r + row[SE_A] * r * r + row[SE_B] * r * r * r + row[SE_WAVE] * math.sin(row[SE_WAVE_N] * r)


@njit(cache=True)
def level(s, j, sign, v, q, t, press):
    """Dry and direction-dependent viscous friction of a sliding contact, along -sign."""
    row = s.frictions[j]
    speed = abs(v)
    if sign > 0:
        dry, hold, viscous = row[FR_LP], row[FR_SP], row[FR_DP]
    else:
        dry, hold, viscous = row[FR_LM], row[FR_SM], row[FR_DM]
    if row[FR_VS] > 0.0:
        dry = dry + (hold - dry) * math.exp(-((speed / row[FR_VS]) ** 2))
    return dry * changing(row, q, t) * press[5][j] + press[0][j] + viscous * speed


@njit(cache=True)
def hold(s, j, sign, q, t, press):
    """What a resting contact holds against a push towards sign."""
    row = s.frictions[j]
    return (row[FR_SP] if sign > 0 else row[FR_SM]) * changing(row, q, t) * press[5][j] + press[0][j]


@njit(cache=True)
def changing(row, q, t):
    """Factor of a level that depends on position or falls with time (outside the vocabulary)."""
    factor = 1.0
    if row[FR_EPS] != 0.0:
        factor += row[FR_EPS] * math.sin(row[FR_N] * q)
    if row[FR_WARM] > 0.0:
        factor *= 0.3 + 0.7 * math.exp(-t / row[FR_WARM])
    return factor


@njit(cache=True)
def along(s, j, y, start):
    """Position (start 0) or velocity (start n) along friction j."""
    total = 0.0
    for i in range(s.n):
        total += s.frictions[j, FR_J + i] * y[start + i]
    return total


@njit(cache=True)
def rates(s, y, t, u, modes, dy, w):
    """dy/dt with every contact held in its mode: STICK, +1 or -1. w.reaction: what each resting contact bears."""
    n, f = s.n, w.f
    forces(s, y, t, u, f, dy, w.press)
    count = s.frictions.shape[0]
    stuck = 0
    for j in range(count):
        w.reaction[j] = 0.0
        if modes[j] == STICK:
            w.who[stuck] = j
            stuck += 1
        else:
            force = -modes[j] * level(s, j, modes[j], along(s, j, y, n), along(s, j, y, 0), t, w.press)
            for i in range(n):
                f[i] += s.frictions[j, FR_J + i] * force
    for i in range(n):
        mass = s.inertia[i]
        if s.modulation[i, IN_EPS] != 0.0:
            angle = s.modulation[i, IN_N] * y[i] + s.modulation[i, IN_PHASE]
            # (m(q) q')' - m'(q) q'^2 / 2 = f
            f[i] -= 0.5 * mass * s.modulation[i, IN_EPS] * s.modulation[i, IN_N] * math.cos(angle) * y[n + i] ** 2
            mass *= 1.0 + s.modulation[i, IN_EPS] * math.sin(angle)
        w.mass[i] = mass
    if stuck > 0:
        bear(s, w, stuck)
    for i in range(n):
        dy[i] = y[n + i]
        dy[n + i] = f[i] / w.mass[i]


@njit(cache=True)
def bear(s, w, stuck):
    """Reactions that keep the resting contacts at rest: J M^-1 J^T r = -J M^-1 f (Gauss with pivots)."""
    n = s.n
    a, b = w.matrix, w.right
    for p in range(stuck):
        jp = w.who[p]
        b[p] = 0.0
        for i in range(n):
            b[p] -= s.frictions[jp, FR_J + i] * w.f[i] / w.mass[i]
        for r in range(stuck):
            a[p, r] = 0.0
            for i in range(n):
                a[p, r] += s.frictions[jp, FR_J + i] * s.frictions[w.who[r], FR_J + i] / w.mass[i]
    for p in range(stuck):
        best = p
        for r in range(p + 1, stuck):
            if abs(a[r, p]) > abs(a[best, p]):
                best = r
        if best != p:
            for c in range(stuck):
                a[p, c], a[best, c] = a[best, c], a[p, c]
            b[p], b[best] = b[best], b[p]
        for r in range(p + 1, stuck):
            factor = a[r, p] / a[p, p]
            for c in range(p, stuck):
                a[r, c] -= factor * a[p, c]
            b[r] -= factor * b[p]
    for p in range(stuck - 1, -1, -1):
        for c in range(p + 1, stuck):
            b[p] -= a[p, c] * b[c]
        b[p] /= a[p, p]
    for p in range(stuck):
        j = w.who[p]
        w.reaction[j] = b[p]
        for i in range(n):
            w.f[i] += s.frictions[j, FR_J + i] * b[p]


def empty(rows, columns):
    """A table without components yet."""
    return np.zeros((rows, columns))
