"""How far this integrator is to be trusted: against the closed solution of stick and slip, and against MuJoCo.

    python -m hardlaw.check

Reads tests/foreign/trajectories and mass_spring_damper.exact.csv and prints the largest differences over the
range of the motion; exit status 1 where one is larger than MuJoCo's own error allows.
"""

import json
import sys
import tomllib
from pathlib import Path

import numpy as np

from . import motion
from .system import Rig, build, relaxed

FOLDER = Path(__file__).resolve().parents[1]
TABLES = ("body", "spring", "damper", "gravity", "tendon", "actuator", "sensor")
# The last two are what MuJoCo's soft constraints allow.
LIMITS = {"mass_spring_damper": 1e-8, "pendulum": 1e-8, "two_mass_drive": 1e-8, "tendon_finger": 1e-6, "joint_friction": 1e-5, "end_stop": 1e-4}


def rig_of(tables):
    """Rig and effects of a parsed rig file."""
    found = Rig(tables["name"])
    for table in TABLES:
        for keys in tables.get(table, []):
            if "path" in keys:
                keys["path"] = [(part["body"], part["arm"]) for part in keys["path"]]
            found.add(table, **keys)
    effects = [{"kind": e.pop("kind"), "component": e.pop("component"), "parameters": e} for e in tables.get("effect", [])]
    return found, effects


def difference(rig, effects, t, u, q):
    """Largest difference from positions q (samples, sensors), over their range."""
    s, states = build(rig, rig.values(), effects)
    n = s.n
    w = motion.work(s, states, np.full(states, 0.1 * np.ptp(q)))
    idle = motion.Control(0.0, 0.0, np.zeros(1), 0, np.inf, 1.0)
    still = np.zeros((len(t), max(n, q.shape[1])))
    y = relaxed(s, states, np.zeros(n), np.zeros(n))
    _, clean, _ = motion.record(s, y, t, u.copy(), still, still, np.zeros(q.shape[1]), idle, False, motion.TOLERANCE, w)
    return float((np.abs(clean - q).max(axis=0) / np.ptp(q, axis=0)).max())


def main():
    failed = False
    truth = json.loads((FOLDER / "mass_spring_damper.truth.json").read_text())
    rig = Rig("closed solution")
    rig.add("body", name="mass", motion="slide", inertia=truth["mass_kg"])
    rig.add("spring", name="coil", **{"from": "ground"}, to="mass", stiffness=truth["stiffness_N_m"])
    rig.add("damper", name="dashpot", **{"from": "ground"}, to="mass", damping=truth["damping_N_s_m"])
    rig.add("actuator", name="push", drives="mass", input="u_N", gain=1.0)
    rig.add("sensor", name="encoder", reads="mass.position", signal="q_m")
    friction = {"kind": "coulomb_friction", "component": "mass", "parameters": {"level": truth["coulomb_friction_N"]}}
    rows = np.genfromtxt(FOLDER / "mass_spring_damper.exact.csv", delimiter=",", skip_header=2)
    size = difference(rig, [friction], rows[:, 0], rows[:, 1:2], rows[:, 2:])
    print("%-20s %.1e of the range" % ("closed solution", size))
    failed |= size > 1e-8
    for name, limit in LIMITS.items():
        rig, effects = rig_of(tomllib.loads((FOLDER / "trajectories" / (name + ".toml")).read_text()))
        rows = np.genfromtxt(FOLDER / "trajectories" / (name + ".csv"), delimiter=",", skip_header=2)
        size = difference(rig, effects, rows[:, 0], rows[:, 1:2], rows[:, 2:])
        print("%-20s %.1e of the range from MuJoCo" % (name, size))
        failed |= size > limit
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
