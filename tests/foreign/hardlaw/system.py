"""A rig as the contract describes it, with true values and concealed effects, turned into arrays."""

from collections import namedtuple
from dataclasses import dataclass, field

import numpy as np

from . import laws

System = namedtuple(
    "System",
    "n inertia modulation load springs dampers gravities ripples stops tendons actuators frictions pressed memories sensors")

PARAMETERS = {  # keys of each table that are parameters, with what the contract gives where they are absent
    "body": {"inertia": None},
    "spring": {"stiffness": None, "rest": 0.0},
    "damper": {"damping": None},
    "gravity": {"amplitude": None, "zero": 0.0},
    "tendon": {"stiffness": None, "damping": 0.0, "pretension": 0.0},
    "actuator": {"gain": None},
    "sensor": {"gain": 1.0, "offset": 0.0},
}


@dataclass
class Rig:
    """Tables of the rig file in order; `free` names parameters written as { value }, as "component.key"."""

    name: str
    tables: list = field(default_factory=list)  # (table, {key: value})
    free: list = field(default_factory=list)
    integrates: bool = False

    def add(self, table, free=(), **keys):
        """One component; `free`: its parameters that are believed and not known."""
        self.tables.append((table, keys))
        self.free += ["%s.%s" % (keys["name"], key) for key in free]

    def all(self, table):
        return [keys for name, keys in self.tables if name == table]

    def bodies(self):
        return [keys["name"] for keys in self.all("body")]

    def index(self, table, name):
        return [keys["name"] for keys in self.all(table)].index(name)

    def component(self, name):
        return next(keys for _, keys in self.tables if keys["name"] == name)

    def values(self):
        """Every parameter as "component.key" with the value in the tables."""
        found = {}
        for table, keys in self.tables:
            for key, default in PARAMETERS[table].items():
                found["%s.%s" % (keys["name"], key)] = keys.get(key, default)
        return found

    def toml(self, believed, bounds):
        """The rig file with believed values; `bounds`: (min, max) of some of the free ones."""
        lines = ['format = "sinew-rig/1"', 'name = "%s"' % self.name]
        for table, keys in self.tables:
            lines += ["", "[[%s]]" % table]
            for key, value in keys.items():
                name = "%s.%s" % (keys["name"], key)
                if name in self.free:
                    text = "value = %s" % number(believed[name])
                    if name in bounds:
                        text += ", min = %s, max = %s" % tuple(number(b) for b in bounds[name])
                    lines.append("%s = { %s }" % (key, text))
                elif key == "path":
                    parts = ["{ body = \"%s\", arm = %s }" % (b, number(a)) for b, a in value]
                    lines.append("path = [%s]" % ", ".join(parts))
                else:
                    lines.append("%s = %s" % (key, written(value)))
        return "\n".join(lines) + "\n"


def number(value):
    """A TOML float with ten digits."""
    text = "%.10g" % value
    return text if any(c in text for c in ".en") else text + ".0"


