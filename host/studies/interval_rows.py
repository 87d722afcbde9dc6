"""Estimates with intervals and their truths: one table and one picture for every study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from host.arrays import Array
from host.sysid.answer import CAREFUL, TRUSTED
from numpy.typing import NDArray

from studies.study_table import Cell, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Rows = Sequence[Mapping[str, str]]


def interval_table(title: str, groups: Mapping[str, Rows]) -> Table:
    """Return a row for each group and parameter.

    Parameters
    ----------
    title : str
    groups : mapping of str to sequence of mapping
        Rows with `name`, `true`, `estimate`, `half_width`, and `mark` where verdicts were given;
        one without an estimate was refused.
    """
    lines: list[tuple[Cell, ...]] = []
    held = answered = refused = 0
    for group, rows in groups.items():
        refused += sum(not r["estimate"] for r in rows)
        for name in dict.fromkeys(r["name"] for r in rows if r["estimate"]):
            own = [r for r in rows if r["name"] == name and r["estimate"]]
            error, width = _relative_percent(own)
            inside = np.abs(error) <= width
            rms = float(np.sqrt(np.mean(error**2)))
            answered, held = answered + len(own), held + int(inside.sum())
            lines.append(
                (
                    group or "all", name, len(own), float(np.mean(error)), rms,
                    float(np.median(width)), int(inside.sum()), *_relied_on(own, inside),
                )
            )  # fmt: skip
    share = 100.0 * held / max(answered, 1)
    return Table(
        title,
        (
            "case", "parameter", "estimates", "mean error %", "rms error %",
            "median half-width %", "hold", "relied on", "of these hold",
        ),
        tuple(lines),
        f"{held} of {answered} intervals hold ({share:.1f} %); refused: {refused}. Errors are"
        " relative to the rms of the true values. Relied on: under \"trust\" or \"use with care\".",
    )  # fmt: skip


def interval_figure(groups: Mapping[str, Rows]) -> Figure:
    """Draw the error of every estimate over its half-width, by group."""
    from studies.figures import intervals_figure

    over = {}
    for group, rows in groups.items():
        true, estimate, half = _numbers([r for r in rows if r["estimate"]])
        over[group or "all"] = (estimate - true) / half
    return intervals_figure(over)


def _relied_on(own: Rows, inside: NDArray[np.bool_]) -> tuple[Cell, Cell]:
    if "mark" not in own[0]:
        return "-", "-"
    relied = np.array([r["mark"] in (TRUSTED, CAREFUL) for r in own])
    return int(relied.sum()), int(np.sum(relied & inside))


def _relative_percent(own: Rows) -> tuple[Array, Array]:
    """Return errors and half-widths, % of the rms of the true values."""
    true, estimate, half = _numbers(own)
    size = float(np.sqrt(np.mean(true**2)))
    return 100.0 * (estimate - true) / size, 100.0 * half / size


def _numbers(own: Rows) -> tuple[Array, Array, Array]:
    true, estimate, half = (
        np.array([float(r[k]) for r in own]) for k in ("true", "estimate", "half_width")
    )
    return true, estimate, half
