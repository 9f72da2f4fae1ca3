"""System identification of mechanical plants: fit, diagnosis of missing physics, experiments.

>>> import pandas, sinew_ident
>>> rig = sinew_ident.Rig.from_toml("rig.toml")
>>> found = sinew_ident.diagnose(rig, fit=pandas.read_csv("A.csv"))
>>> found.verdict
'missing_physics'
>>> open("corrected.xml", "w").write(found.corrected.to_mjcf())
"""

from sinew_ident._api import check, diagnose, excite, fit, simulate
from sinew_ident._native import __version__
from sinew_ident._results import (
    CheckResult,
    DiagnosisResult,
    Effect,
    Estimate,
    FitResult,
    FittedParameter,
    Run,
)
from sinew_ident._rig import Input, Parameter, Rig, Sensor

__all__ = [
    "CheckResult",
    "DiagnosisResult",
    "Effect",
    "Estimate",
    "FitResult",
    "FittedParameter",
    "Input",
    "Parameter",
    "Rig",
    "Run",
    "Sensor",
    "__version__",
    "check",
    "diagnose",
    "excite",
    "fit",
    "simulate",
]
