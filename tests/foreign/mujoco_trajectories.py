#!/usr/bin/env python3
"""Reference trajectories written by MuJoCo, for tests/tests/foreign_mujoco.rs.

`cargo xtask foreign` runs this. For each device of DEVICES it writes, into tests/foreign/trajectories/,

    NAME.toml    the rig, every parameter known, what MuJoCo has beyond the textbook as [[effect]]
    NAME.csv     t, inputs (held between samples), positions: 5 s at 100 Hz

and prints how much the trajectory changes when MuJoCo's own step is doubled: its error.

A body of a rig is one coordinate with its own inertia. Here it is a body of the world with one joint, a
hinge with no mass to speak of and an armature for its inertia, so that the inertia matrix is diagonal
too. Springs, shafts and tendons are fixed tendons with a spring. Where a law of MuJoCo's is not the hard law,
the device says what was done about it.
"""

import math
import sys
from pathlib import Path

import mujoco
import mujoco.rollout
import numpy as np

RATE_HZ, SECONDS, SEED = 100, 5.0, 11
FOLDER = Path(__file__).resolve().parent / "trajectories"

HEAD = """<mujoco>
  <option timestep="{step!r}" integrator="{integrator}" gravity="{gravity}" cone="elliptic" iterations="200" tolerance="0"
          impratio="1"><flag contact="disable" warmstart="disable"/></option>
  <default><geom contype="0" conaffinity="0"/></default>
"""


def joint(name, motion, inertia, extra=""):
    """A body with one coordinate along or about y; a hinge's inertia is its joint's armature."""
    if motion == "slide":
        # Its own mass: MuJoCo scales the constraints of a joint by the inertia of its body, armature left out.
        return ('    <body name="{n}"><joint name="{n}" type="slide" axis="0 1 0" {e}/>'
                '<inertial pos="0 0 0" mass="{m!r}" diaginertia="1 1 1"/></body>\n').format(n=name, m=inertia, e=extra)
    # MuJoCo wants some mass; this little changes no inertia by more than a part in 10^10.
    tiny = max(1e-13 * inertia, 2e-15)
    return ('    <body name="{n}"><joint name="{n}" type="{t}" axis="0 1 0" armature="{a!r}" {e}/>'
            '<inertial pos="0 0 0" mass="{m!r}" diaginertia="{m!r} {m!r} {m!r}"/></body>\n').format(
        n=name, t=motion, a=inertia, e=extra, m=tiny)


def model(bodies, tendons, motors, step, integrator, gravity="0 0 0"):
    text = HEAD.format(step=step, integrator=integrator, gravity=gravity)
    text = text.replace("<mujoco>", '<mujoco>\n  <compiler boundmass="0" boundinertia="0" autolimits="false" angle="radian"/>')
    text += "  <worldbody>\n" + "".join(bodies) + "  </worldbody>\n  <tendon>\n" + "".join(tendons) + "  </tendon>\n"
    text += "  <actuator>\n" + "".join('    <motor joint="%s" gear="%r"/>\n' % m for m in motors) + "  </actuator>\n</mujoco>\n"
    return mujoco.MjModel.from_xml_string(text)


def fixed(name, arms, stiffness, damping=0.0, spring="0 0"):
    parts = "".join('<joint joint="%s" coef="%r"/>' % arm for arm in arms)
    return '    <fixed name="%s" stiffness="%r" damping="%r" springlength="%s">%s</fixed>\n' % (name, stiffness, damping, spring, parts)


def command(source, peak, lowest_hz=0.3, highest_hz=3.0):
    """Half a second of rest, a multisine, then steps; held between samples."""
    t = np.arange(int(RATE_HZ * SECONDS)) / RATE_HZ
    omega = 2.0 * math.pi * np.geomspace(lowest_hz, highest_hz, 12)
    x = np.sin(np.outer(t, omega) + source.uniform(0.0, 2.0 * math.pi, 12)).sum(axis=1)
    x *= peak / np.abs(x).max()
    levels = np.repeat(source.uniform(-peak, peak, 8), 25)
    x[-len(levels):] = levels
    x[t < 0.2] = 0.0
    return np.round(x, 4)


def mass_spring_damper(step):
    m, k, c = 1.3, 52.0, 1.1
    rig = [("body", dict(name="mass", motion="slide", inertia=m)),
           ("spring", dict(name="coil", **{"from": "ground"}, to="mass", stiffness=k)),
           ("damper", dict(name="dashpot", **{"from": "ground"}, to="mass", damping=c))]
    extra = 'stiffness="%r" damping="%r"' % (k, c)
    return rig, model([joint("mass", "slide", m, extra)], [], [("mass", 1.0)], step, "RK4"), ["mass"], [("mass", 1.0, 10.0)], {}


