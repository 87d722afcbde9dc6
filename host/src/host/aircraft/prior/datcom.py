"""Coefficients from the output of Digital Datcom (`for006.dat`), over the angle of attack.

Pages begin with "1"; two kinds are read, "CHARACTERISTICS AT ANGLE OF ATTACK AND IN SIDESLIP" and
"DYNAMIC DERIVATIVES", each of one configuration, Mach number and altitude. Below a header a row per
angle of attack: what does not change with it stands in the first row only, NDM, NA or stars where
no method tells. Derivatives are per degree or per radian as the page says, moments about the
reference centre and stability axes (AFFDL-TR-79-3032, vol. I, sec. 2.2.1), rates referred to half
chord and half span over airspeed, as ours are. Increments of control surfaces are not read.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from host.aircraft.prior.prior_table import Points, PriorTable
from host.constants import DEG_PER_RAD

NAMES = {
    "CLA": "CL_alpha", "CMA": "Cm_alpha", "CYB": "CY_beta", "CNB": "Cn_beta", "CLB": "Cl_beta",
    "CLQ": "CL_q", "CMQ": "Cm_q", "CLP": "Cl_p", "CYP": "CY_p", "CNP": "Cn_p", "CNR": "Cn_r",
    "CLR": "Cl_r",
}  # fmt: skip
_KINDS = ("CHARACTERISTICS AT ANGLE OF ATTACK", "DYNAMIC DERIVATIVES")
_NUMBER = re.compile(r"[-+]?\d*\.\d+(?:E[-+]?\d+)?")
_UNIT = re.compile(r"DERIVATIVES?\s*\(PER (DEGREE|RADIAN)\)")
_CONFIGURATION = re.compile(r"^\s*(\S.*\S)\s+CONFIGURATION\s*$")
_LENGTHS = re.compile(r"\s(\S+)\*\*2\s+\S+\s+\S+\s+\S+\s+\S+\s*$")
REFERENCES = 5  # area, chord, span, and the centre's x and z end the line of conditions


@dataclass(frozen=True, slots=True)
class _Page:
    configuration: str
    mach: float
    altitude: float
    references: str
    points: Points


def is_datcom(text: str) -> bool:
    """Return whether a text looks like Datcom's output."""
    return "ALPHA" in text and _UNIT.search(text) is not None


def read_datcom(text: str, mach: float = 0.0) -> PriorTable | None:
    """Return the table of the most complete configuration at the Mach number nearest to `mach`.

    Parameters
    ----------
    text : str
        What Datcom wrote.
    mach : float
        Mach number of the flight. The lowest of several altitudes is taken, the last of equal
        pages.

    Returns
    -------
    PriorTable or None
        None if no page holds a derivative.
    """
    pages = [page for lines in _split(text) if (page := _read(lines)) is not None]
    if not pages:
        return None
    most = max(page.configuration.count("-") for page in pages)
    name = [p.configuration for p in pages if p.configuration.count("-") == most][-1]
    pages = [p for p in pages if p.configuration == name]
    nearest = min((p.mach for p in pages), key=lambda m: abs(m - mach))
    lowest = min(p.altitude for p in pages if p.mach == nearest)
    points: Points = {}
    references = ""
    for page in pages:
        if (page.mach, page.altitude) == (nearest, lowest):
            points |= page.points
            references = page.references
    where = f"Digital Datcom: {name.lower()}, Mach {nearest:g}"
    lost = [ours for ours in NAMES.values() if ours not in points]
    remarks = [f"{', '.join(lost)} not printed, or as no number"] if lost else []
    return PriorTable(points, stability_axes=True, source=(where, references, *remarks))


def _split(text: str) -> list[list[str]]:
    pages: list[list[str]] = []
    for line in text.splitlines():
        if line.startswith("1") and not line[1:2].isdigit():
            pages.append([])
        elif pages:
            pages[-1].append(line)
    return [p for p in pages if any(kind in line for kind in _KINDS for line in p[:2])]


def _read(lines: list[str]) -> _Page | None:
    """Return a page's derivatives per radian; None if it holds none or is in ground effect."""
    points: Points = {}
    configuration, conditions, unit_m2, scale = "", "", "", 1.0
    columns: dict[str, float] = {}
    for line in lines:
        if "GROUND" in line:
            return None
        unit = _UNIT.search(line)
        if unit:
            scale = DEG_PER_RAD if unit.group(1) == "DEGREE" else 1.0
        if not configuration and (named := _CONFIGURATION.match(line)):
            configuration = named.group(1)
        if not unit_m2 and (lengths := _LENGTHS.search(line)):
            unit_m2 = lengths.group(1)
        tokens = {m.group(): 0.5 * sum(m.span()) for m in re.finditer(r"[A-Z]+", line)}
        if "ALPHA" in tokens and any(name in tokens for name in NAMES):
            columns = tokens
        elif line.startswith("0") and line[1:].strip():
            if not conditions:
                conditions = line[1:]
            columns = {}
        elif columns:
            _add_row(points, line, columns, scale)
    if not points:
        return None
    numbers = [float(x) for x in _NUMBER.findall(conditions)]
    references = ""
    if len(numbers) > REFERENCES:
        S, c, b, x, z = numbers[-REFERENCES:]
        references = (
            f"reference area {S:g} {unit_m2}**2, chord {c:g}, span {b:g}, moments about x {x:g},"
            f" z {z:g} {unit_m2}"
        )
    # Mach, altitude, velocity, pressure, temperature, Reynolds number; all but the ends may lack.
    altitude = numbers[1] if len(numbers) == REFERENCES + 6 else 0.0
    return _Page(configuration, numbers[0] if numbers else 0.0, altitude, references, points)


def _add_row(points: Points, line: str, columns: dict[str, float], scale: float) -> None:
    values = [(float(m.group()), 0.5 * sum(m.span())) for m in _NUMBER.finditer(line)]
    for value, middle in values[1:]:
        name = min(columns, key=lambda k: abs(columns[k] - middle))
        if name in NAMES:
            points.setdefault(NAMES[name], []).append(
                (float(np.radians(values[0][0])), scale * value)
            )
