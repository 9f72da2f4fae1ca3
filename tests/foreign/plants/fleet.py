"""A fleet of the mass of mass_spring_damper.py: parameters are log-normal, correlated, and their middle is not the catalogue's.

As a plant program it is the device of number SINEW_DRAW. With a folder as its argument it writes recordings there:
device-NN.csv (1.5 s, noisy), new-NN.1s.csv and new-NN.5s.csv of other devices, new-NN.test.csv of these without noise, and
unseen.csv: the answers of 200 further devices to one input, without noise. With a folder and a number of devices it writes
device-NNN.csv of so many others, 5 s each.
"""

import math
import os
import sys

import mujoco
import numpy as np

from . import mass_spring_damper as plant
from .serve import SEED, serve

# In the order in which `mass_spring_damper.model` asks for them: stiffness, damping, level of the friction, mass.
MIDDLE = np.array([34.0, 1.6, 0.7, 1.15])
DEVIATION = np.array([0.20, 0.30, 0.30, 0.10])
CORRELATION = np.array([[1.0, 0.7, 0.0, 0.0], [0.7, 1.0, 0.3, 0.0], [0.0, 0.3, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
NOISE = 0.004
RATE = 120.0
DEVICES, NEW, UNSEEN = 12, 41, 200


def parameters(number):
    """Parameters of a device; of number 0 the middle."""
    source = np.random.Generator(np.random.PCG64([SEED, 1000 + number]))
    root = np.linalg.cholesky(CORRELATION)
    away = DEVIATION * (root @ source.standard_normal(4)) if number else 0.0
    return MIDDLE * np.exp(away)


def device(number):
    values = iter(float(value) for value in parameters(number))
    return plant.model(lambda _: next(values))


def commands(seed, seconds, largest):
    """Steps of a tenth of a second, rounded as a file has them."""
    source = np.random.Generator(np.random.PCG64([SEED, 7, seed]))
    rows = int(round(seconds * RATE))
    steps = np.round(largest * source.uniform(-1.0, 1.0, rows // 12 + 1), 3)
    return np.repeat(steps, 12)[:rows]


def answers(model, inputs):
    """Position at each row; the input of a row holds until the next."""
    data, positions = mujoco.MjData(model), []
    steps = math.ceil(1.0 / RATE / plant.STEP - 1e-9)
    model.opt.timestep = 1.0 / RATE / steps
    for u in inputs:
        positions.append(data.qpos[0])
        data.ctrl[:] = u
        mujoco.mj_step(model, data, steps)
    return np.array(positions)


def write(path, inputs, columns):
    names = ["t", "u_N", *columns]
    times = np.arange(len(inputs)) / RATE
    with open(path, "w") as file:
        print(",".join(names), file=file)
        for row in zip(times, inputs, *columns.values()):
            print("%.6f,%.3f," % row[:2] + ",".join("%.6f" % value for value in row[2:]), file=file)


def recordings(folder):
    def record(name, number, seed, seconds, noise):
        inputs = commands(seed, seconds, 8.0)
        source = np.random.Generator(np.random.PCG64([SEED, 8, seed]))
        positions = answers(device(number), inputs)
        write(os.path.join(folder, name), inputs, {"q_m": positions + noise * source.standard_normal(len(inputs))})

    for k in range(1, DEVICES + 1):
        record("device-%02d.csv" % k, k, k, 1.5, NOISE)
    for k in range(1, NEW + 1):
        number = 100 + k
        record("new-%02d.1s.csv" % k, number, 200 + k, 1.0, NOISE)
        record("new-%02d.5s.csv" % k, number, 300 + k, 5.0, NOISE)
        record("new-%02d.test.csv" % k, number, 400 + k, 5.0, 0.0)
    inputs = commands(999, 3.0, 8.0)
    numbers = range(1000, 1000 + UNSEEN)
    write(os.path.join(folder, "unseen.csv"), inputs, {"q%03d_m" % (n - 999): answers(device(n), inputs) for n in numbers})


def many(folder, count):
    """Noisy recordings of 5 s of many devices, each under commands of its own."""
    for k in range(1, count + 1):
        inputs = commands(10000 + k, 5.0, 8.0)
        source = np.random.Generator(np.random.PCG64([SEED, 8, 10000 + k]))
        positions = answers(device(10000 + k), inputs) + NOISE * source.standard_normal(len(inputs))
        write(os.path.join(folder, "device-%03d.csv" % k), inputs, {"q_m": positions})


def main():
    if len(sys.argv) > 2:
        many(sys.argv[1], int(sys.argv[2]))
        return
    if len(sys.argv) > 1:
        recordings(sys.argv[1])
        return
    model = device(int(os.environ.get("SINEW_DRAW", "0")))
    data = mujoco.MjData(model)

    def advance(seconds, inputs):
        # The last sub-step ends where the period does.
        steps = max(1, math.ceil(seconds / plant.STEP - 1e-9))
        model.opt.timestep = seconds / steps
        data.ctrl[:] = inputs
        mujoco.mj_step(model, data, steps)

    serve(["u_N"], ["q_m"], lambda: [data.qpos[0]], advance)


if __name__ == "__main__":
    main()
