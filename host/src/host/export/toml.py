"""Write plain data as TOML: the standard library only reads it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

import numpy as np

Plain = object


def dumps(document: Mapping[str, Plain]) -> str:
    """Return nested mappings of numbers, strings, lists and lists of mappings as TOML.

    Parameters
    ----------
    document : mapping
        numpy numbers and arrays are allowed; keys must be bare TOML keys.

    Raises
    ------
    TypeError
        A value of another kind.
    """
    return "\n".join(_table(document, "")).strip() + "\n"


def _table(table: Mapping[str, Plain], path: str) -> list[str]:
    lines: list[str] = []
    deep: list[tuple[str, Plain]] = []
    for key, value in table.items():
        if isinstance(value, Mapping) or _is_tables(value):
            deep.append((key, value))
        else:
            lines.append(f"{key} = {toml_value(value)}")
    for key, value in deep:
        name = f"{path}.{key}" if path else key
        if isinstance(value, Mapping):
            lines += ["", f"[{name}]", *_table(value, name)]
        elif isinstance(value, Sequence):
            for row in value:
                lines += ["", f"[[{name}]]", *_table(row, name)]
    return lines


def _is_tables(value: Plain) -> bool:
    return (
        isinstance(value, Sequence)
        and not isinstance(value, str)
        and len(value) > 0
        and all(isinstance(row, Mapping) for row in value)
    )


def toml_value(value: Plain) -> str:
    """Return a number, a string or a list of them as TOML."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)  # what JSON escapes, TOML does the same way
    if isinstance(value, Sequence):
        return "[" + ", ".join(toml_value(x) for x in value) + "]"
    raise TypeError(f"{type(value).__name__} cannot be written as TOML")


def toml_number(value: float) -> str:
    """Return a number as TOML with a point: a float whatever it was."""
    return repr(float(value))  # numpy's numbers call themselves np.float64(...)
