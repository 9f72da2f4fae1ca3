"""Concealed effects at random strength, measured against how the rig moves without them.

`Typical` says how; `draw(kind)` gives parameters for a strength of 1, around a tenth to a half of the forces
at the place, and more or less for another. Outside the vocabulary: OUTSIDE.
"""

from dataclasses import dataclass, field

import numpy as np

KINDS = {  # kind: (family, where it can sit)
    "coulomb_friction": ("friction", ["body"]),
    "stribeck_friction": ("friction", ["body"]),
    "direction_dependent_friction": ("friction", ["body"]),
    "load_dependent_friction": ("friction", ["body", "tendon"]),
    "viscous_damping": ("damping", ["undamped"]),
    "quadratic_drag": ("damping", ["body"]),
    "cubic_stiffness": ("stiffness", ["spring"]),
    "quadratic_stiffness": ("stiffness", ["spring"]),
    "end_stop": ("gap", ["body"]),
    "backlash": ("gap", ["spring", "two_sided_tendon", "actuator"]),
    "tendon_slack": ("gap", ["two_sided_tendon"]),
    "hysteresis": ("memory", ["spring"]),
    "viscoelastic_creep": ("memory", ["spring"]),
    "gravity_load": ("load", ["weightless"]),
    "constant_load": ("load", ["body"]),
    "position_ripple": ("load", ["body"]),
    "hidden_mode": ("mode", ["body"]),
    "cross_coupling": ("stiffness", ["pair"]),
    "input_delay": ("actuator", ["actuator"]),
    "actuator_lag": ("actuator", ["actuator"]),
    "input_dead_zone": ("actuator", ["actuator"]),
    "input_saturation": ("actuator", ["actuator"]),
    "input_curvature": ("actuator", ["actuator"]),
    "sensor_lag": ("sensor", ["sensor"]),
    "sensor_curvature": ("sensor", ["position_sensor"]),
}

# Kinds of the vocabulary that came after the published tables: no round draws them, so that every case of an old seed stays what it was.
LATER = {
    "presliding_friction": ("friction", ["body"]),
    "plastic_set": ("memory", ["spring"]),
    "warm_up_friction": ("friction", ["body"]),
}
EVERY = {**KINDS, **LATER}

OUTSIDE = {
    "one_sided_gain": "actuator",
    "sagging_gain": "actuator",
    "input_slew": "actuator",
    "breathing_stiffness": "spring",
    "position_dependent_friction": "body",
    "warming_friction": "body",
    "changing_inertia": "body",
    "root_damping": "body",
    "van_der_pol": "body",
    "sensor_ripple": "position_sensor",
    "sensor_play": "position_sensor",
}


@dataclass
class Typical:
    """How a rig moves without the effect: per component peaks (half ranges) and RMS values."""

    inertia: dict = field(default_factory=dict)
    position: dict = field(default_factory=dict)  # body: (lowest, highest)
    speed: dict = field(default_factory=dict)  # body, spring: RMS
    force: dict = field(default_factory=dict)  # body: RMS of the largest of its forces
    extension: dict = field(default_factory=dict)  # spring: half range
    stiffness: dict = field(default_factory=dict)
    stretch: dict = field(default_factory=dict)  # tendon: half range
    input: dict = field(default_factory=dict)  # actuator: 95th percentile of its size
    reading: dict = field(default_factory=dict)  # sensor: half range


def half(x):
    return 0.5 * float(np.ptp(x))


def typical(rig, values, states, inputs, t, clean):
    """Measured on one run of the rig as it is believed, with its true values."""
    found = Typical()
    bodies = rig.bodies()
    n = len(bodies)
    q, v = {"ground": 0.0 * t}, {"ground": 0.0 * t}
    for i, name in enumerate(bodies):
        q[name], v[name] = states[:, i], states[:, n + i]
    joint = {name: 0.0 * t for name in [*bodies, "ground"]}
    for k in rig.all("spring"):
        x = q[k["to"]] - q[k["from"]] - values[k["name"] + ".rest"]
        found.extension[k["name"]] = half(x)
        found.stiffness[k["name"]] = values[k["name"] + ".stiffness"]
        found.speed[k["name"]] = rms(v[k["to"]] - v[k["from"]])
        joint[k["to"]] = joint[k["to"]] + np.abs(values[k["name"] + ".stiffness"] * x)
        joint[k["from"]] = joint[k["from"]] + np.abs(values[k["name"] + ".stiffness"] * x)
    for k in rig.all("gravity"):
        joint[k["body"]] = joint[k["body"]] + np.abs(values[k["name"] + ".amplitude"] * np.sin(q[k["body"]]))
    acting = {k["drives"]: (k["name"], i) for i, k in enumerate(rig.all("actuator"))}
    for k in rig.all("tendon"):
        stretch = sum(arm * q[body] for body, arm in k["path"])
        if k["name"] in acting:
            name, i = acting[k["name"]]
            stretch = stretch - values[name + ".gain"] * inputs[:, i]
        found.stretch[k["name"]] = half(stretch)
        for body, arm in k["path"]:
            joint[body] = joint[body] + abs(arm) * values[k["name"] + ".stiffness"] * np.abs(stretch)
    for i, k in enumerate(rig.all("actuator")):
        found.input[k["name"]] = float(np.quantile(np.abs(inputs[:, i]), 0.95))
    for name in bodies:
        found.inertia[name] = values[name + ".inertia"]
        found.position[name] = (float(q[name].min()), float(q[name].max()))
        found.speed[name] = rms(v[name])
        sizes = [rms(values[name + ".inertia"] * np.gradient(v[name], t)), rms(joint[name])]
        if name in acting:
            sizes.append(rms(values[acting[name][0] + ".gain"] * inputs[:, acting[name][1]]))
        found.force[name] = max(sizes)
    for i, k in enumerate(rig.all("sensor")):
        found.reading[k["name"]] = max(abs(clean[:, i].min()), abs(clean[:, i].max()))
    return found


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


