"""What a handbook, a vortex lattice or the fleet of its type said, compared with the flight.

A prior with half-widths, as `host fleet` writes it for a further aircraft of a type, is weighed
with the flight: both are estimates of the same number, each counts by its inverse variance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from host.aircraft.prior.prior_table import PriorTable, half_turned

if TYPE_CHECKING:
    from host.sysid.aerodynamics.coefficient import Coefficient, CoefficientTable


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
    return [*lines, *(line for table in tables for line in _table_lines(table, prior))]


def _table_lines(table: CoefficientTable, prior: PriorTable) -> list[str]:
    """Return one table with its prior; nothing where they share no coefficient."""
    expected = prior.at(table.alpha_rad)
    shared = [c for c in table.coefficients if c.name in expected]
    if not shared:
        return []
    place = _place(prior, float(np.degrees(table.alpha_rad)))
    lines = [f"{table.template}, {table.method}" + (f": prior {place}" if place else "")]
    apart = set(half_turned(prior.points)) & {c.name for c in shared}
    if prior.stability_axes and apart:
        lines.append(
            f"not or not wholly turned, what they turn with is not in the prior:"
            f" {', '.join(sorted(apart))}"
        )
    widths = "".join(f" {name:>10s}" for name in ("95 %", "together", "95 %"))
    lines.append(
        f"{'coefficient':12s} {'identified':>12s} {'95 %':>10s} {'prior':>10s}"
        + (widths if prior.half_widths else "")
    )
    return [*lines, *(_line(c, expected[c.name], prior) for c in shared)]


def _line(c: Coefficient, expected: float, prior: PriorTable) -> str:
    half = prior.half_widths.get(c.name)
    text = f"{c.name:12s} {c.value:12.4g} {c.half_width:10.2g} {expected:10.4g}"
    if half is not None:
        value, width = combined_estimate(c, expected, half)
        text += f" {half:10.2g} {value:10.4g} {width:10.2g}"
    elif prior.half_widths:
        text += 33 * " "
    inside = _agrees(c, expected, half)
    return f"{text}  {'inside' if inside else 'outside the interval'}"


def _agrees(c: Coefficient, expected: float, half: float | None) -> bool:
    """Return whether flight and prior may be of one aircraft."""
    return abs(c.value - expected) <= math.hypot(c.half_width, half or 0.0)


def combined_estimate(c: Coefficient, expected: float, half: float) -> tuple[float, float]:
    """Return the combined estimate of flight and prior, and its 95 % half-width.

    Parameters
    ----------
    c : Coefficient
        Coefficient of the flight.
    expected, half : float
        Value and half-width of the prior, which knows nothing of this flight.
    """
    share = half**2 / (half**2 + c.half_width**2)  # of the flight
    return share * c.value + (1.0 - share) * expected, math.sqrt(share) * c.half_width


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
                "inside": _agrees(c, expected[c.name], prior.half_widths.get(c.name)),
                **_combined_entries(c, expected[c.name], prior.half_widths.get(c.name)),
            }
            for c in table.coefficients
            if c.name in expected
        }
    return found


def _combined_entries(c: Coefficient, expected: float, half: float | None) -> dict[str, float]:
    if half is None:
        return {}
    value, width = combined_estimate(c, expected, half)
    return {"prior_half_width": half, "together": value, "together_half_width": width}


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
