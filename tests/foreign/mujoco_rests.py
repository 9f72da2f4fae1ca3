#!/usr/bin/env python3
"""Rests found by MuJoCo, for sim/tests/simulator/foreign/mujoco_rests.rs.

For the damped devices of mujoco_trajectories.py it holds the input and steps until nothing moves. It writes
tests/foreign/trajectories/rests.csv: device, input, then the positions that the device's sensors see. A rest does
not depend on the step.

It also writes tables of rests, tests/foreign/rests/NAME.fit.csv and NAME.test.csv, for
host/ident/src/fit/tests/statics.rs: the inputs and what the sensors read, no times.
"""

import sys

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


def table(device, name, shares):
    """Writes the rests of a device at parts of its largest input, as a file of `sinew fit --static`."""
    _, built, seen, motors, _ = device(STEP)
    unit = ["m" if built.joint(body).type[0] == mujoco.mjtJoint.mjJNT_SLIDE else "rad" for body in seen]
    lines = ["# Rests of %s by MuJoCo %s" % (device.__name__, mujoco.__version__)]
    lines.append(",".join(["u_1", *("q_%s_%s" % pair for pair in zip(seen, unit))]))
    for share in shares:
        u = round(float(share) * motors[0][2], 4)
        lines.append(",".join([repr(u), *("%.12g" % q for q in rest(device, u))]))
    folder = FOLDER.parent / "rests"
    folder.mkdir(exist_ok=True)
    (folder / ("%s.%s.csv" % (device.__name__, name))).write_text("\n".join(lines) + "\n")


def main():
    for device, most in [(pendulum, 1.0), (two_mass_drive, 1.0), (tendon_finger, 0.3)]:
        table(device, "fit", np.linspace(-1.0, most, 20))
        table(device, "test", np.linspace(-0.93, 0.9 * most, 7))
    if "tables" in sys.argv[1:]:
        return
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
