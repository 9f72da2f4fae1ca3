"""Families of rigs at random scales, from grams to tonnes and micrometres to radians.

Each returns the rig with its true values and a Setting: what a test engineer knows when choosing an input.
"""

from dataclasses import dataclass

from .system import Rig

FAMILIES = ("mass-spring-damper", "hinge on a spring", "two-mass drive", "tendon finger", "pendulum", "three-mass chain", "free axis", "finger pair")


@dataclass
class Setting:
    """tau: 1/omega of the main resonance or bandwidth, s. dt: sample time, s. low, high: range of each input."""

    tau: float
    dt: float
    low: list
    high: list
    kp: float = 0.0  # of the recording's own controller, 0: open loop
    kd: float = 0.0
    reach: float = 0.0  # of the controller's reference, in the units of `sensor`
    sensor: int = 0


def spread(rng, low, high):
    """Log-uniform."""
    return float(low * (high / low) ** rng.uniform())


def scale(rng, hinge):
    """Inertia, 1/omega, and how far it moves."""
    inertia = spread(rng, 1e-6, 10.0) if hinge else spread(rng, 1e-3, 3e3)
    tau = 1.0 / (6.2832 * spread(rng, 0.3, 12.0))
    return inertia, tau, float(rng.uniform(0.3, 1.1)) if hinge else spread(rng, 5e-5, 0.3)


def sampling(rng, tau):
    return 6.2832 * tau / float(rng.uniform(35.0, 90.0))


def motor(rng, rig, name, drives, reach, columns, sign=1.0):
    """An actuator whose largest input is that of some amplifier; reach: its output (N, N m, m) at that input."""
    largest = float(rng.choice([1.0, 5.0, 10.0, 24.0, 100.0]))
    unit = {1.0: "1", 5.0: "V", 10.0: "V", 24.0: "V", 100.0: "pct"}[largest]
    rig.add("actuator", name=name, drives=drives, input="u%s_%s" % (columns, unit), gain=sign * reach / largest)
    return largest


def encoder(rig, body, hinge, columns):
    rig.add("sensor", name="%s_encoder" % body, reads="%s.position" % body, signal="q%s_%s" % (columns, "rad" if hinge else "m"))


def one_body(rng, want, hinge):
    m, tau, x = scale(rng, hinge)
    k = m / tau**2
    rig = Rig("hinge on a spring" if hinge else "mass-spring-damper")
    body = str(rng.choice(["arm", "flap", "lever"] if hinge else ["mass", "carriage", "piston", "table"]))
    rig.add("body", name=body, motion="hinge" if hinge else "slide", inertia=m, free=["inertia"])
    rig.add("spring", name="spring", **{"from": "ground"}, to=body, stiffness=k, rest=0.0, free=["stiffness"])
    if "viscous_damping" not in want:
        rig.add("damper", name="damper", **{"from": "ground"}, to=body, damping=2 * rng.uniform(0.03, 0.35) * m / tau, free=["damping"])
    largest = motor(rng, rig, "motor", body, 1.3 * k * x, "")
    encoder(rig, body, hinge, "")
    return rig, Setting(tau, sampling(rng, tau), [-largest], [largest])


def mass_spring_damper(rng, want):
    return one_body(rng, want, False)


def hinge_on_a_spring(rng, want):
    return one_body(rng, want, True)


