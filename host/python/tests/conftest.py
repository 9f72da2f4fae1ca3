"""Recordings and rigs that ship with the project."""

from pathlib import Path

import pandas
import pytest

import sinew_ident

RIGS = Path(__file__).resolve().parents[3] / "rigs"


def frame(name: str) -> pandas.DataFrame:
    """A shipped recording."""
    return pandas.read_csv(RIGS / name, comment="#")


@pytest.fixture(scope="session")
def rig() -> sinew_ident.Rig:
    """A mass on a spring, without the friction that its recordings hold."""
    return sinew_ident.Rig.from_toml(RIGS / "mass-spring-damper.toml")


@pytest.fixture(scope="session")
def fit_frame() -> pandas.DataFrame:
    return frame("mass-spring-damper.fit.csv")


@pytest.fixture(scope="session")
def test_frame() -> pandas.DataFrame:
    return frame("mass-spring-damper.test.csv")


@pytest.fixture(scope="session")
def found(rig, fit_frame, test_frame) -> sinew_ident.DiagnosisResult:
    return sinew_ident.diagnose(rig, fit=fit_frame, test=test_frame)
