"""Diagnosis: the friction that the shipped recordings hold."""

import json

import numpy as np
import pytest
from conftest import RIGS

import sinew_ident


def test_the_friction_is_named_with_its_level(found):
    truth = json.loads((RIGS / "mass-spring-damper.truth.json").read_text())
    assert found.verdict == "missing_physics"
    [effect] = found.effects
    assert (effect.kind, effect.component) == ("coulomb_friction", "mass")
    level = effect.parameters["level"]
    low, high = level.ci95
    assert low < level.value < high and level.unit == "N"
    hidden = truth["effects"][0]["parameters"]["level"]
    assert level.value == pytest.approx(hidden, rel=0.05)
    assert 0.9 < effect.confidence <= 1.0


def test_the_corrected_rig_explains_the_test_recording(found):
    errors = found.errors["q_m"]["test"]
    assert errors["after_rms"] < 0.1 * errors["before_rms"]
    [run] = [run for run in found.runs if run.role == "test"]
    residual = (run.measured["q_m"] - run.after["q_m"])[run.judged_from :]
    assert np.sqrt(np.nanmean(residual**2)) == pytest.approx(errors["after_rms"], rel=1e-6)
    assert found.corrected.effects == [("coulomb_friction", "mass")]
    assert found.refitted.effects == []


def test_the_result_is_the_document_of_the_command_line(found):
    document = found.to_dict()
    assert document["format"] == "sinew-diagnosis/1"
    document["effects"].clear()
    assert found.to_dict()["effects"], "a copy was changed"


def test_it_shows_itself_in_a_notebook(found):
    page = found._repr_html_()
    assert page.startswith("<iframe") and "coulomb_friction" in page
    assert "coulomb_friction at mass" in repr(found)
    assert "missing" in str(found)


def test_it_draws_every_signal(found):
    import matplotlib

    matplotlib.use("Agg")
    axes = found.plot()
    assert len(axes) == len(found.runs)
    assert [len(axis.lines) for axis in axes] == [3] * len(axes)
    assert axes[0].get_ylabel() == "q_m (m)"
