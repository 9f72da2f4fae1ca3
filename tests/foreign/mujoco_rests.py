#!/usr/bin/env python3
"""Rests found by MuJoCo, for sim/tests/simulator/foreign/mujoco_rests.rs.

For the damped devices of mujoco_trajectories.py it holds the input and steps until nothing moves. It writes
tests/foreign/trajectories/rests.csv: device, input, then the positions that the device's sensors see. A rest does
not depend on the step.
"""

import mujoco
import numpy as np

from mujoco_trajectories import FOLDER, mass_spring_damper, pendulum, tendon_finger, two_mass_drive

STEP, MOST_S = 2e-4, 120.0


def rest(device, u):
    _, built, seen, _, _ = device(STEP)
    data = mujoco.MjData(built)
    data.ctrl[:] = u
    while data.time < MOST_S:
        for _ in range(1000):
            mujoco.mj_step(built, data)
        if np.abs(data.qvel).max() < 1e-14:
            break
    return [data.qpos[mujoco.mj_name2id(built, mujoco.mjtObj.mjOBJ_JOINT, name)] for name in seen]


def main():
    lines = ["# Rests by MuJoCo %s, inputs held until nothing moves" % mujoco.__version__]
    for device in [mass_spring_damper, pendulum, two_mass_drive, tendon_finger]:
        peak = device(STEP)[3][0][2]
        for share in [-1.0, -0.35, 0.0, 0.2]:
            u = round(share * peak, 4)
            positions = rest(device, u)
            lines.append(",".join([device.__name__, repr(u), *("%.14g" % q for q in positions)]))
            print(lines[-1], flush=True)
    (FOLDER / "rests.csv").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
