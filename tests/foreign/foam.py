#!/usr/bin/env python3
"""Recordings of a plate on soft foam that creeps along all its axes, written by somebody else's physics.

It rises, rolls and pitches on one column; along each of the three, with a force that is held between samples,

    M q'' = F - K q - c q' - f        f' = k q' - f / tau

so the state (q, q', f) after a sample is the exponential of a matrix times the state before (Van Loan's augmented
matrix for the held force): nothing is integrated step by step. Shares no code and no method with the project's simulator.

Only the standard library; the seeds are fixed. Run without arguments to rewrite, in
tests/foreign/foam,

    exact.csv, exact.toml    noise-free, and the rig as it is: for the simulator
    fit.csv, check.csv       noisy, two inputs: for diagnosis
    believed.toml            the rig as its maker takes it to be: numbers that are off, and foam that does not creep
    truth.json               what was true

or with --check to compare what is there with what would be written (exit status 1 if it differs).
"""

import json
import random
from pathlib import Path

from keep import keep
from mass_spring_damper import gauss

# Inertia, stiffness, damping, stiffness of the branch that creeps, its time constant in s; kg or kg m^2 and so on.
TRUTH = {
    "rise": {"inertia": 0.040, "stiffness": 155.0, "damping": 1.2, "creep": 30.0, "time_constant": 0.25},
    "roll": {"inertia": 3.0e-5, "stiffness": 0.029, "damping": 4.4e-4, "creep": 0.006, "time_constant": 0.30},
    "pitch": {"inertia": 3.0e-5, "stiffness": 0.032, "damping": 3.8e-4, "creep": 0.007, "time_constant": 0.20},
}
BELIEVED = {"stiffness": [150.0, 0.030, 0.030], "damping": [1.3, 4e-4, 4e-4]}
COORDINATES = {"rise": "z", "roll": "roll", "pitch": "pitch"}
INPUTS = {"rise": ("u_N", 1.0), "roll": ("roll_Nm", 4e-3), "pitch": ("pitch_Nm", 4e-3)}
SIGNALS = {"rise": ("z_m", 1e-5), "roll": ("roll_rad", 2e-4), "pitch": ("pitch_rad", 2e-4)}
RATE_HZ, SECONDS = 100, 4.0
HELD_S = (0.1, 0.9)
NOISE = {"exact": 0.0, "fit": 1.0, "check": 1.0}
SEEDS = {"exact": 11, "fit": 12, "check": 13}


def product(a, b):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def exponential(matrix, halvings=12, terms=12):
    """Taylor's series of the matrix over 2^halvings, squared as often."""
    size = range(len(matrix))
    small = [[entry / 2.0**halvings for entry in row] for row in matrix]
    total = [[float(i == j) for j in size] for i in size]
    term = total
    for k in range(1, terms):
        term = [[entry / k for entry in row] for row in product(term, small)]
        total = [[total[i][j] + term[i][j] for j in size] for i in size]
    for _ in range(halvings):
        total = product(total, total)
    return total


def transition(axis):
    """From (q, q', f, F) to the same after a sample."""
    mass, stiffness, damping, creep, time = TRUTH[axis].values()
    rate = [
        [0.0, 1.0, 0.0, 0.0],
        [-stiffness / mass, -damping / mass, -1.0 / mass, 1.0 / mass],
        [0.0, creep, -1.0 / time, 0.0],
        [0.0, 0.0, 0.0, 0.0],
    ]
    return exponential([[entry / RATE_HZ for entry in row] for row in rate])


def levels(source, count, largest):
    """Random levels, each held for a random time, from rest."""
    values = [0.0] * 10
    while len(values) < count:
        level = round(source.uniform(-largest, largest), 6)
        values += [level] * round(RATE_HZ * source.uniform(*HELD_S))
    return values[:count]


def recording(name):
    """The text of one CSV file."""
    source = random.Random(SEEDS[name])
    count = round(SECONDS * RATE_HZ)
    columns = [[i / RATE_HZ for i in range(count)]]
    forces = {axis: levels(source, count, INPUTS[axis][1]) for axis in TRUTH}
    columns += forces.values()
    for axis, force in forces.items():
        after = transition(axis)
        state, seen = [0.0, 0.0, 0.0], []
        for value in force:
            seen.append(state[0])
            begun = [[entry] for entry in state + [value]]
            state = [row[0] for row in product(after, begun)][:3]
        noise = NOISE[name] * SIGNALS[axis][1]
        columns.append([q + noise * gauss(source) if noise > 0.0 else q for q in seen])
    header = ["t"] + [INPUTS[axis][0] for axis in TRUTH] + [SIGNALS[axis][0] for axis in TRUTH]
    digits = "%.12f" if NOISE[name] == 0.0 else "%.7f"
    layout = ",".join(["%.2f"] + ["%.6f"] * 3 + [digits] * 3)
    lines = ["# A plate on foam at %d Hz; written by tests/foreign/foam.py" % RATE_HZ, ",".join(header)]
    return "\n".join(lines + [layout % row for row in zip(*columns)]) + "\n"


def rig(name, stiffness, damping, inertia, effects):
    """The text of a rig file; `stiffness` and `damping` along each axis."""
    text = """# A plate on soft foam, %s; written by tests/foreign/foam.py
format = "sinew-rig/1"
name = "plate on foam"

[[plate]]
name = "plate"
mass = %s
inertia = %s
""" % (name, *inertia)
    for axis, k, c in zip(TRUTH, stiffness, damping):
        body = "plate." + COORDINATES[axis]
        (source, limit), (signal, _) = INPUTS[axis], SIGNALS[axis]
        text += """
[[spring]]
name = "column_%s"
from = "ground"
to = "%s"
stiffness = { value = %s }

[[damper]]
name = "foam_%s"
from = "ground"
to = "%s"
damping = { value = %s }

[[actuator]]
name = "push_%s"
drives = "%s"
input = "%s"
gain = 1.0
limit = [-%s, %s]

[[sensor]]
name = "see_%s"
reads = "%s.position"
signal = "%s"
""" % (axis, body, k, axis, body, c, axis, body, source, limit, limit, axis, body, signal)
    return text + effects


def creeping(axis):
    return """
[[effect]]
kind = "viscoelastic_creep"
component = "column_%s"
stiffness = %s
time_constant = %s
""" % (axis, TRUTH[axis]["creep"], TRUTH[axis]["time_constant"])


def main():
    folder = Path(__file__).resolve().parent / "foam"
    inertia = (TRUTH["rise"]["inertia"], TRUTH["roll"]["inertia"])
    real = ([of["stiffness"] for of in TRUTH.values()], [of["damping"] for of in TRUTH.values()])
    files = {"%s.csv" % name: recording(name) for name in SEEDS}
    files["exact.toml"] = rig("as it is", *real, inertia, "".join(creeping(axis) for axis in TRUTH))
    believed = (BELIEVED["stiffness"], BELIEVED["damping"])
    files["believed.toml"] = rig("as its maker takes it to be", *believed, inertia, "")
    files["truth.json"] = json.dumps(TRUTH, indent=2) + "\n"

    keep(folder, files, __doc__)


if __name__ == "__main__":
    main()
