"""Where the numbers of an aircraft come from: measured, a handbook, publications, flights."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

from host.aircraft.file import read_document
from host.files.toml_reader import is_mapping

HANDBOOK = "handbook methods"  # the source of coefficients begins so
IDENTIFIED = "identified,"  # that of a single one


def aircraft_origin(source: str | Path) -> str:
    """Return in words what an aircraft is and what its coefficients rest on.

    Raises
    ------
    AircraftError
        If it cannot be read.
    """
    document = read_document(source)
    name = f"{document.get('title', document.get('name', source))}"
    kind = document.get("kind")
    if kind == "measured":
        return f"{name}: measured, mass, sizes and places; no coefficients"
    if kind == "linear":
        return f"{name}: published matrices about one flight, sizes of {document.get('base')}"
    table = document.get("aerodynamics")
    table = table if is_mapping(table) else {}
    single = table.get("sources")
    origins = [str(one) for one in single.values()] if is_mapping(single) else []
    count = sum(one.startswith(IDENTIFIED) for one in origins)
    if count:
        return f"{name}: {count} coefficients identified from flight, the others as before"
    if str(table.get("source", "")).startswith(HANDBOOK):
        return f"{name}: handbook estimates from its dimensions, 10 to 30 % each"
    said = str(table.get("source", "an unknown source"))
    return f"{name}: coefficients of {said.partition(';')[0].partition(',')[0][:80]}"


def announce_aircraft(names: Iterable[str | None]) -> None:
    """Say on stderr of each aircraft named what it is; saved models and None are left out.

    Raises
    ------
    AircraftError
        If one cannot be read.
    """
    for name in names:
        if name is not None:
            print(f"host: aircraft {aircraft_origin(name)}", file=sys.stderr)
