"""Small cases that are committed, so that tests need no Python: tests/foreign/cases and tests/foreign/truth.

    python -m hardlaw.committed

Thirty, stratified, with a seed of their own, of which `cargo xtask test` takes twelve; and twenty-six that the program once
missed or took for what they are not; and those of kinds that came later. `cargo xtask proof --committed` takes all, `cargo xtask ci` all but the eight longest.
"""

import json
import shutil
import sys
from pathlib import Path

from . import cases

SEED = 7
LENGTHS = {"fit": (560, 760), "other": (420, 560)}
FOLDER = Path(__file__).resolve().parents[1]
ENTRIES = [
    # The twelve.
    ("one", ["coulomb_friction"], "strong"),
    ("one", ["backlash"], "strong"),
    ("one", ["cubic_stiffness"], "strong"),
    ("one", ["hysteresis"], "strong"),
    ("one", ["input_delay"], "strong"),
    ("one", ["end_stop"], "strong"),
    ("two", ["coulomb_friction", "input_saturation"], "strong"),
    ("exact", [], None),
    ("wrong parameters", [], None),
    ("disturbance", [], None),
    ("noise", [], None),
    ("outside", ["one_sided_gain"], "strong"),
    # And eighteen more.
    ("one", ["stribeck_friction"], "strong"),
    ("one", ["direction_dependent_friction"], "strong"),
    ("one", ["load_dependent_friction"], "strong"),
    ("one", ["quadratic_drag"], "strong"),
    ("one", ["tendon_slack"], "strong"),
    ("one", ["viscoelastic_creep"], "strong"),
    ("one", ["position_ripple"], "strong"),
    ("one", ["hidden_mode"], "strong"),
    ("one", ["cross_coupling"], "strong"),
    ("one", ["input_dead_zone"], "strong"),
    ("one", ["sensor_curvature"], "strong"),
    ("one", ["viscous_damping"], "weak"),
    ("two", ["quadratic_stiffness", "input_curvature"], "strong"),
    ("exact", [], None),
    ("wrong parameters", [], None),
    ("disturbance", [], None),
    ("noise", [], None),
    ("outside", ["position_dependent_friction"], "strong"),
]
# Seed and number: a lag of one of two encoders, whose memory began each stretch of a recording with its first sample;
# two effects of which the best single one was neither; a play that is seen on short stretches only; a play in an actuator that
# stretches began in its middle; two controls in which something was named: a pendulum that turns over, from wrong parameters, and
# a disturbance under feedback; two controls whose refit ended in a valley of its own, a damping at zero and a pendulum that turns
# over, in which something of no size was named; dry friction whose own fit ended short of what a richer law of friction reached; a stop that
# is met once, for 25 rows; a disturbance that was called creep, with less confidence than any name deserves; a damping of a joint that was
# looked for in its spring; a damping by the root of speed that was called friction, though the free run over a whole recording got worse;
# friction in one joint beside a load on another, which hysteresis explained as well until a second effect was looked for; a weak hidden
# mode that was called friction by a richer name of a damping that had been refuted; dry friction that was called two effects, for its own
# fit had ended in a valley; a sine that pushes and was called a hidden mode; a ripple that was refused, for its free run ends in another well;
# friction that rises at rest beside a dead zone, where no half did any good on the check recordings; a softening spring that falls over
# without the load that it carries; a dead zone beside a hidden mode that followed more of short stretches than it hides; a disturbance
# that was called a mode, less surely than a mode must be; a creep that was refuted by a free run, for the first rows do not show where its
# memory starts; a play with a friction beside it, which was the force that the plant had begun with; a rig that is right as it is, whose
# refit on longer stretches had ended with its two inertias exchanged, where a damping was named; a creep beside which a mode was
# named of which nobody knew how heavy it is.
MISSED = [(2029, 145), (2029, 218), (2029, 667), (2030, 55), (2030, 545), (2030, 591), (4001, 169), (4001, 481), (2030, 361),
          (2031, 4), (2031, 374), (2033, 135), (2033, 558), (2033, 310), (2033, 670),
          (2034, 365), (2034, 495), (2034, 641), (2034, 488), (2034, 580), (2034, 604),
          (2035, 402), (2035, 582), (2035, 442),
          (2036, 428), (2037, 381)]

# Seed, number and entry of kinds that came after the published tables.
LATER = [(seed, number, ("one", ["presliding_friction"], "strong")) for seed, number in ((7, 57), (11, 0), (11, 2))]
LATER += [(21, number, ("one", ["plastic_set"], "strong")) for number in (1, 3)]


def main():
    for name in ("cases", "truth"):
        shutil.rmtree(FOLDER / name, ignore_errors=True)
    (FOLDER / "truth").mkdir()
    made = [cases.make(SEED, k, entry, LENGTHS) for k, entry in enumerate(ENTRIES)]
    made += [cases.make(seed, number) for seed, number in MISSED]
    made += [cases.make(seed, number, entry, LENGTHS) for seed, number, entry in LATER]
    for k, (files, truth) in enumerate(made):
        folder = FOLDER / "cases" / ("case-%02d" % k)
        folder.mkdir(parents=True)
        for file, text in files.items():
            (folder / file).write_text(text)
        (FOLDER / "truth" / ("case-%02d.json" % k)).write_text(json.dumps(truth, indent=1) + "\n")
        print("case-%02d: %d bytes" % (k, sum(len(text) for text in files.values())), file=sys.stderr)


if __name__ == "__main__":
    main()
