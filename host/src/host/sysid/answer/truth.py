"""The answer beside the truth of a simulated flight."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from host.sysid.aircraft.airframe import CoefficientTable
from host.sysid.errors import IdentificationError
from host.sysid.flight.linear import AXIS_OF


def read_truth(path: Path) -> dict[str, Any]:
    """Read the truth file `host simulate` writes beside a log.

    Raises
    ------
    IdentificationError
        If the file is none of these.
    """
    try:
        with path.open("rb") as file:
            document = tomllib.load(file)
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise IdentificationError(f"{path}: cannot be read as a truth file: {error}") from error
    if not isinstance(document.get("maneuver"), list):
        raise IdentificationError(f"{path}: no [[maneuver]] in it; expected flight.truth.toml")
    return document


def true_coefficients(document: dict[str, Any], template: str) -> dict[str, float]:
    """Return local derivatives averaged over the maneuvers of a template's axes."""
    axes = {axis.split("_")[0] for axis in AXIS_OF.get(template, ())}
    tables = [
        m["derivatives"]
        for m in document["maneuver"]
        if axes & set(m.get("axes", ())) and "derivatives" in m
    ]
    if not tables:
        return {}
    return {name: sum(t[name] for t in tables) / len(tables) for name in tables[0]}


def truth_lines(tables: Sequence[CoefficientTable], document: dict[str, Any]) -> list[str]:
    """Return a table of coefficients against the truth, errors relative to it."""
    lines = ["against the truth of the simulated flight (local derivatives, mean of maneuvers)"]
    inside = total = 0
    for table in tables:
        truth = true_coefficients(document, table.template)
        for c in table.coefficients:
            if c.name not in truth:
                continue
            miss = c.value - truth[c.name]
            covered = abs(miss) <= c.half_width
            inside += covered
            total += 1
            share = f"{100.0 * miss / abs(truth[c.name]):+7.1f} %" if truth[c.name] else "        -"
            lines.append(
                f"  {c.name:9s} {c.value:9.4f} +- {c.half_width:7.4f}  truth {truth[c.name]:9.4f}"
                f"  error {share}  {'inside' if covered else 'OUTSIDE'}"
            )
    if total == 0:
        return ["no coefficient to compare: name the aircraft (--aircraft)"]
    lines.append(f"  {inside} of {total} intervals hold the truth")
    return lines