def two_mass_drive(rng, want):
    j, tau, _ = scale(rng, True)
    load = j * spread(rng, 0.4, 4.0)
    k = load / tau**2
    twist = float(rng.uniform(0.05, 0.3))
    rig = Rig("two-mass drive")
    rig.integrates = True
    rig.add("body", name="motor", motion="hinge", inertia=j, free=["inertia"])
    rig.add("body", name="load", motion="hinge", inertia=load, free=["inertia"])
    rig.add("spring", name="shaft", **{"from": "motor"}, to="load", stiffness=k, rest=0.0, free=["stiffness"])
    rig.add("damper", name="shaft_loss", **{"from": "motor"}, to="load", damping=2 * rng.uniform(0.02, 0.1) * load / tau, free=["damping"])
    if "viscous_damping" not in want:
        rig.add("damper", name="bearing", **{"from": "ground"}, to="load", damping=rng.uniform(0.05, 0.3) * load / tau, free=["damping"])
    if rng.uniform() < 0.4:
        # A spring back to the middle, so that it can be recorded without a controller.
        rig.add("spring", name="centring", **{"from": "ground"}, to="motor", stiffness=k * rng.uniform(0.1, 0.3), rest=0.0, free=["stiffness"])
        rig.integrates = False
    torque = 2.0 * k * twist
    largest = motor(rng, rig, "drive", "motor", torque, "")
    which = rng.uniform()
    if which < 0.85:
        encoder(rig, "motor", True, "m" if which < 0.7 else "")
    if which < 0.7 or which >= 0.85:
        encoder(rig, "load", True, "l")
    setting = Setting(tau, sampling(rng, tau), [-largest], [largest])
    if rig.integrates:
        total, wide = j + load, 0.35 / tau
        gain = torque / largest
        setting.kp, setting.kd = total * wide**2 / gain, 1.4 * total * wide / gain
        setting.reach = torque / (total * wide**2) * 0.5
    return rig, setting


def tendon_finger(rng, want):
    j, tau, x = scale(rng, True)
    arm = spread(rng, 0.003, 0.03)
    k = j / tau**2
    two = rng.uniform() < 0.5
    two_sided = "tendon_slack" in want or ("tendon_backlash" in want)
    rig = Rig("tendon finger")
    rig.add("body", name="knuckle", motion="hinge", inertia=j, free=["inertia"])
    rig.add("spring", name="return_spring", **{"from": "ground"}, to="knuckle", stiffness=k, rest=0.0, free=["stiffness"])
    if "viscous_damping" not in want:
        rig.add("damper", name="joint_loss", **{"from": "ground"}, to="knuckle", damping=2 * rng.uniform(0.1, 0.4) * j / tau, free=["damping"])
    path = [{"body": "knuckle", "arm": arm}]
    if two:
        tip = j * rng.uniform(0.2, 0.6)
        rig.add("body", name="tip", motion="hinge", inertia=tip, free=["inertia"])
        rig.add("spring", name="tip_spring", **{"from": "knuckle"}, to="tip", stiffness=k * rng.uniform(0.5, 1.2), rest=0.0, free=["stiffness"])
        rig.add("damper", name="tip_loss", **{"from": "knuckle"}, to="tip", damping=2 * rng.uniform(0.1, 0.4) * tip / tau, free=["damping"])
        path.append({"body": "tip", "arm": arm * rng.uniform(0.5, 0.9)})
    stiff = rng.uniform(0.5, 3.0) * k / arm**2
    rig.add("tendon", name="flexor", path=[(p["body"], float(p["arm"])) for p in path], stiffness=stiff,
            damping=0.0 if "tendon_backlash" in want else 0.05 * stiff * tau,
            pretension=0.0 if two_sided else float(rng.uniform(0.0, 0.1)) * stiff * arm * x, unilateral=not two_sided, free=["stiffness"])
    # It takes in: a positive input shortens the tendon, and the joint goes to negative angles.
    largest = motor(rng, rig, "winch", "flexor", arm * x * 2.0 * (1.6 if two else 1.0), "", sign=-1.0)
    both = rng.uniform()
    encoder(rig, "knuckle", True, "1" if two else "")
    if two and both < 0.75:
        encoder(rig, "tip", True, "2")
    if rng.uniform() < 0.2:
        rig.add("sensor", name="load_cell", reads="flexor.tension", signal="tension_N")
    return rig, Setting(tau, sampling(rng, tau), [-0.35 * largest], [largest])


