"""Cases: a rig as its owner believes it, four recordings of what is really there, and the truth in another folder.

    python -m hardlaw.cases --seed S --cases N --out DIR --truth DIR

One round of 85 cases: each kind once (a quarter of them weak), 13 pairs, 10 controls each of exact, wrong
parameters, disturbance, heavy noise or quantisation, and 7 outside the vocabulary; 8 rounds make the proof.
Case k of a seed is the same whatever N is. What is there already is kept.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

from . import effects, excitation, motion, rigs, visibility
from .system import build, relaxed, scales

ROLES = ("fit-a", "fit-b", "check", "test")
ROUND = 85
LENGTHS = {"fit": (1200, 1900), "other": (900, 1300)}  # samples
CONTROLS = ("exact", "wrong parameters", "disturbance", "noise")
# What a case says where the rig without the effect diverges: JSON has no infinity.
BOUNDLESS = 1e6
# Visible above this part of the noise after a refit: strong. Weak ones lie between the other two.
STRONG, WEAK = 1.0, (0.15, 0.7)
# A simpler kind that must not explain a strong case: it would rightly be named instead.
SIMPLER = {"stribeck_friction": "coulomb_friction", "direction_dependent_friction": "coulomb_friction",
           "load_dependent_friction": "coulomb_friction", "presliding_friction": "coulomb_friction",
           "warm_up_friction": "coulomb_friction",
           "gravity_load": "constant_load"}


# Their memory is zero where a recording begins.
REMEMBERS = ("hysteresis", "presliding_friction", "plastic_set", "warm_up_friction")


def plan(seed, k):
    """What case k hides: category, kinds, strength."""
    number, position = divmod(k, ROUND)
    rng = np.random.default_rng([seed, 1, number])
    kinds = list(effects.KINDS)
    entries = [("one", [kind], "weak" if (i + number) % 4 == 3 else "strong") for i, kind in enumerate(kinds)]
    while len(entries) < 25 + 13:
        pair = sorted(rng.permutation(kinds)[:2], key=kinds.index)
        families = {effects.KINDS[kind][0] for kind in pair}
        if len(families) == 2 and "tendon_slack" not in pair and set(pair) != {"sensor_lag", "actuator_lag"}:
            entries.append(("two", [str(kind) for kind in pair], "strong"))
    for control in CONTROLS:
        entries += [(control, [], None)] * 10
    outside = rng.permutation(list(effects.OUTSIDE))
    entries += [("outside", [str(outside[i])], "strong") for i in range(7)]
    return entries[rng.permutation(ROUND)[position]]


def place_for(rng, kind, rig, taken):
    """A place for a kind on this rig, or None."""
    wheres = effects.EVERY[kind][1] if kind in effects.EVERY else [effects.OUTSIDE[kind]]
    found = [p for where in wheres for p in effects.sites(rig, where) if p not in taken]
    sensed = {k["reads"].rsplit(".", 1)[0] for k in rig.all("sensor")}
    bodies = rig.bodies()
    if kind in ("constant_load", "gravity_load") and len(sensed & set(bodies)) < len(bodies):
        # At rest a load looks the same wherever it hangs, unless every body is watched.
        return None
    if kind in ("actuator_lag", "sensor_lag") and is_linear(rig) and (len(sensed) < 2 or len(rig.all("actuator")) > 1):
        # One input, one output, all linear: a lag before and a lag behind are the same thing.
        return None
    # Mostly where a sensor is, now and then at a body that nobody watches.
    if found and found[0] in bodies and rng.uniform() < 0.8:
        found = [p for p in found if p in sensed] or found
    return str(rng.choice(found)) if found else None


def is_linear(rig):
    return not rig.all("gravity") and not any(k["unilateral"] for k in rig.all("tendon"))


def mechanism(rng, kinds):
    """A rig on which all these kinds have a place, and the places."""
    want = {kind for kind in kinds if kind in ("viscous_damping", "tendon_slack")}
    families = list(rigs.FAMILIES)
    if "tendon_slack" in kinds:
        families = ["tendon finger"]
    for _ in range(200):
        wanted = set(want)
        if "backlash" in kinds and rng.uniform() < 0.5:
            wanted.add("tendon_backlash")
        family = str(rng.choice(families))
        rig, setting = rigs.BUILDERS[family](rng, wanted)
        places = []
        for kind in kinds:
            place = place_for(rng, kind, rig, places)
            if place is None or any(p in place.split("+") or place in p.split("+") for p in places):
                break
            places.append(place)
        if len(places) == len(kinds):
            return family, rig, setting, places
    raise RuntimeError("no rig for %s" % kinds)


def times(rng, setting, samples, jitter):
    t = np.arange(samples) * setting.dt
    if jitter:
        t[1:] += setting.dt * rng.uniform(-0.2, 0.2, samples - 1)
    return np.round(t / setting.dt, 3) * float("%.6g" % setting.dt)


class Bench:
    """One rig with its true values, on which recordings are taken."""

    def __init__(self, rng, rig, setting, jitter, closed, lengths):
        self.rig, self.setting, self.values = rig, setting, rig.values()
        self.closed = closed
        self.drives = []
        for role in ROLES:
            samples = int(rng.integers(*lengths["fit" if role.startswith("fit") else "other"]))
            t = times(rng, setting, samples, jitter)
            u = np.zeros((samples, len(setting.low)))
            for a, (low, high) in enumerate(zip(setting.low, setting.high)):
                x = excitation.mixed(rng, t, setting.tau) * (0.25 if closed else rng.uniform(0.8, 1.0))
                u[:, a] = x * (high if low == -high else 0.5 * (high - low)) + (0.0 if low == -high else 0.5 * (high + low) * (x != 0.0))
                u[:, a] = np.array([float("%.6g" % v) for v in u[:, a]])
            reference = excitation.mixed(rng, t, 3.0 * setting.tau, ["steps", "slow", "triangle"]) * setting.reach
            self.drives.append((t, u, reference, rng.uniform(-1.0, 1.0)))

    def run(self, role, present, noise, quantum, disturbance, typ, tolerance=1e-8):
        """A recording as a dict, or None where the motion has no bounds."""
        t, u, reference, _ = self.drives[role]
        s, states = build(self.rig, self.values, present)
        n = len(self.rig.bodies())
        y = relaxed(s, states, np.zeros(n), np.zeros(n))
        w = motion.work(s, states, scales(s, states, typ, self.rig))
        sensors = len(s.sensors)
        idle = motion.Control(0.0, 0.0, np.zeros(1), 0, np.inf, 1.0)
        if not self.rig.integrates and not any(e["kind"] in REMEMBERS for e in present):
            # It has come to rest before the recording begins.
            wait = np.arange(40.0) * 2.0 * self.setting.tau
            still = np.zeros((40, max(s.n, sensors)))
            motion.record(s, y, wait, np.repeat(u[:1], 40, axis=0), still, still, np.zeros(sensors), idle, False, tolerance, w)
        start = y.copy()
        control = idle
        if self.closed:
            largest = self.setting.high[0]
            control = motion.Control(self.setting.kp, self.setting.kd, reference, self.setting.sensor, largest, 0.2)
        applied = u.copy()
        push = np.zeros((len(t), s.n))
        push[:, :disturbance.shape[1]] = disturbance[:len(t)]
        measured, clean, path = motion.record(s, y, t, applied, push, noise[:len(t)], quantum, control, False, tolerance, w)
        if not np.isfinite(path).all():
            return None
        return {"t": t, "u": applied, "measured": measured, "clean": clean, "states": path, "q0": start[:n], "v0": start[s.n:s.n + n], "typical": typ, "n": n, "all": s.n}


def baseline(bench, sensors):
    """How the rig moves without the effect."""
    noise = np.zeros((2000, sensors))
    typ = None
    for tolerance in (1e-5, 1e-8):
        run = bench.run(0, [], noise, np.zeros(sensors), np.zeros((2000, bench_bodies(bench))), typ, tolerance)
        if run is None:
            return None, None
        states = np.hstack([run["states"][:, :run["n"]], run["states"][:, run["all"]:run["all"] + run["n"]]])
        typ = effects.typical(bench.rig, bench.values, states, run["u"], run["t"], run["clean"])
    return typ, run


def bench_bodies(bench):
    return len(bench.rig.bodies())


def bounded(run, typ, rig):
    """No body went many times further than without the effect."""
    for i, name in enumerate(rig.bodies()):
        low, high = typ.position[name]
        if np.abs(run["states"][:, i] - 0.5 * (low + high)).max() > 6.0 * (high - low):
            return False
    return True


def seen(bench, recordings, sigma, present, category, strength):
    """Smallest part of the noise that a refit without one of the effects leaves, and without the simpler rival.

    Where all must be strong, the first that is not ends it: it is drawn anew, whatever it was. Other valleys are looked for
    where a miss would count as one, alone and strong; in pairs, with their many numbers, one case took more than twelve minutes."""
    amounts = []
    short = recordings[:1]
    enough = STRONG if strength == "strong" else visibility.HIDDEN
    starts = visibility.STARTS if category == "one" and strength == "strong" else 0
    for i in range(len(present)):
        others = [e for j, e in enumerate(present) if j != i]
        amounts.append(visibility.from_anywhere(bench.rig, bench.values, short, sigma, others, enough, starts))
        if strength == "strong" and amounts[-1] < STRONG:
            break
        kind = present[i]["kind"]
        if category == "one" and kind in SIMPLER and amounts[-1] >= STRONG:
            rival = SIMPLER[kind]
            if kind == "gravity_load" and bench.rig.component(present[i]["component"])["motion"] == "slide":
                continue
            p = present[i]["parameters"]
            size = p.get("level", p.get("level_pos", p.get("amplitude", 0.0)))
            if kind == "load_dependent_friction":
                size = p["coefficient"] * max(recordings[0]["typical"].force.values()) * 0.5
            if kind == "gravity_load":
                size = p["amplitude"] * np.sin(p["zero"])
            left = visibility.after_refit(bench.rig, bench.values, short, sigma,
                                          [{"kind": rival, "component": rival_place(bench.rig, present[i]["component"]), "parameters": {"level": size}}])
            # A third of the noise in a thousand samples is seen with certainty.
            amounts.append(left * 3.0)
    return amounts


def rival_place(rig, place):
    """The body where a simpler friction would sit."""
    tendons = {k["name"]: k["path"][0][0] for k in rig.all("tendon")}
    return tendons.get(place, place)


def make(seed, k, entry=None, lengths=LENGTHS):
    """Case k: files {name: text} and truth. entry: what it hides, where that is not by plan."""
    category, kinds, strength = entry or plan(seed, k)
    for retry in range(40):
        rng = np.random.default_rng([seed, 2, k, retry])
        if retry == 10 and strength == "weak":
            strength = "strong"  # A tendon's slack, for one, is seldom seen a little.
        made = attempt(rng, category, kinds, strength, lengths)
        if made is not None:
            files, truth = made
            return files, {"case": k, "seed": seed, "retries": retry, **truth}
    raise RuntimeError("case %d of seed %d (%s %s) cannot be made" % (k, seed, category, kinds))


def attempt(rng, category, kinds, strength, lengths):
    family, rig, setting, places = mechanism(rng, kinds)
    sensors = len(rig.all("sensor"))
    bodies = len(rig.bodies())
    jitter = bool(rng.uniform() < 0.08)
    closed = setting.kp != 0.0
    bench = Bench(rng, rig, setting, jitter, closed, lengths)
    typ, first = baseline(bench, sensors)
    if typ is None or not bounded(first, typ, rig):
        return None
    spread = first["clean"].std(axis=0)
    if (spread <= 0.0).any():
        return None
    level = rigs.spread(rng, 0.01, 0.05) if rng.uniform() < 0.7 else rigs.spread(rng, 0.001, 0.01)
    quantum = np.zeros(sensors)
    if category == "noise" and rng.uniform() < 0.5:
        level = rigs.spread(rng, 0.06, 0.2)
    elif category == "noise":
        quantum = spread * rng.uniform(0.05, 0.25)
        level = 0.003
    elif rng.uniform() < 0.3:
        quantum = level * spread * rng.uniform(0.3, 1.5, sensors)
    quantum = np.array([float("%.6g" % q) for q in quantum])
    sigma = level * spread
    noises = [rng.standard_normal((2000, sensors)) * sigma for _ in ROLES]
    pushes = [np.zeros((2000, bodies)) for _ in ROLES]
    if category == "disturbance":
        body = int(rng.integers(bodies))
        amount = rigs.spread(rng, 0.04, 0.25) * typ.force[rig.bodies()[body]]
        for role, (t, _, _, _) in enumerate(bench.drives):
            pushes[role][:len(t), body] = amount * excitation.disturbance(rng, t, setting.tau)

    present, amounts, recordings = [], [], None
    if kinds:
        power = 1.0 if strength == "strong" else 0.35
        state = rng.integers(2**32)
        for _ in range(9):
            again = np.random.default_rng(state)
            present = [{"kind": kind, "component": place, "parameters": effects.draw(again, kind, place, rig, typ, setting, power)} for kind, place in zip(kinds, places)]
            recordings = take(bench, present, noises, quantum, pushes, typ)
            if recordings is None or not all(bounded(r, typ, rig) for r in recordings):
                power *= 0.6
                recordings = None
                continue
            amounts = seen(bench, recordings, sigma, present, category, strength)
            least = min(amounts)
            if strength == "strong" and least < STRONG:
                power *= 1.5
            elif strength == "weak" and not WEAK[0] <= amounts[0] <= WEAK[1]:
                power *= np.clip((0.35 / max(amounts[0], 1e-3)) ** 0.7, 0.3, 1.8)
            else:
                break
        else:
            return None
    else:
        recordings = take(bench, present, noises, quantum, pushes, typ)
        if recordings is None:
            return None
    return written(rng, rig, setting, bench, recordings, category, kinds, strength, present,
                   {"family": family, "noise": level, "amounts": amounts, "closed_loop": closed, "jitter": jitter,
                    "quantised": bool((quantum > 0).any())})


def take(bench, present, noises, quantum, pushes, typ):
    recordings = []
    for role in range(len(ROLES)):
        run = bench.run(role, present, noises[role], quantum, pushes[role], typ)
        if run is None:
            return None
        recordings.append(run)
    return recordings


def written(rng, rig, setting, bench, recordings, category, kinds, strength, present, facts):
    """Files and truth."""
    believed, bounds = dict(bench.values), {}
    if category != "exact":
        off = 0.5 if category == "wrong parameters" else 0.15 if rng.uniform() < 0.7 else 0.0
        for name in rig.free:
            factor = np.exp(rng.uniform(-off, off))
            if category == "wrong parameters" and abs(np.log(factor)) < 0.15:
                factor = 1.3
            believed[name] *= factor
    if rng.uniform() < 0.3:
        bounds = {name: (believed[name] / 10.0, believed[name] * 10.0) for name in rig.free}
    if rng.uniform() < 0.3:
        for keys, high in zip(rig.all("actuator"), setting.high):
            keys["limit"] = [-high, high]
    gaps = bool(rng.uniform() < 0.15)
    files = {"rig.toml": rig.toml(believed, bounds)}
    columns = [k["input"] for k in rig.all("actuator")] + [k["signal"] for k in rig.all("sensor")]
    test_noise = {}
    for role, r in zip(ROLES, recordings):
        lost = rng.uniform(size=r["measured"].shape) < (0.02 if gaps else 0.0)
        if gaps:
            begin = int(rng.integers(len(lost) // 4, len(lost) // 2))
            lost[begin:begin + int(rng.integers(5, 40)), :] = True
        text = [",".join(["t", *columns])]
        for i in range(len(r["t"])):
            row = ["%.9g" % r["t"][i], *("%.7g" % v for v in r["u"][i])]
            row += ["" if lost[i, m] else "%.6g" % r["measured"][i, m] for m in range(lost.shape[1])]
            text.append(",".join(row))
        files[role + ".csv"] = "\n".join(text) + "\n"
        if role == "test":
            skip = max(20, int(np.ceil(0.05 * len(lost))))
            error = np.where(lost, np.nan, r["measured"] - r["clean"])[skip:]
            test_noise = {k["signal"]: float(np.sqrt(np.nanmean(error[:, m] ** 2))) for m, k in enumerate(rig.all("sensor"))}
    for e in present:
        e["family"] = effects.EVERY[e["kind"]][0] if e["kind"] in effects.EVERY else "outside"
        e["same_as"] = same_as(rig, e)
    truth = {"category": category, "rig": facts["family"], "strength": strength, "noise": facts["noise"], "visible": [float("%.3g" % min(a, BOUNDLESS)) for a in facts["amounts"]],
             "closed_loop": facts["closed_loop"], "jitter": facts["jitter"], "quantised": facts["quantised"], "missing": gaps, "effects": present,
             "parameters": {name: bench.values[name] for name in rig.free}, "true_model_test_rms": test_noise}
    return files, truth


def same_as(rig, e):
    """Other names of exactly the same thing: [kind, component]."""
    kind, place = e["kind"], e["component"]
    slide = place in rig.bodies() and rig.component(place)["motion"] == "slide"
    if kind == "gravity_load" and slide:
        return [["constant_load", place]]
    if kind == "constant_load" and slide:
        return [["gravity_load", place]]
    return []


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--cases", type=int, required=True)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--step", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--truth", type=Path, required=True)
    parser.add_argument("--quiet", action="store_true")
    arguments = parser.parse_args()
    arguments.truth.mkdir(parents=True, exist_ok=True)
    for k in range(arguments.first, arguments.cases, arguments.step):
        name = "case-%04d" % k
        told = arguments.truth / (name + ".json")
        if told.exists():
            continue
        begun = time.time()
        files, truth = make(arguments.seed, k)
        folder = arguments.out / name
        folder.mkdir(parents=True, exist_ok=True)
        for file, text in files.items():
            (folder / file).write_text(text)
        part = told.with_suffix(".part")
        part.write_text(json.dumps(truth, indent=1) + "\n")
        part.rename(told)
        if not arguments.quiet:
            # Nothing about what the case hides: whoever watches may be tuning the program under test.
            print("%s: %.1f s" % (name, time.time() - begun), file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