def sites(rig, where):
    """Names of the components of a rig where an effect of this sort can sit."""
    bodies = rig.bodies()
    damped = {k["to"] for k in rig.all("damper") if k["from"] == "ground"}
    if where == "body":
        return bodies
    if where == "undamped":
        # Next to a damper of the same place a further one is nothing but its value.
        return [b for b in bodies if b not in damped]
    if where == "weightless":
        return [b for b in bodies if b not in {k["body"] for k in rig.all("gravity")}]
    if where == "two_sided_tendon":
        return [k["name"] for k in rig.all("tendon") if not k["unilateral"]]
    if where == "position_sensor":
        return [k["name"] for k in rig.all("sensor") if k["reads"].endswith(".position")]
    if where == "pair":
        joined = {frozenset((k["from"], k["to"])) for k in rig.all("spring")}
        return ["%s+%s" % (a, b) for i, a in enumerate(bodies) for b in bodies[i + 1:] if frozenset((a, b)) not in joined]
    return [k["name"] for k in rig.all(where)]


def draw(rng, kind, place, rig, typ, setting, strength):
    """Parameters of a kind at a place; `strength` 1 is around a fifth of the forces there."""
    def u(low, high):
        return float(rng.uniform(low, high))

    def sign():
        return float(rng.choice([-1.0, 1.0]))

    hinge = place in rig.bodies() and rig.component(place)["motion"] == "hinge"
    s = strength
    force, speed = typ.force.get(place, 0.0), typ.speed.get(place, 0.0)
    low, high = typ.position.get(place, (0.0, 0.0))
    reach = 0.5 * (high - low)
    k, x = typ.stiffness.get(place, 0.0), typ.extension.get(place, 0.0)
    peak = typ.input.get(place, 0.0)
    m = typ.inertia.get(place, 0.0)
    if kind == "coulomb_friction":
        return {"level": s * u(0.12, 0.3) * force}
    if kind == "stribeck_friction":
        level = s * u(0.1, 0.2) * force
        return {"level": level, "static_level": level * u(1.5, 2.4), "velocity": u(0.1, 0.4) * speed}
    if kind == "direction_dependent_friction":
        level = s * u(0.1, 0.3) * force
        levels = rng.permutation([level, level * u(0.2, 0.7)])
        # The smaller of the two dampings is the rig's own damper: reported as 0.
        damping = rng.permutation([0.0, s * u(0.15, 0.4) * force / max(speed, 1e-30)])
        return {"level_pos": float(levels[0]), "level_neg": float(levels[1]), "damping_pos": float(damping[0]), "damping_neg": float(damping[1])}
    if kind == "load_dependent_friction":
        return {"coefficient": min(0.6, s * u(0.12, 0.3))}
    if kind == "presliding_friction":
        return {"level": s * u(0.15, 0.35) * force, "distance": u(0.1, 0.3) * reach}
    if kind == "plastic_set":
        return {"stiffness": s * u(0.4, 1.0) * k, "yield_extension": u(0.2, 0.5) * x}
    if kind == "warm_up_friction":
        return {"level": s * u(0.3, 0.5) * force, "velocity": u(0.5, 0.9) * speed, "time_constant": setting.dt * u(150, 400)}
    if kind == "viscous_damping":
        return {"damping": s * u(0.2, 0.5) * force / max(speed, 1e-30)}
    if kind == "quadratic_drag":
        return {"coefficient": s * u(0.15, 0.4) * force / max(speed, 1e-30) ** 2}
    if kind == "cubic_stiffness":
        c = sign() * s * u(0.3, 0.9)
        return {"coefficient": max(c, -0.3) * k / x**2}
    if kind == "quadratic_stiffness":
        return {"coefficient": sign() * min(s * u(0.15, 0.35), 0.4) * k / x}
    if kind == "end_stop":
        side = sign()
        limit = high if side > 0 else low
        # Further in for a stronger one; it touches at all only inside the motion.
        at = limit - side * min(1.2, 0.5 * s**0.5) * u(0.5, 1.0) * reach
        stiffness = u(4.0, 20.0) * (force / max(reach, 1e-30))
        return {"position": at, "stiffness": stiffness, "damping": u(0.1, 0.6) * np.sqrt(stiffness * m), "side": side}
    if kind == "backlash":
        if place in typ.input:
            return {"gap": s * u(0.25, 0.6) * peak}
        return {"gap": s * u(0.25, 0.6) * typ.stretch.get(place, x)}
    if kind == "tendon_slack":
        return {"slack": u(0.0, 0.4) * typ.stretch[place]}
    if kind == "hysteresis":
        exponent = float(rng.choice([1.0, 1.0, u(1.0, 2.0)]))
        total = (u(0.15, 0.4) * x) ** -exponent  # (largest z)^-n
        share = u(0.4, 1.0)
        return {"alpha": s * u(0.5, 1.2) * k, "beta": share * total, "gamma": (1.0 - share) * total * sign(), "exponent": exponent}
    if kind == "viscoelastic_creep":
        return {"stiffness": s * u(0.3, 0.8) * k, "time_constant": setting.tau * 10.0 ** u(-0.1, 1.2)}
    if kind == "gravity_load" and hinge:
        return {"amplitude": s * u(0.25, 0.7) * force, "zero": sign() * u(0.3, 1.3)}
    if kind == "gravity_load":
        return {"amplitude": s * u(0.15, 0.5) * force, "zero": 0.0}
    if kind == "constant_load":
        return {"level": sign() * s * u(0.15, 0.5) * force}
    if kind == "position_ripple":
        return {"amplitude": s * u(0.12, 0.35) * force, "wave_number": max(2.2 if hinge else 0.0, u(4.0, 12.0) / max(reach, 1e-30)), "phase": u(-np.pi, np.pi)}
    if kind == "hidden_mode":
        own = m * min(0.6, s * u(0.15, 0.4))
        omega = u(0.7, 1.8) / setting.tau
        return {"inertia": own, "stiffness": own * omega**2, "damping": 2 * u(0.02, 0.12) * own * omega}
    if kind == "cross_coupling":
        a, b = place.split("+")
        stiffness = min(typ.force[c] / max(0.5 * (typ.position[c][1] - typ.position[c][0]), 1e-30) for c in (a, b))
        return {"stiffness": s * u(0.12, 0.4) * stiffness}
    if kind == "input_delay":
        return {"delay": min(12.0 * setting.dt, s * u(0.15, 0.5) * setting.tau)}
    if kind == "actuator_lag":
        return {"time_constant": s * u(0.2, 0.7) * setting.tau}
    if kind == "input_dead_zone":
        return {"width": min(0.6, s * u(0.1, 0.3)) * peak}
    if kind == "input_saturation":
        return {"limit": max(0.15, 1.0 - s * u(0.3, 0.55)) * peak}
    if kind == "input_curvature":
        return {"coefficient": max(sign() * s * u(0.25, 0.7), -0.45) / peak}
    if kind == "sensor_lag":
        return {"time_constant": s * u(0.15, 0.6) * setting.tau}
    if kind == "sensor_curvature":
        size = typ.reading[place]
        return {"quadratic": sign() * min(s * u(0.08, 0.25), 0.3) / size, "cubic": sign() * min(s * u(0.05, 0.15), 0.15) / size**2}
    # Outside the vocabulary.
    if kind == "one_sided_gain":
        return {"ratio": max(0.1, 1.0 - s * u(0.2, 0.5))}
    if kind == "sagging_gain":
        return {"per_second": min(0.8, s * u(0.3, 0.6)) / (1300 * setting.dt)}
    if kind == "input_slew":
        return {"time_constant": 0.02 * setting.tau, "rate": peak / setting.tau * u(0.2, 0.5) / s}
    if kind == "breathing_stiffness":
        return {"depth": min(0.5, s * u(0.15, 0.4)), "frequency": u(0.05, 0.6) / setting.tau}
    if kind == "position_dependent_friction":
        return {"level": s * u(0.12, 0.25) * force, "depth": u(0.7, 0.95), "wave_number": u(2.0, 6.0) / max(reach, 1e-30)}
    if kind == "warming_friction":
        return {"level": s * u(0.2, 0.4) * force, "time_constant": setting.dt * u(300, 600)}
    if kind == "changing_inertia":
        return {"depth": min(0.6, s * u(0.25, 0.5)), "wave_number": u(1.5, 4.0) / max(reach, 1e-30), "phase": u(-np.pi, np.pi)}
    if kind == "root_damping":
        return {"coefficient": s * u(0.2, 0.4) * force / np.sqrt(max(speed, 1e-30))}
    if kind == "van_der_pol":
        return {"coefficient": s * u(0.15, 0.3) * force / max(speed, 1e-30), "position": u(0.4, 0.7) * reach}
    if kind == "sensor_ripple":
        return {"amplitude": s * u(0.03, 0.08) * typ.reading[place], "wave_number": u(6.0, 15.0) / typ.reading[place]}
    if kind == "sensor_play":
        return {"gap": s * u(0.1, 0.25) * typ.reading[place]}
    raise ValueError(kind)