def pendulum(rng, want):
    j, tau, x = scale(rng, True)
    weight = j / tau**2
    rig = Rig("pendulum")
    rig.add("body", name="arm", motion="hinge", inertia=j, free=["inertia"])
    rig.add("gravity", name="weight", body="arm", amplitude=weight, zero=0.0, free=["amplitude"])
    if "viscous_damping" not in want:
        rig.add("damper", name="bearing", **{"from": "ground"}, to="arm", damping=2 * rng.uniform(0.03, 0.25) * j / tau, free=["damping"])
    largest = motor(rng, rig, "motor", "arm", weight * 0.75, "")
    encoder(rig, "arm", True, "")
    return rig, Setting(tau, sampling(rng, tau), [-largest], [largest])


def three_mass_chain(rng, want):
    m, tau, x = scale(rng, False)
    k = 3.0 * m / tau**2
    rig = Rig("three-mass chain")
    names = ["first", "second", "third"]
    for name in names:
        rig.add("body", name=name, motion="slide", inertia=m * rng.uniform(0.6, 1.6), free=["inertia"])
    for name, a, b in (("s1", "ground", "first"), ("s2", "first", "second"), ("s3", "second", "third")):
        rig.add("spring", name=name, **{"from": a}, to=b, stiffness=k * rng.uniform(0.7, 1.4), rest=0.0, free=["stiffness"])
    bare = rng.choice(names) if "viscous_damping" in want else None
    for name in names:
        if name != bare:
            rig.add("damper", name="d_" + name, **{"from": "ground"}, to=name, damping=rng.uniform(0.15, 0.5) * m / tau, free=["damping"])
    largest = motor(rng, rig, "push", str(rng.choice(["first", "third"])), k * x, "")
    seen = [["first", "third"], ["first", "second"], ["second", "third"], names][rng.integers(4)]
    for name in seen:
        encoder(rig, name, False, name[0])
    return rig, Setting(1.5 * tau, sampling(rng, tau), [-largest], [largest])


def free_axis(rng, want):
    m, tau, x = scale(rng, False)
    rig = Rig("free axis")
    rig.integrates = True
    rig.add("body", name="carriage", motion="slide", inertia=m, free=["inertia"])
    if "viscous_damping" not in want:
        rig.add("damper", name="guide", **{"from": "ground"}, to="carriage", damping=rng.uniform(0.05, 0.4) * m / tau, free=["damping"])
    force = m * x / tau**2
    largest = motor(rng, rig, "motor", "carriage", 2.0 * force, "")
    encoder(rig, "carriage", False, "")
    gain = 2.0 * force / largest
    return rig, Setting(tau, sampling(rng, tau), [-largest], [largest], m / tau**2 / gain, 1.4 * m / tau / gain, 1.2 * x)


def finger_pair(rng, want):
    j, tau, x = scale(rng, True)
    rig = Rig("finger pair")
    lows, highs = [], []
    bare = rng.choice(["left", "right"]) if "viscous_damping" in want else None
    for name in ("left", "right"):
        mine = j * rng.uniform(0.7, 1.4)
        k = mine / tau**2 * rng.uniform(0.7, 1.4)
        rig.add("body", name=name, motion="hinge", inertia=mine, free=["inertia"])
        rig.add("spring", name="spring_" + name, **{"from": "ground"}, to=name, stiffness=k, rest=0.0, free=["stiffness"])
        if name != bare:
            rig.add("damper", name="damper_" + name, **{"from": "ground"}, to=name, damping=2 * rng.uniform(0.05, 0.3) * mine / tau, free=["damping"])
        largest = motor(rng, rig, "motor_" + name, name, 1.3 * k * x, name[0])
        lows.append(-largest)
        highs.append(largest)
        encoder(rig, name, True, name[0])
    return rig, Setting(tau, sampling(rng, tau), lows, highs)


BUILDERS = dict(zip(FAMILIES, (mass_spring_damper, hinge_on_a_spring, two_mass_drive, tendon_finger, pendulum, three_mass_chain, free_axis, finger_pair)))
