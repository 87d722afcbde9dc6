"""What a handbook or a vortex lattice said before the flight, beside what the flight says.

TOML (`[coefficients]` with names as in the answer, per radian, body axes; with `alpha_deg = [...]`
each may be a list, a table over the angle of attack), text that AVL writes with ST or SB (`avl`),
or Digital Datcom's output (`datcom`). Tables are read between their rows at the flight's angle of
attack, lateral derivatives turned from stability to body axes there. Signs are the house's: body
axes x forward, y right, z down; elevator and aileron as in the answer. Coefficients are referred
to the file's own area, chord and span, which are printed beside them where the file has them.
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from host.sysid.aircraft.airframe import CoefficientTable
from host.sysid.aircraft.avl import is_avl, read_avl
from host.sysid.aircraft.datcom import is_datcom, read_datcom
from host.sysid.aircraft.prior_table import Points, PriorTable, half_turned
from host.sysid.errors import IdentificationError

SOUND_MPS = 340.3  # standard atmosphere, sea level: chooses between Mach numbers of a handbook


def read_prior(path: Path, airspeed_mps: float = 0.0) -> PriorTable:
    """Return coefficients over the angle of attack.

    Parameters
    ----------
    path : Path
        TOML, AVL's ST or SB output, or Datcom's output.
    airspeed_mps : float
        Of the flight: which Mach number of several.

    Raises
    ------
    IdentificationError
        If the file cannot be read, holds no coefficient, or one that is no number.
    """
    try:
        text = path.read_text(encoding="utf-8-sig", errors="replace")
        table: PriorTable | None = None
        if path.suffix == ".toml":
            table = _from_toml(text)
        elif is_datcom(text):
            table = read_datcom(text, airspeed_mps / SOUND_MPS)
        elif is_avl(text):
            table = read_avl(text)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise IdentificationError(f"{path}: cannot be read as a prior ({reason})") from error
    except (ValueError, TypeError, IdentificationError) as error:
        raise IdentificationError(f"{path}: {error}") from error
    if table is None or not table.points:
        raise IdentificationError(
            f"{path}: no coefficient; expected TOML with [coefficients], or output of AVL (ST, SB)"
            " or Datcom"
        )
    wrong = sorted(n for n, pairs in table.points.items() if not np.isfinite(pairs).all())
    if wrong:
        raise IdentificationError(f"{path}: {', '.join(wrong)} not a finite number")
    return table


def _from_toml(text: str) -> PriorTable:
    document = tomllib.loads(text)
    listed, table = document.get("alpha_deg", [0.0]), document.get("coefficients", {})
    if not isinstance(listed, list) or not listed:
        raise ValueError(f"alpha_deg is {listed!r}, expected a list of angles")
    if not isinstance(table, dict):
        raise ValueError(f"coefficients is {table!r}, expected a table [coefficients]")
    angles = [_number("alpha_deg", x) for x in listed]
    if np.any(np.diff(angles) <= 0.0):
        raise ValueError(f"alpha_deg {angles}, expected rising angles")
    points: Points = {}
    for name, value in table.items():
        values = value if isinstance(value, list) else [value] * len(angles)
        if len(values) != len(angles):
            raise ValueError(f"{name} has {len(values)} values, alpha_deg {len(angles)}")
        points[str(name)] = [
            (float(np.radians(a)), _number(name, v)) for a, v in zip(angles, values, strict=True)
        ]
    return PriorTable(points, stability_axes=False)


def _number(name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{name} is {value!r}, expected a number")
    return float(value)


def prior_lines(tables: Sequence[CoefficientTable], prior: PriorTable) -> list[str]:
    """Return where the prior is from, and a table: identified, interval, prior, agreement.

    Parameters
    ----------
    tables : sequence of CoefficientTable
        The answer; the prior is read at the angle of attack of each.
    prior : PriorTable
        From `read_prior`.
    """
    lines = [f"prior: {line}" for line in prior.source if line]
    names = {c.name for table in tables for c in table.coefficients}
    if not names & prior.points.keys():
        return [
            *lines,
            f"prior: none of its coefficients ({', '.join(prior.points)}) is in the answer, which"
            f" has {', '.join(sorted(names)) or 'none'}",
        ]
    for table in tables:
        expected = prior.at(table.alpha_rad)
        shared = [c for c in table.coefficients if c.name in expected]
        if not shared:
            continue
        place = _place(prior, float(np.degrees(table.alpha_rad)))
        lines += [f"{table.template}, {table.method}" + (f": prior {place}" if place else "")]
        apart = set(half_turned(prior.points)) & {c.name for c in shared}
        if prior.stability_axes and apart:
            lines.append(
                f"not or not wholly turned, what they turn with is not in the prior:"
                f" {', '.join(sorted(apart))}"
            )
        lines.append(f"{'coefficient':12s} {'identified':>12s} {'95 %':>10s} {'prior':>10s}")
        for c in shared:
            outside = abs(c.value - expected[c.name]) > c.half_width
            lines.append(
                f"{c.name:12s} {c.value:12.4g} {c.half_width:10.2g} {expected[c.name]:10.4g}"
                f"  {'outside the interval' if outside else 'inside'}"
            )
    return lines


def prior_document(
    tables: Sequence[CoefficientTable], prior: PriorTable
) -> dict[str, dict[str, dict[str, float | bool]]]:
    """Return the same for JSON, by template and method."""
    found: dict[str, dict[str, dict[str, float | bool]]] = {}
    for table in tables:
        expected = prior.at(table.alpha_rad)
        found[f"{table.template}, {table.method}"] = {
            c.name: {
                "value": c.value,
                "half_width": c.half_width,
                "prior": expected[c.name],
                "inside": abs(c.value - expected[c.name]) <= c.half_width,
            }
            for c in table.coefficients
            if c.name in expected
        }
    return found


def _place(table: PriorTable, alpha_deg: float) -> str:
    """Say where a table is read and how it is turned; nothing where neither is done."""
    least, most = np.degrees(table.limits_rad)
    words = []
    if least < most:
        words.append(f"read at alpha {alpha_deg:.1f} deg of a table from {least:g} to {most:g} deg")
        if not least <= alpha_deg <= most:
            words.append("beyond its end, whose row stands")
    if table.stability_axes:
        turn_deg = float(np.clip(alpha_deg, least, most))
        words.append(f"turned from stability to body axes by {turn_deg:.1f} deg")
    return ", ".join(words)
