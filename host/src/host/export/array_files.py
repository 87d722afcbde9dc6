"""MAT (version 5) and NPZ: whole columns, so the table is held in memory until it is closed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.errors import UsageError
from host.export.writer import Columns, Meta

_MAT_LIMIT_BYTES = (1 << 31) - 1  # of one variable in MAT version 5
_MAT_NAME = 31  # characters of a field name that MATLAB keeps in version 5 files


class _Collected:
    def __init__(self, path: Path, meta: Meta) -> None:
        self._path = path
        self._meta = meta
        self._parts: dict[str, list[NDArray[Any]]] = {}

    def write(self, columns: Columns) -> None:
        """Append rows."""
        for name, value in columns.items():
            self._parts.setdefault(name, []).append(value)

    def _whole(self) -> dict[str, NDArray[Any]]:
        # One column at a time: the pieces of the others are all that is held twice.
        names = list(self._parts)
        return {name: np.concatenate(self._parts.pop(name)) for name in names}


def _distinct(names: list[str], reserved: tuple[str, ...], longest: int) -> dict[str, str]:
    """Return a name for each column that no other and no part of the format has."""
    taken = set(reserved)
    out: dict[str, str] = {}
    for name in names:
        short, number = name[:longest], 1
        while short in taken:
            number += 1
            short = f"{name[: longest - 4]}_{number}"
        taken.add(short)
        out[name] = short
    return out


class MatWriter(_Collected):
    """MATLAB file: one column vector per column, structs `units`, `meaning` and `notes`."""

    def close(self) -> None:
        """Finish the file."""
        from scipy.io import savemat

        columns = self._whole()
        for name, value in columns.items():
            if value.nbytes > _MAT_LIMIT_BYTES:
                raise UsageError(
                    f"column {name} has {value.nbytes} bytes; MAT version 5 holds"
                    f" {_MAT_LIMIT_BYTES}: use --to parquet, or one --session"
                )
        names = _distinct(list(columns), ("units", "meaning", "notes"), _MAT_NAME)
        content: dict[str, Any] = {names[name]: value for name, value in columns.items()}
        content["units"] = {names[name]: self._meta.units.get(name, "") for name in columns}
        content["meaning"] = {names[name]: self._meta.texts.get(name, "") for name in columns}
        content["notes"] = dict(self._meta.notes)
        with self._path.open("wb") as file:  # savemat hides why it could not open a name
            savemat(file, content, oned_as="column")  # type: ignore[arg-type]  # it takes files


class NpzWriter(_Collected):
    """NumPy archive: one array per column, `units` and `notes` as pairs of text."""

    def close(self) -> None:
        """Finish the file."""
        columns = self._whole()
        pairs = [(name, self._meta.units.get(name, "")) for name in columns]
        notes = list(self._meta.notes.items())
        # The first three are arguments of numpy's own.
        names = _distinct(list(columns), ("file", "args", "allow_pickle", "units", "notes"), 200)
        content: dict[str, Any] = {names[name]: value for name, value in columns.items()}
        content["units"] = np.array(pairs, dtype=str).reshape(-1, 2)
        content["notes"] = np.array(notes, dtype=str).reshape(-1, 2)
        np.savez(self._path, **content)
