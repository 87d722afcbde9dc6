"""What a handbook or a vortex lattice said, beside what the flight says."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.aircraft.prior.prior_table import PriorTable, half_turned
from host.sysid.aerodynamics.coefficient_table import CoefficientTable


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
