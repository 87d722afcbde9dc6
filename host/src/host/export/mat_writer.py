"""MAT files: structures of arrays, texts and cell arrays, under names that MATLAB takes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from host.export.atomic_files import atomic_write

LONGEST = 31  # characters of a name in a MAT file that every reader takes


def write_mat(path: Path, content: Mapping[str, Any]) -> None:
    """Write variables by name: arrays, numbers, texts, cell arrays, structures as mappings."""
    from scipy import io

    with atomic_write(path) as part:
        io.savemat(str(part), dict(content), appendmat=False)


def mat_name(label: str, taken: Iterable[str]) -> str:
    """Return a label as MATLAB takes it for a variable, other than those taken."""
    plain = re.sub(r"\W", "_", label, flags=re.ASCII)
    plain = plain if re.match(r"[A-Za-z]", plain) else f"model_{plain}"
    name, number = plain[:LONGEST], 1
    while name in taken:
        number += 1
        name = f"{plain[: LONGEST - len(str(number)) - 1]}_{number}"
    return name


def cells(values: Iterable[Any]) -> Any:
    """Return a cell array, a column even of equal lengths."""
    listed = list(values)
    column = np.empty(len(listed), dtype=object)
    for k, value in enumerate(listed):
        column[k] = value
    return column
