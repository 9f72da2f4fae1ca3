#!/usr/bin/env python3
"""MuJoCo runs the mechanisms that `sinew new --mjcf` and `--urdf` read, for tests/tests/foreign_mechanism.rs.

    python3 tests/foreign/mechanism.py     (mujoco and numpy, tests/foreign/requirements.txt)

writes tests/foreign/mechanism/NAME.csv: t, each actuator's command, and each joint sensor's reading, under the
names of columns that the imported rig gives them; and NAME.changed.csv of a file with other numbers. It prints by
how much a halved step changes MuJoCo's own result, as a part of the range.
"""

import math
from pathlib import Path

import mujoco
import numpy as np

FOLDER = Path(__file__).resolve().parent / "mechanism"
RATE_HZ, SECONDS = 100, 4.0

# name: (file, the one joint that moves, or None where all do; size of forces and speeds that are commanded)
CASES = {
    "pendulum": ("pendulum.xml", None, 2.5),
    "slide": ("slide.xml", None, 2.5),
    "table": ("table.xml", None, 2.5),
    "elbow": ("chain.xml", "elbow", 0.15),
    "urdf": ("pendulum.urdf", None, 0.6),
}


def load(file, only):
    spec = mujoco.MjSpec.from_file(str(FOLDER / file))
    if file.endswith(".urdf"):
        joint = spec.joint("shoulder")
        # MuJoCo's reader of URDF keeps no motor and no sensor, and clips at the range of the joint.
        joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE
        spec.option.timestep, spec.option.integrator = 0.0005, mujoco.mjtIntegrator.mjINT_RK4
        motor = spec.add_actuator(name="shoulder_drive", target="shoulder", trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.gainprm[0] = 1.0
        spec.add_sensor(name="shoulder_position", type=mujoco.mjtSensor.mjSENS_JOINTPOS, objname="shoulder",
                        objtype=mujoco.mjtObj.mjOBJ_JOINT)
    if only:
        spec.option.timestep, spec.option.integrator = 0.0005, mujoco.mjtIntegrator.mjINT_RK4
        for joint in list(spec.joints):
            if joint.name != only:
                for actuator in [a for a in spec.actuators if a.target == joint.name]:
                    spec.delete(actuator)
                spec.delete(joint)
        spec.add_sensor(name=f"{only}_position", type=mujoco.mjtSensor.mjSENS_JOINTPOS, objname=only,
                        objtype=mujoco.mjtObj.mjOBJ_JOINT)
    return spec.compile()


def column(model, kind, index):
    if kind == "actuator":
        joint = model.actuator_trnid[index][0]
        name = model.actuator(index).name
        slides = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE
        if model.actuator_biastype[index] == mujoco.mjtBias.mjBIAS_AFFINE:
            position = model.actuator_biasprm[index][1] != 0.0
            return name + {(1, 1): "_m", (1, 0): "_rad", (0, 1): "_m_s", (0, 0): "_rad_s"}[position, bool(slides)]
        gear = model.actuator_gear[index][0]
        return name + ("_1" if gear != 1.0 else "_N" if slides else "_Nm")
    joint = model.sensor_objid[index]
    slides = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE
    velocity = model.sensor_type[index] == mujoco.mjtSensor.mjSENS_JOINTVEL
    return model.sensor(index).name + ("_m" if slides else "_rad") + ("_s" if velocity else "")


def command(index, model, t, size):
    """Sines with steps, of a size that each kind of input can take."""
    affine = model.actuator_biastype[index] == mujoco.mjtBias.mjBIAS_AFFINE
    size = 0.15 if affine and model.actuator_biasprm[index][1] != 0.0 else size
    return size * (np.sin(2.0 * math.pi * (0.6 + 0.17 * index) * t) + 0.5 * np.sign(np.sin(2.0 * math.pi * 0.3 * t + index)))


def run(model, t, inputs):
    data = mujoco.MjData(model)
    mujoco.mj_resetData(model, data)
    steps = round(1.0 / (RATE_HZ * model.opt.timestep))
    read = []
    for k in range(len(t)):
        mujoco.mj_forward(model, data)
        read.append(data.sensordata.copy())
        data.ctrl[:] = inputs[:, k]
        for _ in range(steps):
            mujoco.mj_step(model, data)
    return np.array(read)


def main():
    t = np.arange(int(RATE_HZ * SECONDS)) / RATE_HZ
    for name, (file, only, size) in CASES.items():
        model = load(file, only)
        inputs = np.array([command(index, model, t, size) for index in range(model.nu)])
        readings = run(model, t, inputs)
        model.opt.timestep /= 2.0
        finer = run(model, t, inputs)
        error = np.max(np.abs(finer - readings) / np.ptp(finer, axis=0))
        names = [column(model, "actuator", k) for k in range(model.nu)]
        names += [column(model, "sensor", k) for k in range(model.nsensor)]
        table = np.column_stack([t, inputs.T, finer])
        lines = [",".join(["t", *names])] + [",".join(f"{x:.12g}" for x in row) for row in table]
        (FOLDER / f"{name}.csv").write_text("\n".join(lines) + "\n")
        print(f"{name}: {', '.join(names)}; a halved step changes {error:.1e} of the range")


main()
