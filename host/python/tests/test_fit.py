"""Fit, checks, simulation and experiments."""

import numpy as np
import pytest
from conftest import RIGS

import sinew_ident

CART = """format = "sinew-rig/1"
name = "cart"
[[body]]
name = "cart"
motion = "slide"
inertia = { value = 5.0 }
[[damper]]
name = "oil"
from = "ground"
to = "cart"
damping = 4.0
[[actuator]]
name = "motor"
drives = "cart"
input = "u_N"
gain = 1.0
limit = [-10.0, 10.0]
rate_limit = 200.0
[[sensor]]
name = "encoder"
reads = "cart.position"
signal = "q_mm"
unit = "mm"
"""


@pytest.fixture
def cart() -> sinew_ident.Rig:
    return sinew_ident.Rig.from_toml(CART)


def exact(t: np.ndarray, force: float, inertia: float, damping: float) -> np.ndarray:
    """Position of a damped cart under a constant force from rest, in closed form."""
    rate = damping / inertia
    return force / damping * (t - (1 - np.exp(-rate * t)) / rate)


def recording(inertia: float) -> dict[str, np.ndarray]:
    t = np.linspace(0, 4, 401)
    return {"t": t, "u_N": np.full_like(t, 2.0), "q_mm": 1e3 * exact(t, 2.0, inertia, 4.0)}


def test_a_simulation_is_the_closed_form_in_the_units_of_the_columns(cart):
    truth = recording(5.0)
    out = sinew_ident.simulate(cart, truth)
    assert list(out) == ["t", "q_mm"]
    np.testing.assert_allclose(out["q_mm"], truth["q_mm"], atol=1e-3)


def test_a_frame_comes_back_as_a_frame(cart):
    pandas = pytest.importorskip("pandas")
    truth = pandas.DataFrame(recording(5.0))
    out = sinew_ident.simulate(cart, truth)
    assert isinstance(out, pandas.DataFrame)
    by_index = sinew_ident.simulate(cart, truth.set_index("t"))
    np.testing.assert_array_equal(out["q_mm"], by_index["q_mm"])


def test_a_fit_finds_the_inertia_of_the_closed_form(cart):
    found = sinew_ident.fit(cart, recording(7.0), test={"other": recording(7.0)})
    inertia = found.parameters["cart.inertia"]
    assert inertia.as_written == 5.0
    assert inertia.value == pytest.approx(7.0, rel=1e-4)
    assert found.is_explained
    errors = found.errors["q_mm"]
    assert errors["test"]["fitted_rms"] < 1e-3 * errors["test"]["as_written_rms"]
    assert errors["test"]["fitted_percent"] > 99.8 > errors["test"]["as_written_percent"]
    assert " %</td>" in found._repr_html_()
    assert [run.recording for run in found.runs] == ["fit[0]", "other"]
    assert found.rig.parameters["cart.inertia"].value == inertia.value
    assert "cart.inertia" in found._repr_html_() and "q_mm" in found._repr_html_()
    assert sinew_ident.Rig.from_toml(found.rig.to_toml()).name == "cart"


def test_missing_samples_are_no_samples(cart):
    gaps = recording(7.0)
    mask = np.arange(401) % 7 == 3
    # What lies under a mask is no measurement.
    gaps["q_mm"] = np.ma.masked_array(np.where(mask, 1e6, gaps["q_mm"]), mask=mask)
    found = sinew_ident.fit(cart, gaps)
    assert found.parameters["cart.inertia"].value == pytest.approx(7.0, rel=1e-3)


def test_milliseconds_are_found(cart):
    in_ms = recording(5.0)
    in_ms["t"] = 1e3 * in_ms["t"]
    found = sinew_ident.check(in_ms, cart)
    assert "time_in_milliseconds" in [check["kind"] for check in found.checks]
    assert "time_in_milliseconds" in found._repr_html_()
    sound = sinew_ident.check(recording(5.0), cart)
    assert sound.is_sound and sound.determined["parameters"][0]["name"] == "cart.inertia"


def test_an_experiment_keeps_the_limits(cart):
    experiment = sinew_ident.excite(cart, "steps", seconds=5, rate=100)
    assert len(experiment["t"]) == 501 and experiment["t"][1] == pytest.approx(0.01)
    u = experiment["u_N"]
    assert np.abs(u).max() <= 10.0 and np.abs(np.diff(u)).max() <= 2.0
    assert np.ptp(u) > 5.0
    again = sinew_ident.excite(cart, "steps", seconds=5, rate=100, seed=2)
    assert not np.array_equal(again["u_N"], u)


def test_a_rig_tells_its_columns(cart):
    assert [i.column for i in cart.inputs] == ["u_N"]
    assert cart.inputs[0].limits == (-10.0, 10.0)
    assert [(s.column, s.name) for s in cart.sensors] == [("q_mm", "encoder")]
    assert cart.parameters["cart.inertia"].free
    assert not cart.parameters["oil.damping"].free
    assert "<mujoco" in cart.to_mjcf()
    assert repr(cart) == "<Rig cart: u_N -> q_mm>"


@pytest.mark.parametrize(
    ("work", "words"),
    [
        (lambda rig: sinew_ident.Rig.from_toml("absent.toml"), "absent.toml: cannot read the rig"),
        (lambda rig: sinew_ident.Rig.from_toml(CART.replace("inertia", "inertja")), "rig.toml:6:"),
        (lambda rig: sinew_ident.fit(rig, {"t": [0.0, 1.0]}), "u_N"),
        (lambda rig: sinew_ident.fit(rig, {"u_N": [0.0]}), "no column `t`"),
        (lambda rig: sinew_ident.fit(rig, {"t": [0, 1], "u_N": ["a", "b"]}), "not numeric"),
        (lambda rig: sinew_ident.fit(rig, {"t": [0, 0], "u_N": [1, 1]}), "does not increase"),
        (lambda rig: sinew_ident.fit(rig, "A.csv"), "pandas.read_csv"),
        (lambda rig: sinew_ident.excite(rig, "noise"), "kind must be"),
        (lambda rig: sinew_ident.excite(rig, amplitude=2.0), "--amplitude"),
        (lambda rig: sinew_ident.diagnose(rig, recording(5), time_limit=-1.0), "time_limit"),
    ],
)
def test_an_error_of_the_library_is_a_value_error(cart, work, words):
    with pytest.raises(ValueError) as error:
        work(cart)
    assert words in str(error.value), str(error.value)


def test_shipped_rigs_are_read():
    names = [path.stem for path in RIGS.glob("*.toml") if path.stem != "demo"]
    assert len(names) >= 6
    for name in names:
        assert sinew_ident.Rig.from_toml(RIGS / f"{name}.toml").parameters
