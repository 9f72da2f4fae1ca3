"""Results as objects."""

from __future__ import annotations

import copy
import html
from dataclasses import dataclass
from typing import Any

import numpy as np

from sinew_ident._data import from_bytes
from sinew_ident._rig import Rig


@dataclass(frozen=True)
class Estimate:
    """A number, SI, with its 95 % interval; None where the data do not determine it."""

    value: float
    unit: str
    ci95: tuple[float, float] | None

    @classmethod
    def _of(cls, raw: dict[str, Any]) -> Estimate:
        return cls(raw["value"], raw["unit"], _interval(raw["ci95"]))


@dataclass(frozen=True)
class FittedParameter(Estimate):
    """A parameter after a fit."""

    as_written: float
    at_bound: bool


@dataclass(frozen=True)
class Effect:
    """Physics that a plant model lacks."""

    kind: str
    component: str
    equation: str
    sentence: str
    parameters: dict[str, Estimate]
    confidence: float
    share: float | None
    rivals: list[tuple[str, str, float]]
    indistinguishable_from: list[tuple[str, str, float]]


@dataclass(frozen=True)
class Run:
    """Free runs over one recording, SI: what was measured, and two simulations of it.

    ``before`` is the rig as written in a fit and the refitted rig in a diagnosis; ``after`` is
    the refitted rig in a fit and the corrected rig in a diagnosis.
    """

    recording: str
    role: str
    t: np.ndarray
    judged_from: int
    units: dict[str, str]
    measured: dict[str, np.ndarray]
    before: dict[str, np.ndarray]
    after: dict[str, np.ndarray]


def _interval(raw: list[float] | None) -> tuple[float, float] | None:
    return None if raw is None else (raw[0], raw[1])


def runs(raw: list[Any]) -> list[Run]:
    """Free runs of the library."""
    found = []
    for role, (name, judged_from, t, before), (_, _, _, after) in raw:
        found.append(
            Run(
                recording=name,
                role=role,
                t=from_bytes(t),
                judged_from=judged_from,
                units={signal: unit for signal, unit, _, _ in before},
                measured={signal: from_bytes(measured) for signal, _, measured, _ in before},
                before={signal: from_bytes(values) for signal, _, _, values in before},
                after={signal: from_bytes(values) for signal, _, _, values in after},
            )
        )
    return found


def _draw(all_runs: list[Run], labels: tuple[str, str], axes: Any) -> Any:
    """Draws measured and simulated signals, a row a recording and signal."""
    import matplotlib.pyplot as plt

    rows = [(run, signal) for run in all_runs for signal in run.measured]
    if axes is None:
        size = (9.0, 2.4 * len(rows))
        _, axes = plt.subplots(len(rows), 1, squeeze=False, figsize=size, layout="constrained")
    axes = np.atleast_1d(np.asarray(axes, dtype=object)).ravel()
    if len(axes) != len(rows):
        raise ValueError(f"axes must have {len(rows)} entries, one a signal; got {len(axes)}")
    for axis, (run, signal) in zip(axes, rows):
        axis.plot(run.t, run.measured[signal], ".", color="0.6", markersize=2, label="measured")
        axis.plot(run.t, run.before[signal], color="C1", linewidth=1, label=labels[0])
        axis.plot(run.t, run.after[signal], color="C0", linewidth=1, label=labels[1])
        axis.set_title(f"{run.recording} ({run.role})", loc="left", fontsize="medium")
        axis.set_xlabel("t (s)")
        axis.set_ylabel(f"{signal} ({run.units[signal]})")
        axis.legend(loc="upper right", fontsize="small")
    return axes


def _table(titles: list[str], rows: list[list[str]]) -> str:
    head = "".join(f"<th>{html.escape(title)}</th>" for title in titles)
    cells = ["".join(f"<td>{html.escape(cell)}</td>" for cell in row) for row in rows]
    body = "".join(f"<tr>{row}</tr>" for row in cells)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _between(ci95: tuple[float, float] | None) -> str:
    return "not determined" if ci95 is None else f"{ci95[0]:.4g} to {ci95[1]:.4g}"


class _Document:
    """A result that the library gave as JSON."""

    def __init__(self, document: dict[str, Any]) -> None:
        self._document = document

    def to_dict(self) -> dict[str, Any]:
        """The result as of ``--json`` of the command line (docs/reference/schemas)."""
        return copy.deepcopy(self._document)