def written(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"%s"' % value
    if isinstance(value, list):
        return "[%s]" % ", ".join(number(v) for v in value)
    return number(value)


def build(rig, values, effects=()):
    """The arrays of a rig with these parameter values and concealed effects (dicts: kind, component, parameters).

    Returns the system and the number of its states."""
    bodies = rig.bodies()
    at = {name: i for i, name in enumerate(bodies)} | {"ground": -1}
    hidden = [e for e in effects if e["kind"] == "hidden_mode"]
    n = len(bodies) + len(hidden)
    states = 2 * n
    inertia = np.array([values["%s.inertia" % b] for b in bodies] + [e["parameters"]["inertia"] for e in hidden])
    hinge = {k["name"]: k["motion"] == "hinge" for k in rig.all("body")}
    t = {name: [] for name in "springs dampers gravities ripples stops tendons actuators frictions memories sensors".split()}
    pressed = []
    load, modulation = np.zeros(n), np.zeros((n, 3))

    for k in rig.all("spring"):
        t["springs"].append([at[k["from"]], at[k["to"]], values[k["name"] + ".stiffness"], values[k["name"] + ".rest"], 0, 0, 0, 0, 0])
    for k in rig.all("damper"):
        t["dampers"].append([at[k["from"]], at[k["to"]], values[k["name"] + ".damping"], laws.LINEAR, 1])
    for k in rig.all("gravity"):
        t["gravities"].append([at[k["body"]], values[k["name"] + ".amplitude"], values[k["name"] + ".zero"], hinge[k["body"]]])
    acting = [k["drives"] for k in rig.all("actuator")]
    for k in rig.all("tendon"):
        row = [values[k["name"] + ".stiffness"], values[k["name"] + ".damping"], values[k["name"] + ".pretension"],
               k.get("unilateral", True), 0, 0, acting.index(k["name"]) if k["name"] in acting else -1]
        arms = np.zeros(n)
        for body, arm in k["path"]:
            arms[at[body]] += arm
        t["tendons"].append(row + list(arms))
    for k in rig.all("actuator"):
        t["actuators"].append([at.get(k["drives"], -1), values[k["name"] + ".gain"], 0, 0, np.inf, 0, -1, 0, 0, 0, 1, 0])
    for k in rig.all("sensor"):
        name, what = k["reads"].rsplit(".", 1)
        what = ["position", "velocity", "tension"].index(what)
        index = rig.index("tendon", name) if what == laws.TENSION else at[name]
        t["sensors"].append([what, index, values[k["name"] + ".gain"], values[k["name"] + ".offset"], 0, 0, 0, -1, 0, 0, 0])

    def friction(body, forward, backward, hold_forward, hold_backward, vs=0.0, dp=0.0, dm=0.0, mu=0.0, source=0, arms=None,
                 index=0, eps=0.0, wave=0.0, warm=0.0):
        along = np.zeros(n)
        if arms is None:
            along[at[body]] = 1.0
            index = at[body]
        else:
            along[:] = arms
        pressed.append(index)
        t["frictions"].append([forward, backward, hold_forward, hold_backward, vs, dp, dm, mu, source, eps, wave, warm] + list(along))

    for e in effects:
        kind, place, p = e["kind"], e["component"], e["parameters"]
        spring = rig.index("spring", place) if place in [k["name"] for k in rig.all("spring")] else None
        tendon = rig.index("tendon", place) if place in [k["name"] for k in rig.all("tendon")] else None
        actuator = rig.index("actuator", place) if place in [k["name"] for k in rig.all("actuator")] else None
        sensor = rig.index("sensor", place) if place in [k["name"] for k in rig.all("sensor")] else None
        if kind == "coulomb_friction":
            friction(place, *[p["level"]] * 4)
        elif kind == "stribeck_friction":
            friction(place, p["level"], p["level"], p["static_level"], p["static_level"], p["velocity"])
        elif kind == "direction_dependent_friction":
            friction(place, *[p["level_pos"], p["level_neg"]] * 2, 0.0, p["damping_pos"], p["damping_neg"])
        elif kind == "load_dependent_friction" and tendon is not None:
            friction(None, 0, 0, 0, 0, mu=p["coefficient"], source=laws.TENDON_LOAD, index=tendon, arms=t["tendons"][tendon][laws.TE_ARM:])
        elif kind == "load_dependent_friction":
            source = laws.ACTUATOR_LOAD if place in acting else laws.JOINT_LOAD
            friction(place, 0, 0, 0, 0, mu=p["coefficient"], source=source)
        elif kind in ("viscous_damping", "quadratic_drag", "root_damping", "van_der_pol"):
            law = {"viscous_damping": laws.LINEAR, "quadratic_drag": laws.SQUARE, "root_damping": laws.ROOT, "van_der_pol": laws.VAN_DER_POL}[kind]
            a, b = (t["springs"][spring][0], t["springs"][spring][1]) if spring is not None else (-1, at[place])
            t["dampers"].append([a, b, p.get("damping", p.get("coefficient")), law, p.get("position", 1.0)])
        elif kind == "cubic_stiffness":
            t["springs"][spring][laws.SP_K3] = p["coefficient"]
        elif kind == "quadratic_stiffness":
            t["springs"][spring][laws.SP_K2] = p["coefficient"]
        elif kind == "end_stop":
            t["stops"].append([at[place], p["position"], p["stiffness"], p["damping"], p["side"]])
        elif kind == "backlash" and spring is not None:
            t["springs"][spring][laws.SP_GAP] = p["gap"]
        elif kind == "backlash" and tendon is not None:
            t["tendons"][tendon][laws.TE_GAP] = p["gap"]
        elif kind == "backlash":
            t["actuators"][actuator][laws.AC_PLAY] = p["gap"]
        elif kind == "tendon_slack":
            t["tendons"][tendon][laws.TE_UNI] = True
            t["tendons"][tendon][laws.TE_SLACK] = p["slack"]
        elif kind == "hysteresis":
            t["memories"].append([spring, laws.BOUC_WEN, p["alpha"], p["beta"], p["gamma"], p["exponent"], states])
            states += 1
        elif kind == "viscoelastic_creep":
            t["memories"].append([spring, laws.MAXWELL, p["stiffness"], p["time_constant"], 0, 0, states])
            states += 1
        elif kind == "plastic_set":
            t["memories"].append([spring, laws.JENKIN, p["stiffness"], p["yield_extension"], 0, 0, states])
            states += 1
        elif kind == "warm_up_friction":
            friction(place, *[p["level"]] * 4)
            t["memories"].append([len(t["frictions"]) - 1, laws.HEAT, p["velocity"], p["time_constant"], 0, 0, states])
            states += 1
        elif kind == "presliding_friction":
            t["memories"].append([at[place], laws.DAHL, p["level"], p["distance"], 0, 0, states])
            states += 1
        elif kind == "gravity_load":
            t["gravities"].append([at[place], p["amplitude"], p["zero"], hinge[place]])
        elif kind == "constant_load":
            load[at[place]] += p["level"]
        elif kind == "position_ripple":
            t["ripples"].append([at[place], p["amplitude"], p["wave_number"], p["phase"]])
        elif kind == "hidden_mode":
            mine = len(bodies) + hidden.index(e)
            t["springs"].append([at[place], mine, p["stiffness"], 0, 0, 0, 0, 0, 0])
            t["dampers"].append([at[place], mine, p["damping"], laws.LINEAR, 1])
        elif kind == "cross_coupling":
            a, b = place.split("+")
            t["springs"].append([at[a], at[b], p["stiffness"], 0, 0, 0, 0, 0, 0])
        elif kind == "input_delay":
            t["actuators"][actuator][laws.AC_DELAY] = p["delay"]
        elif kind in ("actuator_lag", "input_slew"):
            t["actuators"][actuator][laws.AC_LAG] = p["time_constant"]
            t["actuators"][actuator][laws.AC_RATE] = p.get("rate", 0.0)
            t["actuators"][actuator][laws.AC_STATE] = states
            states += 1
        elif kind == "input_dead_zone":
            t["actuators"][actuator][laws.AC_DEAD] = p["width"]
        elif kind == "input_saturation":
            t["actuators"][actuator][laws.AC_LIMIT] = p["limit"]
        elif kind == "input_curvature":
            t["actuators"][actuator][laws.AC_CURVE] = p["coefficient"]
        elif kind == "sensor_lag":
            t["sensors"][sensor][laws.SE_LAG] = p["time_constant"]
            t["sensors"][sensor][laws.SE_STATE] = states
            states += 1
        elif kind == "sensor_curvature":
            t["sensors"][sensor][laws.SE_A], t["sensors"][sensor][laws.SE_B] = p["quadratic"], p["cubic"]
        # From here on: what is outside the vocabulary.
        elif kind == "one_sided_gain":
            t["actuators"][actuator][laws.AC_BACK] = p["ratio"]
        elif kind == "sagging_gain":
            t["actuators"][actuator][laws.AC_SAG] = p["per_second"]
        elif kind == "breathing_stiffness":
            t["springs"][spring][laws.SP_EPS], t["springs"][spring][laws.SP_OMEGA] = p["depth"], p["frequency"]
        elif kind == "position_dependent_friction":
            friction(place, *[p["level"]] * 4, eps=p["depth"], wave=p["wave_number"])
        elif kind == "warming_friction":
            friction(place, *[p["level"]] * 4, warm=p["time_constant"])
        elif kind == "changing_inertia":
            modulation[at[place]] = [p["depth"], p["wave_number"], p["phase"]]
        elif kind == "sensor_ripple":
            t["sensors"][sensor][laws.SE_WAVE], t["sensors"][sensor][laws.SE_WAVE_N] = p["amplitude"], p["wave_number"]
        elif kind == "sensor_play":
            t["sensors"][sensor][laws.SE_PLAY] = p["gap"]
        else:
            raise ValueError("%s at %s" % (kind, place))

    widths = {"springs": 9, "dampers": 5, "gravities": 4, "ripples": 4, "stops": 5, "tendons": 7 + n, "actuators": 12,
              "frictions": 12 + n, "memories": 7, "sensors": 11}
    arrays = {name: np.array(t[name], float).reshape(-1, widths[name]) for name in t}
    for k in range(len(arrays["sensors"])):
        if arrays["sensors"][k, laws.SE_LAG] == 0.0:
            arrays["sensors"][k, laws.SE_STATE] = -1
    system = System(n, inertia, modulation, load, pressed=np.array(pressed, np.int64).reshape(-1), **arrays)
    return system, states


def relaxed(s, states, q, v):
    """The state with bodies at q and v, what is hidden beside its host, and memories at rest."""
    y = np.zeros(states)
    n = len(q)
    y[:n], y[s.n:s.n + n] = q, v
    for row in s.springs:
        if row[laws.SP_TO] >= n:  # a concealed body hangs on this spring
            y[int(row[laws.SP_TO])] = y[int(row[laws.SP_FROM])]
            y[s.n + int(row[laws.SP_TO])] = y[s.n + int(row[laws.SP_FROM])]
    for row in s.memories:
        if row[laws.ME_LAW] == laws.MAXWELL:
            spring = s.springs[int(row[laws.ME_SPRING])]
            ends = [y[int(spring[c])] if spring[c] >= 0 else 0.0 for c in (laws.SP_FROM, laws.SP_TO)]
            y[int(row[laws.ME_STATE])] = ends[1] - ends[0] - spring[laws.SP_REST]
    return y


def scales(s, states, typ, rig):
    """Size of each state, for the error control; typ: effects.Typical, or None where nothing is known yet."""
    scale = np.full(states, 1e-12)
    if typ is None:
        return scale
    bodies = rig.bodies()
    for i in range(s.n):
        name = bodies[min(i, len(bodies) - 1)]
        low, high = typ.position[name]
        scale[i], scale[s.n + i] = 0.5 * (high - low), typ.speed[name]
    names = [k["name"] for k in rig.all("spring")]
    for row in s.memories:
        if row[laws.ME_LAW] == laws.DAHL:
            scale[int(row[laws.ME_STATE])] = row[laws.ME_A]
            continue
        if row[laws.ME_LAW] == laws.HEAT:
            scale[int(row[laws.ME_STATE])] = 1.0
            continue
        scale[int(row[laws.ME_STATE])] = typ.extension[names[int(row[laws.ME_SPRING])]]
    for row, keys in zip(s.actuators, rig.all("actuator")):
        if row[laws.AC_STATE] >= 0:
            scale[int(row[laws.AC_STATE])] = typ.input[keys["name"]]
    for row, keys in zip(s.sensors, rig.all("sensor")):
        if row[laws.SE_STATE] >= 0:
            scale[int(row[laws.SE_STATE])] = typ.reading[keys["name"]]
    return np.maximum(scale, 1e-15)
