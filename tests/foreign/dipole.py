"""Fields of magnetic dipoles as magpylib computes them: moment (A m^2), place (m), field (T).

Writes the table that `sim/src/geometry/dipole.rs` is tested against:

    pip install magpylib==6.1.0
    python tests/foreign/dipole.py > sim/src/geometry/dipole.magpylib.rs
"""

import magpylib
import numpy

CASES = [
    ((0.0, 0.0, 0.5), (0.0, 0.0, 0.02)),
    ((0.0, 0.0, 0.5), (0.02, 0.0, 0.0)),
    ((0.0, 0.0, 0.126), (0.004, -0.003, -0.018)),
    ((0.1, -0.2, 0.3), (0.011, 0.007, -0.013)),
    ((-0.02, 0.05, 0.01), (-0.03, 0.04, 0.05)),
    ((0.7, 0.0, -0.1), (0.001, 0.002, 0.003)),
]


def row(vector):
    return "[" + ", ".join(repr(float(x)) for x in vector) + "]"


print("[")
for moment, place in CASES:
    field = magpylib.misc.Dipole(moment=moment).getB(numpy.array(place))
    print(f"    [\n        {row(moment)},\n        {row(place)},\n        {row(field)},\n    ],")
print("]")