def pendulum(step):
    # A point mass on a rod: inertia m l^2, weight m g l. It swings through more than a right angle.
    m, length, g, c = 0.8, 0.25, 9.81, 0.03
    rig = [("body", dict(name="arm", motion="hinge", inertia=m * length**2)),
           ("gravity", dict(name="weight", body="arm", amplitude=m * g * length)),
           ("damper", dict(name="bearing", **{"from": "ground"}, to="arm", damping=c))]
    body = ('    <body name="arm"><joint name="arm" type="hinge" axis="0 1 0" damping="%r"/>'
            '<inertial pos="0 0 %r" mass="%r" diaginertia="1e-15 1e-15 1e-15"/></body>\n' % (c, -length, m))
    return rig, model([body], [], [("arm", 1.0)], step, "RK4", "0 0 -9.81"), ["arm"], [("arm", 1.0, 1.1)], {}


def two_mass_drive(step):
    motor, load, k, loss, bearing, centring = 0.02, 0.06, 30.0, 0.02, 0.05, 3.0
    rig = [("body", dict(name="motor", motion="hinge", inertia=motor)),
           ("body", dict(name="load", motion="hinge", inertia=load)),
           ("spring", dict(name="shaft", **{"from": "motor"}, to="load", stiffness=k)),
           ("spring", dict(name="centring", **{"from": "ground"}, to="motor", stiffness=centring)),
           ("damper", dict(name="shaft_loss", **{"from": "motor"}, to="load", damping=loss)),
           ("damper", dict(name="bearing", **{"from": "ground"}, to="load", damping=bearing))]
    bodies = [joint("motor", "hinge", motor, 'stiffness="%r"' % centring), joint("load", "hinge", load, 'damping="%r"' % bearing)]
    shaft = fixed("shaft", [("load", 1.0), ("motor", -1.0)], k, loss)
    return rig, model(bodies, [shaft], [("motor", 0.4)], step, "RK4"), ["motor", "load"], [("motor", 0.4, 5.0)], {}


def tendon_finger(step):
    # The tendon's spring acts beyond its rest length only (springlength "low high" with nothing below): it cannot
    # push. MuJoCo's tendon damping would act on a slack tendon too: there is none here.
    knuckle, tip, winch = 2.0e-4, 0.8e-4, 1.5e-4
    arms = [("knuckle", 0.010), ("tip", 0.007), ("winch", -0.008)]
    k, pretension = 4000.0, 1.0
    rig = [("body", dict(name="knuckle", motion="hinge", inertia=knuckle)),
           ("body", dict(name="tip", motion="hinge", inertia=tip)),
           ("body", dict(name="winch", motion="hinge", inertia=winch)),
           ("spring", dict(name="root", **{"from": "ground"}, to="knuckle", stiffness=0.12)),
           ("spring", dict(name="joint", **{"from": "knuckle"}, to="tip", stiffness=0.06)),
           ("damper", dict(name="root_loss", **{"from": "ground"}, to="knuckle", damping=1.2e-3)),
           ("damper", dict(name="joint_loss", **{"from": "knuckle"}, to="tip", damping=4e-4)),
           ("damper", dict(name="winch_loss", **{"from": "ground"}, to="winch", damping=2.0e-3)),
           ("spring", dict(name="winch_spring", **{"from": "ground"}, to="winch", stiffness=0.05)),
           ("tendon", dict(name="flexor", path=arms, stiffness=k, pretension=pretension, unilateral=True))]
    bodies = [joint("knuckle", "hinge", knuckle, 'stiffness="0.12" damping="1.2e-3"'), joint("tip", "hinge", tip),
              joint("winch", "hinge", winch, 'stiffness="0.05" damping="2.0e-3"')]
    tendons = [fixed("joint", [("tip", 1.0), ("knuckle", -1.0)], 0.06, 4e-4),
               fixed("flexor", arms, k, 0.0, "%r %r" % (-1e6, -pretension / k))]
    return rig, model(bodies, tendons, [("winch", 0.05)], step, "RK4"), ["knuckle", "tip"], [("winch", 0.05, 1.2)], {}


def joint_friction(step):
    # MuJoCo's friction loss is a soft constraint: the force is clamped at the level, and below it the joint creeps at
    # a speed in proportion to the force. With solimp at its highest and a time constant of two steps the creep is as slow as
    # MuJoCo allows; what is left of it shrinks with the step (printed).
    m, k, c, level = 1.3, 52.0, 1.1, 1.7
    rig = [("body", dict(name="mass", motion="slide", inertia=m)),
           ("spring", dict(name="coil", **{"from": "ground"}, to="mass", stiffness=k)),
           ("damper", dict(name="dashpot", **{"from": "ground"}, to="mass", damping=c)),
           ("effect", dict(kind="coulomb_friction", component="mass", level=level))]
    extra = 'stiffness="%r" damping="%r" frictionloss="%r" solreffriction="%r 1" solimpfriction="0.9999 0.9999 1 0.5 2"' % (k, c, level, 2.0 * step)
    return rig, model([joint("mass", "slide", m, extra)], [], [("mass", 1.0)], step, "implicitfast"), ["mass"], [("mass", 1.0, 10.0)], {"step": 2e-6}


