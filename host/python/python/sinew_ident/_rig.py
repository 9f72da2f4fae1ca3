"""Plant models."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sinew_ident import _native


@dataclass(frozen=True)
class Parameter:
    """A number of a plant model, SI."""

    value: float
    unit: str
    free: bool


@dataclass(frozen=True)
class Input:
    """A column that drives the plant; limits in SI."""

    column: str
    actuator: str
    limits: tuple[float, float] | None


@dataclass(frozen=True)
class Sensor:
    """A column that the plant writes."""

    column: str
    name: str
    unit: str


class Rig:
    """Plant model of a device.

    Make one with :meth:`from_toml`, :meth:`from_mjcf` or :meth:`from_urdf`. It does not change: a
    fit returns another.

    Attributes
    ----------
    left_out : list of str
        Parts of a mechanism's file that the rig does not say, with their place.
    added : list of str
        Things that the file does not say and the rig needs.
    """

    def __init__(self, native: Any, left_out: Sequence[str] = (), added: Sequence[str] = ()) -> None:
        self._native = native
        self.left_out = list(left_out)
        self.added = list(added)

    @classmethod
    def from_toml(cls, source: str | os.PathLike[str]) -> Rig:
        """Read a rig file.

        Parameters
        ----------
        source : str or path
            Path of the file, or its text if there is a line break in it.

        Raises
        ------
        ValueError
            The file cannot be read or used. The text names line, expectation and likely fix.
        """
        if isinstance(source, str) and "\n" in source:
            return cls(_native.NativeRig.parse(source, "rig.toml"))
        return cls(_native.NativeRig.load(os.fspath(source)))

    @classmethod
    def from_mjcf(cls, path: str | os.PathLike[str], joints: str | Sequence[str] = ()) -> Rig:
        """Read the hinges and slides of a MuJoCo model.

        Parameters
        ----------
        path : str or path
            Path of the file. Files that it includes are read beside it.
        joints : str or sequence of str, optional
            Joints that move; the others are held. All of them by default.

        Raises
        ------
        ValueError
            The file cannot be read, or its joints move each other: a rig has no such terms.
        """
        return cls._of_mechanism(path, "mjcf", joints)

    @classmethod
    def from_urdf(cls, path: str | os.PathLike[str], joints: str | Sequence[str] = ()) -> Rig:
        """Read the joints of a URDF file; parameters and errors as :meth:`from_mjcf`."""
        return cls._of_mechanism(path, "urdf", joints)

    @classmethod
    def _of_mechanism(
        cls, path: str | os.PathLike[str], format: str, joints: str | Sequence[str]
    ) -> Rig:
        chosen = [joints] if isinstance(joints, str) else list(joints)
        return cls(*_native.NativeRig.of_mechanism(os.fspath(path), format, chosen))

    @property
    def name(self) -> str:
        """Name in the file."""
        return self._native.name

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Every parameter by its full name, such as ``mass.inertia``."""
        return {n: Parameter(v, u, free) for n, v, u, free in self._native.parameters()}

    @property
    def inputs(self) -> list[Input]:
        """Columns that a recording needs to drive the plant."""
        return [Input(*raw) for raw in self._native.inputs()]

    @property
    def sensors(self) -> list[Sensor]:
        """Columns that the plant writes."""
        return [Sensor(*raw) for raw in self._native.sensors()]

    @property
    def effects(self) -> list[tuple[str, str]]:
        """Effects in the file: kind and component."""
        return self._native.effects()

    def to_toml(self) -> str:
        """Text of the rig file, comments kept."""
        return self._native.to_toml()

    def to_mjcf(self) -> str:
        """Text of a MuJoCo model; comments in it name what MuJoCo cannot represent."""
        return self._native.to_mjcf()[0]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the rig file."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.to_toml())

    def __repr__(self) -> str:
        columns = [*(i.column for i in self.inputs), "->", *(s.column for s in self.sensors)]
        effects = "".join(f", {kind} at {place}" for kind, place in self.effects)
        return f"<Rig {self.name}: {' '.join(columns)}{effects}>"
