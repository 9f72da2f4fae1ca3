#!/usr/bin/env python3
"""What MuJoCo makes of the files that `sinew mjcf` writes, for tests/tests/foreign_mjcf.rs.

    cargo run -p sinew -- mjcf tests/foreign/mjcf/all.toml --out tests/foreign/mjcf/all.xml
    python3 tests/foreign/mjcf.py            (mujoco and numpy from PyPI, tests/foreign/requirements.txt)

writes tests/foreign/mjcf/all.csv: t, the inputs, and what MuJoCo's sensors read, as the rig's columns; and
prints how much each changes when MuJoCo's step is halved: its own error.
"""

import math
from pathlib import Path

import mujoco
import numpy as np

RATE_HZ, SECONDS = 100, 4.0
FOLDER = Path(__file__).resolve().parent / "mjcf"

# input column -> actuator; sensor column -> (sensor, gain of the rig)
INPUTS = {"u_N": "push", "w_rad": "wind"}
SENSORS = {"q_m": ("ruler", 2.0), "p_m": ("trolley_ruler", 1.0), "q_rad": ("encoder", 1.0), "w_rad_s": ("tacho", 1.0)}


def commands(t):
    """Pushes of both signs with rests between them, beyond the saturation; a slow turn of the winch."""
    push = 5.0 * np.sin(2.0 * math.pi * 0.9 * t) + 4.0 * np.sign(np.sin(2.0 * math.pi * 0.31 * t))
    push[(t > 1.4) & (t < 1.8)] = 0.0
    turn = 0.4 * np.sin(2.0 * math.pi * 0.7 * t) + 0.2 * np.floor(2.0 * t) % 3 * 0.1
    return {"u_N": push, "w_rad": turn}


def run(model, t, inputs):
    data = mujoco.MjData(model)
    # As `sinew simulate`: whatever reads its first input has read it for ever.
    for column, name in INPUTS.items():
        actuator = model.actuator(name)
        data.ctrl[actuator.id] = inputs[column][0]
        if model.actuator_actnum[actuator.id]:
            data.act[model.actuator_actadr[actuator.id]] = inputs[column][0]
    steps = round(1.0 / (RATE_HZ * model.opt.timestep))
    read = {column: [] for column in SENSORS}
    for k in range(len(t)):
        mujoco.mj_forward(model, data)
        for column, (sensor, gain) in SENSORS.items():
            read[column].append(gain * data.sensor(sensor).data[0])
        for column, name in INPUTS.items():
            data.ctrl[model.actuator(name).id] = inputs[column][k]
        for _ in range(steps):
            mujoco.mj_step(model, data)
    return {column: np.array(values) for column, values in read.items()}


def main():
    text = (FOLDER / "all.xml").read_text()
    model = mujoco.MjModel.from_xml_string(text)
    steps = math.ceil(1.0 / (RATE_HZ * model.opt.timestep))
    t = np.arange(int(RATE_HZ * SECONDS)) / RATE_HZ
    inputs = commands(t)
    runs = []
    for part in (1, 2):
        model.opt.timestep = 1.0 / (RATE_HZ * steps * part)
        runs.append(run(model, t, inputs))
    for column in SENSORS:
        coarse, fine = (r[column] for r in runs)
        print(f"{column}: range {np.ptp(fine):.3g}, halving the step changes it by {np.abs(coarse - fine).max():.2g}")
    columns = {"t": t, **inputs, **runs[1]}
    rows = np.column_stack(list(columns.values()))
    with open(FOLDER / "all.csv", "w") as file:
        file.write(f"# MuJoCo {mujoco.__version__}, tests/foreign/mjcf.py\n" + ",".join(columns) + "\n")
        for row in rows:
            file.write(",".join(f"{value:.9g}" for value in row) + "\n")


if __name__ == "__main__":
    main()