def end_stop(step):
    # A joint limit pushes with m d (k r + b v - a0): d is the impedance and a0 the acceleration without the limit. With d at
    # its least, 1e-4, this is a spring and a damper that never pull but for 1e-4 of the other forces. MuJoCo scales the numbers
    # of solref by d: k = -solref[0] d / dmax^2, b = -solref[1] / dmax; the limit's force is m d (k r + b v).
    m, k, c, at = 1.3, 52.0, 1.1, 0.12
    stop, loss, d = 2500.0, 20.0, 1e-4
    rig = [("body", dict(name="mass", motion="slide", inertia=m)),
           ("spring", dict(name="coil", **{"from": "ground"}, to="mass", stiffness=k)),
           ("damper", dict(name="dashpot", **{"from": "ground"}, to="mass", damping=c)),
           ("effect", dict(kind="end_stop", component="mass", position=at, stiffness=stop, damping=loss, side=1.0))]
    extra = ('stiffness="%r" damping="%r" limited="true" range="-100 %r" solreflimit="%r %r" solimplimit="%r %r 1 0.5 2"'
             % (k, c, at, -stop / m, -loss / m, d, d))
    return rig, model([joint("mass", "slide", m, extra)], [], [("mass", 1.0)], step, "RK4"), ["mass"], [("mass", 1.0, 14.0)], {"step": 1e-5}


DEVICES = [mass_spring_damper, pendulum, two_mass_drive, tendon_finger, joint_friction, end_stop]


def inputs_of(number):
    """Inputs of a device of DEVICES, (samples, actuators)."""
    source = np.random.Generator(np.random.PCG64([SEED, number]))
    motors = DEVICES[number](1e-4)[3]
    return np.stack([command(source, peak) for _, _, peak in motors], axis=1)


def run(model_, inputs, qpos):
    """Positions at the samples; inputs held between them, (samples, actuators)."""
    data = mujoco.MjData(model_)
    mujoco.mj_resetData(model_, data)
    steps = round(1.0 / RATE_HZ / model_.opt.timestep)
    state = np.zeros((1, mujoco.mj_stateSize(model_, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
    mujoco.mj_getState(model_, data, state[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)
    positions = [data.qpos[qpos].copy()]
    for u in inputs[:-1]:
        held = np.broadcast_to(u, (1, steps, len(u))).copy()
        states, _ = mujoco.rollout.rollout(model_, data, state, held)
        state = states[:, -1].copy()
        positions.append(state[0, 1 + np.array(qpos)])
    return np.array(positions)


def toml(device, rig, seen, motors):
    """The rig file of a device."""
    lines = ["# Written by tests/foreign/mujoco_trajectories.py beside %s.csv" % device, 'format = "sinew-rig/1"', 'name = "%s"' % device.replace("_", " ")]
    motion = {keys["name"]: keys["motion"] for table, keys in rig if table == "body"}
    tables = [entry for entry in rig if entry[0] != "effect"]
    tables += [("actuator", dict(name="drive_" + body, drives=body, input="u_1", gain=gear)) for body, gear, _ in motors]
    tables += [("sensor", dict(name="sensor_" + body, reads=body + ".position", signal="q_%s_%s" % (body, "m" if motion[body] == "slide" else "rad")))
               for body in seen]
    tables += [entry for entry in rig if entry[0] == "effect"]
    for table, keys in tables:
        lines += ["", "[[%s]]" % table]
        for key, value in keys.items():
            if key == "path":
                value = "[%s]" % ", ".join('{ body = "%s", arm = %r }' % part for part in value)
            elif isinstance(value, bool):
                value = str(value).lower()
            elif isinstance(value, str):
                value = '"%s"' % value
            else:
                value = repr(float(value))
            lines.append("%s = %s" % (key, value))
    return "\n".join(lines) + "\n"


def main():
    FOLDER.mkdir(exist_ok=True)
    for number, device in enumerate(DEVICES):
        if sys.argv[1:] and device.__name__ not in sys.argv[1:]:
            continue
        rig, built, seen, motors, options = device(1e-4)
        step = options.get("step", 2e-5)
        u = inputs_of(number)
        qpos = [mujoco.mj_name2id(built, mujoco.mjtObj.mjOBJ_JOINT, name) for name in seen]
        fine = run(device(step)[1], u, qpos)
        coarse = run(device(2.0 * step)[1], u, qpos)
        own = np.abs(fine - coarse).max() / np.ptp(fine)
        print("%-20s MuJoCo %s, step %.0e s: twice the step moves it by %.1e of its range" % (device.__name__, mujoco.__version__, step, own), file=sys.stderr, flush=True)
        header = ["t", "u_1", *("q_%s_%s" % (body, "m" if ("body", body, "slide") in [(t, k["name"], k.get("motion")) for t, k in rig if t == "body"] else "rad") for body in seen)]
        lines = ["# %s by MuJoCo %s, step %g s; doubling the step moves it by %.1e of its range" % (device.__name__, mujoco.__version__, step, own), ",".join(header)]
        for i in range(len(u)):
            lines.append(",".join(["%.2f" % (i / RATE_HZ), *("%.4f" % v for v in u[i]), *("%.10g" % q for q in fine[i])]))
        (FOLDER / (device.__name__ + ".csv")).write_text("\n".join(lines) + "\n")
        (FOLDER / (device.__name__ + ".toml")).write_text(toml(device.__name__, rig, seen, motors))


if __name__ == "__main__":
    main()