class FitResult(_Document):
    """Result of :func:`sinew_ident.fit`.

    Attributes
    ----------
    rig : Rig
        The rig with the fitted values.
    parameters : dict of FittedParameter
        By full name.
    errors : dict
        Of each signal: ``as_written_rms`` and ``fitted_rms`` of ``fit`` and ``test``, SI, and
        ``as_written_percent`` and ``fitted_percent``, the fit in per cent (NRMSE).
    warnings : list of str
        What to look at before the numbers are used.
    checks : list of dict
        Likely faults of the recordings, as of :func:`sinew_ident.check`.
    runs : list of Run
        Measured and simulated signals of every recording.
    """

    def __init__(self, document: dict[str, Any], rig: Rig, all_runs: list[Run]) -> None:
        super().__init__(document)
        self.rig = rig
        self.runs = all_runs
        self.parameters = {
            name: FittedParameter(
                value=raw["value"],
                unit=raw["unit"],
                ci95=_interval(raw["ci95"]),
                as_written=raw["as_written"],
                at_bound=raw["at_bound"],
            )
            for name, raw in document["parameters"].items()
        }
        self.errors: dict[str, Any] = copy.deepcopy(document["signals"])
        self.warnings: list[str] = list(document["warnings"])
        self.checks: list[dict[str, Any]] = copy.deepcopy(document["checks"])

    @property
    def is_explained(self) -> bool:
        """True where the refitted rig explains every signal."""
        return all(signal["explained"] for signal in self.errors.values())

    def plot(self, axes: Any = None) -> Any:
        """Draw measured and simulated signals; returns the axes. Needs matplotlib."""
        return _draw(self.runs, ("as written", "refitted"), axes)

    def __repr__(self) -> str:
        values = [f"{n} {p.value:.4g} {p.unit}" for n, p in self.parameters.items()]
        return f"<FitResult: {', '.join(values)}>"

    def _repr_html_(self) -> str:
        rows = [
            [n, f"{p.as_written:.4g}", f"{p.value:.4g}", _between(p.ci95), p.unit]
            for n, p in self.parameters.items()
        ]
        errors = []
        for signal, raw in self.errors.items():
            for role in ("fit", "test"):
                if raw[role] is not None:
                    numbers = [raw[role]["as_written_rms"], raw[role]["fitted_rms"]]
                    percent = raw[role]["fitted_percent"]
                    fit = "" if percent is None else f"{percent:.1f} %"
                    errors.append([signal, role, *map(_number, numbers), raw["unit"], fit])
        titles = ["parameter", "as written", "fitted", "95 %", "unit"]
        of_errors = ["signal", "role", "RMS as written", "RMS refitted", "unit", "fit"]
        notes = "".join(f"<p>warning: {html.escape(note)}</p>" for note in self.warnings)
        return _table(titles, rows) + _table(of_errors, errors) + notes


class CheckResult(_Document):
    """Result of :func:`sinew_ident.check`.

    Attributes
    ----------
    checks : list of dict
        Faults with ``file``, ``line``, ``kind``, ``certain``, ``sentence`` and ``remedy``. Lines
        are those of a CSV file with one header line.
    determined : dict or None
        Parameters and effects that the recordings determine, with a small rig.
    """

    def __init__(self, document: dict[str, Any]) -> None:
        super().__init__(document)
        self.checks: list[dict[str, Any]] = copy.deepcopy(document["checks"])
        self.determined: dict[str, Any] | None = copy.deepcopy(document["determined"])

    @property
    def is_sound(self) -> bool:
        """True where nothing is certainly wrong."""
        return not any(check["certain"] for check in self.checks)

    def __repr__(self) -> str:
        kinds = ", ".join(check["kind"] for check in self.checks)
        return f"<CheckResult: {kinds or 'no fault found'}>"

    def _repr_html_(self) -> str:
        titles = ["recording", "line", "fault", "certain", "sentence", "remedy"]
        keys = ["file", "line", "kind", "certain", "sentence", "remedy"]
        return _table(titles, [[str(check[key]) for key in keys] for check in self.checks])


class DiagnosisResult(_Document):
    """Result of :func:`sinew_ident.diagnose`.

    Attributes
    ----------
    verdict : str
        ``consistent``, ``parameters``, ``missing_physics`` or ``unexplained``.
    sentence : str
        The finding in a sentence.
    complete : bool
        True where nothing but noise is left.
    effects : list of Effect
        Missing physics, most important first.
    parameters : dict of Estimate
        Free parameters of the rig.
    errors : dict
        Of each signal: free-run errors by role, and the noise, SI.
    next_experiment : str
        What to record next.
    notes : list of str
        What to know before the numbers are used.
    refitted, corrected : Rig
        The rig with its parameters refitted; the same with the effects in it.
    runs : list of Run
        Measured and simulated signals of every recording.
    """

    def __init__(
        self,
        document: dict[str, Any],
        text: str,
        page: str,
        refitted: Rig,
        corrected: Rig,
        all_runs: list[Run],
    ) -> None:
        super().__init__(document)
        self._text = text
        self._page = page
        self.refitted = refitted
        self.corrected = corrected
        self.runs = all_runs
        self.verdict: str = document["verdict"]
        self.sentence: str = document["sentence"]
        self.complete: bool = document["complete"]
        self.next_experiment: str = document["next_experiment"]
        self.notes: list[str] = list(document["notes"])
        self.errors: dict[str, Any] = copy.deepcopy(document["fit"])
        self.parameters = {n: Estimate._of(raw) for n, raw in document["parameters"].items()}
        self.effects = [_effect(raw) for raw in document["effects"]]

    def report(self) -> str:
        """The page of ``--report``: one HTML file that loads nothing."""
        return self._page

    def plot(self, axes: Any = None) -> Any:
        """Draw measured and simulated signals; returns the axes. Needs matplotlib."""
        return _draw(self.runs, ("refitted", "corrected"), axes)

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        named = [f"{e.kind} at {e.component} ({e.confidence:.0%})" for e in self.effects]
        return f"<DiagnosisResult: {', '.join([self.verdict, *named])}>"

    def _repr_html_(self) -> str:
        page = html.escape(self._page, quote=True)
        return f'<iframe srcdoc="{page}" width="100%" height="640" style="border:0"></iframe>'


def _effect(raw: dict[str, Any]) -> Effect:
    def others(key: str) -> list[tuple[str, str, float]]:
        return [(r["kind"], r["component"], r["confidence"]) for r in raw[key]]

    return Effect(
        kind=raw["kind"],
        component=raw["component"],
        equation=raw["equation"],
        sentence=raw["sentence"],
        parameters={n: Estimate._of(p) for n, p in raw["parameters"].items()},
        confidence=raw["confidence"],
        share=raw["share"],
        rivals=others("rivals"),
        indistinguishable_from=others("indistinguishable_from"),
    )
