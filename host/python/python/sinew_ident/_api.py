"""Functions of the package."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np

from sinew_ident import _native
from sinew_ident._data import TIME, from_bytes, like, raw, raw_list
from sinew_ident._results import CheckResult, DiagnosisResult, FitResult, runs
from sinew_ident._rig import Rig

Progress = Callable[[str, int, int], object]


def fit(
    rig: Rig,
    fit: Any,
    test: Any = None,
    *,
    progress: Progress | None = None,
) -> FitResult:
    """Fit the free parameters of a plant model to recordings.

    Output-error fit by multiple shooting: the simulation sees inputs only.

    Parameters
    ----------
    rig : Rig
        Plant model; its values are the start.
    fit : dict of arrays, DataFrame, list or dict of them
        Recordings that estimate parameters. ``t`` is in seconds and increases; the other
        columns are those of the rig. NaN is a missing sample.
    test : optional
        Recordings that are only scored.
    progress : callable, optional
        Called with (what, done, of) at most every 50 ms; ``of`` is 0 where nobody knows it.

    Returns
    -------
    FitResult
        Parameters with 95 % intervals, errors, the refitted rig.

    Raises
    ------
    ValueError
        A recording or the rig cannot be used, or a recording is certainly wrong.
    KeyboardInterrupt
        Ctrl-C; the computation ends.
    """
    fitted, tests = raw_list(fit, "fit"), raw_list(test, "test")
    document, refitted, raw_runs = _native.fit(rig._native, fitted, tests, progress)
    return FitResult(json.loads(document), Rig(refitted), runs(raw_runs))


def check(recordings: Any, rig: Rig | None = None) -> CheckResult:
    """Find faults of recordings before any fit.

    Parameters
    ----------
    recordings : dict of arrays, DataFrame, list or dict of them
        Recordings.
    rig : Rig, optional
        Plant model whose inputs and sensors are checked. With a small one the result lists
        the parameters and effects that the recordings determine.

    Returns
    -------
    CheckResult
        Faults with line, sentence and remedy.
    """
    native = None if rig is None else rig._native
    return CheckResult(json.loads(_native.check(raw_list(recordings, "recording"), native)))


def diagnose(
    rig: Rig,
    fit: Any,
    check: Any = None,
    test: Any = None,
    *,
    seed: int = 1,
    time_limit: float | None = None,
    progress: Progress | None = None,
) -> DiagnosisResult:
    """Find the physics that a plant model lacks.

    Parameters
    ----------
    rig : Rig
        Plant model that is believed.
    fit : dict of arrays, DataFrame, list or dict of them
        Recordings that estimate parameters.
    check : optional
        Recordings that decide between explanations; without them part of `fit` is set aside.
    test : optional
        Recordings that are only scored, once, at the end.
    seed : int
        Seed of the resampling. The same seed gives the same answer.
    time_limit : float, optional
        Seconds after which the best so far is judged.
    progress : callable, optional
        Called with (what, done, of) at most every 50 ms.

    Returns
    -------
    DiagnosisResult
        Verdict, effects with parameters and confidence, the corrected rig.

    Raises
    ------
    ValueError
        A recording is certainly wrong, or a recording or the rig cannot be used.
    KeyboardInterrupt
        Ctrl-C; the computation ends.
    """
    roles = [raw_list(fit, "fit"), raw_list(check, "check"), raw_list(test, "test")]
    answer = _native.diagnose(rig._native, *roles, seed, time_limit, progress)
    document, text, page, refitted, corrected, raw_runs = answer
    return DiagnosisResult(
        json.loads(document), text, page, Rig(refitted), Rig(corrected), runs(raw_runs)
    )


def simulate(rig: Rig, recording: Any) -> Any:
    """Drive a plant model with the input columns of a recording.

    A body with a position sensor starts at the first valid sample of that sensor, every other
    body at zero; velocities are zero.

    Parameters
    ----------
    rig : Rig
        Plant model, its effects included.
    recording : dict of arrays or DataFrame
        ``t`` and every input column of the rig; sensor columns are optional.

    Returns
    -------
    dict of ndarray, or DataFrame where `recording` is one
        ``t`` and a column a sensor.
    """
    given = raw(recording, "recording")
    columns = {TIME: from_bytes(given[1])}
    for name, values in _native.simulate(rig._native, given):
        columns[name] = from_bytes(values)
    return like(recording, columns)


def excite(
    rig: Rig,
    kind: str = "mixed",
    *,
    seconds: float = 30.0,
    rate: float = 120.0,
    seed: int = 1,
    amplitude: float = 0.8,
    band: tuple[float, float] | None = None,
) -> dict[str, np.ndarray]:
    """Design an experiment within the limits of a plant model.

    Parameters
    ----------
    rig : Rig
        Plant model; ``limit`` and ``rate_limit`` of its actuators are kept.
    kind : {'mixed', 'multisine', 'steps', 'triangle', 'chirp'}
        Shape of the inputs.
    seconds : float
        Duration, s.
    rate : float
        Samples a second, Hz.
    seed : int
        Seed of everything that is drawn.
    amplitude : float
        Fraction of each input's range that is used, in (0, 1].
    band : (float, float), optional
        Lowest and highest frequency of sines, Hz.

    Returns
    -------
    dict of ndarray
        ``t`` in seconds and a column an input.
    """
    edges = None if band is None else [float(band[0]), float(band[1])]
    t, columns = _native.excite(rig._native, kind, seconds, rate, seed, amplitude, edges)
    return {TIME: from_bytes(t), **{name: from_bytes(values) for name, values in columns}}
