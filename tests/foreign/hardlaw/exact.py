"""One noise-free motion of every kind of the vocabulary, against which the simulator's laws are held.

    python -m hardlaw.exact

writes tests/foreign/laws/KIND.toml (true values, the effect as [[effect]]) and KIND.csv, or KIND.WHERE where a
kind has several laws, and prints by how
much a tolerance a hundred times wider moves each.
"""

import sys
from pathlib import Path

import numpy as np

from . import cases, effects
from .system import number

SEED, SAMPLES = 3, 400
# Kinds that have another law at another sort of component.
ELSEWHERE = [("load_dependent_friction", "tendon"), ("load_dependent_friction", "body"), ("backlash", "spring"), ("backlash", "tendon"), ("backlash", "actuator")]
FOLDER = Path(__file__).resolve().parents[1] / "laws"


def exact(kind, where, number_of):
    """A rig, its effect, and a motion of it: (bench, effect, run, error)."""
    for retry in range(400):
        rng = np.random.default_rng([SEED, number_of, retry])
        _, rig, setting, places = cases.mechanism(rng, [kind])
        if where and places[0] not in [keys["name"] for keys in rig.all(where)]:
            continue
        rig.integrates = True  # it starts where every coordinate is 0, at rest
        bench = cases.Bench(rng, rig, setting, False, False, {"fit": (SAMPLES, SAMPLES + 1), "other": (SAMPLES, SAMPLES + 1)})
        sensors = len(rig.all("sensor"))
        typ, _ = cases.baseline(bench, sensors)
        present = [{"kind": kind, "component": places[0], "parameters": effects.draw(rng, kind, places[0], rig, typ, setting, 1.0)}]
        quiet = (np.zeros((SAMPLES, sensors)), np.zeros(sensors), np.zeros((SAMPLES, len(rig.bodies()))))
        runs = [bench.run(0, present, *quiet, typ, tolerance) for tolerance in (1e-10, 1e-8)]
        plain = bench.run(0, [], *quiet, typ, 1e-8)
        if any(run is None or not cases.bounded(run, typ, rig) for run in runs):
            continue
        spread = np.ptp(runs[0]["clean"], axis=0)
        moved = (np.abs(runs[0]["clean"] - plain["clean"]).max(axis=0) / spread).max()
        error = (np.abs(runs[0]["clean"] - runs[1]["clean"]).max(axis=0) / spread).max()
        if moved > 0.02 and (spread > 0).all():
            return bench, present[0], runs[0], error, moved
    raise RuntimeError(kind)


def main():
    FOLDER.mkdir(exist_ok=True)
    for k, (kind, where) in enumerate([(kind, None) for kind in effects.KINDS] + ELSEWHERE + [(kind, None) for kind in effects.LATER]):
        name = kind if where is None else "%s.%s" % (kind, where)
        bench, effect, run, error, moved = exact(kind, where, k)
        rig = bench.rig
        print("%-32s at %-14s moves it by %.2f of its range; integrated to within %.0e" % (name, effect["component"], moved, error), file=sys.stderr)
        rig.free = []
        table = ["", "[[effect]]", 'kind = "%s"' % kind, 'component = "%s"' % effect["component"]]
        table += ["%s = %s" % (key, number(value)) for key, value in effect["parameters"].items()]
        (FOLDER / (name + ".toml")).write_text(rig.toml({}, {}) + "\n".join(table) + "\n")
        inputs = [keys["input"] for keys in rig.all("actuator")]
        signals = [keys["signal"] for keys in rig.all("sensor")]
        rows = [",".join(["t", *inputs, *signals])]
        for i in range(SAMPLES):
            rows.append(",".join("%.10g" % v for v in [run["t"][i], *run["u"][i], *run["clean"][i]]))
        (FOLDER / (name + ".csv")).write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
