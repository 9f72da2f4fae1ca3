"""Recordings between Python and the library."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

TIME = "t"


def to_bytes(values: Any, name: str, column: str) -> bytes:
    """Bytes of a column of doubles; masked and missing samples become NaN."""
    try:
        array = np.ma.filled(np.ma.asarray(values, dtype=np.float64), np.nan)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: column `{column}` is not numeric: {error}") from None
    if array.ndim != 1:
        raise ValueError(f"{name}: column `{column}` must have one dimension; got {array.ndim}")
    return np.ascontiguousarray(array, dtype="<f8").tobytes()


def from_bytes(data: bytes) -> np.ndarray:
    """A column that owns its memory."""
    return np.frombuffer(data, dtype="<f8").astype(np.float64)


def _columns(recording: Any, name: str) -> dict[str, Any]:
    if isinstance(recording, (str, os.PathLike)):
        raise ValueError(
            f"{name}: a recording is a dict of arrays or a DataFrame, not a path\n"
            f"  help: pandas.read_csv({os.fspath(recording)!r}, comment='#')"
        )
    if isinstance(recording, Mapping):
        return dict(recording)
    if hasattr(recording, "columns") and hasattr(recording, "index"):
        columns = {str(column): recording[column].to_numpy() for column in recording.columns}
        if TIME not in columns and recording.index.name == TIME:
            columns = {TIME: recording.index.to_numpy(), **columns}
        return columns
    if isinstance(recording, np.ndarray) and recording.dtype.names:
        return {column: recording[column] for column in recording.dtype.names}
    kind = type(recording).__name__
    raise ValueError(f"{name}: a recording is a dict of arrays or a DataFrame; got {kind}")


def raw(recording: Any, name: str) -> tuple[str, bytes, list[tuple[str, bytes]]]:
    """One recording as the library takes it."""
    columns = _columns(recording, name)
    if TIME not in columns:
        known = ", ".join(columns)
        raise ValueError(f"{name}: no column `{TIME}`\n  expected: `{TIME}` in seconds beside {known}")
    t = columns.pop(TIME)
    data = [(column, to_bytes(values, name, column)) for column, values in columns.items()]
    return name, to_bytes(t, name, TIME), data


def raw_list(recordings: Any, role: str) -> list[tuple[str, bytes, list[tuple[str, bytes]]]]:
    """The recordings of one role: none, one, a list, or a dict of names."""
    if recordings is None:
        return []
    if isinstance(recordings, Mapping) and not _is_recording(recordings):
        return [raw(recording, str(name)) for name, recording in recordings.items()]
    if not isinstance(recordings, (list, tuple)):
        return [raw(recordings, f"{role}[0]")]
    return [raw(recording, f"{role}[{k}]") for k, recording in enumerate(recordings)]


def _is_recording(mapping: Mapping[Any, Any]) -> bool:
    """A dict of columns, as opposed to a dict of recordings."""
    values = list(mapping.values())
    nested = [isinstance(v, Mapping) or hasattr(v, "columns") for v in values]
    return not (values and all(nested))


def like(example: Any, columns: dict[str, np.ndarray]) -> Any:
    """Columns in the form of an example: a DataFrame for a DataFrame, a dict for all else."""
    if hasattr(example, "columns") and hasattr(example, "index"):
        return type(example)(columns)
    return columns
