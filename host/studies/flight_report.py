"""Tables and pictures of the two studies that fly: coefficients, and the thesis's own flights."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from studies.coefficients import NETWORK, CoefficientTally
from studies.study_table import Cell, Table
from studies.thesis_flights import Case, Figures, lines

WILD = 0.15


def coefficient_table(tally: CoefficientTally) -> Table:
    """Return errors, half-widths and coverage per derivative, and those of the thesis's method."""
    own = tally.coefficients
    rows: list[tuple[Cell, ...]] = []
    for name, errors in own.error.items():
        sizes = 100.0 * np.abs(errors)
        thesis = [
            f"{100.0 * float(np.median(np.abs(t.error[name]))):.0f}" if name in t.error else "-"
            for t in tally.thesis.values()
        ]
        rows.append(
            (
                name, float(np.median(sizes)), float(sizes.max()),
                100.0 * float(np.median(own.half[name])), 100.0 * float(np.mean(own.covered[name])),
                100.0 * float(np.mean(own.flagged[name])), *thesis,
            )
        )  # fmt: skip
    words = tally.lines()[len(own.error) :]
    ends = [k for k, line in enumerate(words) if not line.startswith("  ")]
    remark = "\n\n".join(line.strip() for line in words[: ends[0] if ends else None])
    return Table(
        "Coefficients of virtual flights of the Ultra Stick 25e through the recorder",
        (
            "derivative", "median error %", "worst %", "median half-width %", "covered %",
            "flagged %", *(f"thesis: {NETWORK[k]}, median error %" for k in tally.thesis),
        ),
        tuple(rows),
        remark,
    )  # fmt: skip


def coefficient_figure(tally: CoefficientTally) -> Figure:
    """Draw every error as a dot, the median half-width as a bar; hollow dots are flagged."""
    figure = Figure(figsize=(10, 4.6))
    axis = figure.subplots()
    own = tally.coefficients
    for place, (name, errors) in enumerate(own.error.items()):
        half = 100.0 * float(np.median(own.half[name]))
        axis.plot([place, place], [-half, half], color="0.8", lw=8, solid_capstyle="butt")
        flagged = np.array(own.flagged[name])
        shown = 100.0 * np.array(errors)
        axis.plot(np.full(int((~flagged).sum()), place), shown[~flagged], "o", color="C0", ms=3)
        axis.plot(
            np.full(int(flagged.sum()), place), shown[flagged], "o", color="C3", mfc="w", ms=4
        )
    for level in (-WILD, WILD):
        axis.axhline(100.0 * level, color="C3", lw=0.8, ls="--")
    axis.set_xticks(range(len(own.error)), list(own.error), rotation=60, fontsize=8)
    axis.set_ylabel("error, %")
    axis.set_title("a dot per flight (hollow: flagged), grey the median 95 % interval", fontsize=9)
    return figure


DetectedManeuver = Sequence[tuple[Case, Sequence[Figures], Sequence[tuple[float, float]]]]


def thesis_flights_table(found: DetectedManeuver) -> Table:
    """Return the thesis's figures re-enacted, medians over the seeds."""
    rows = tuple(
        (
            case.name,
            case.printed_percent,
            float(np.median([f.program_percent for f in figures])),
            float(np.median([f.nothing_percent for f in figures])),
            float(np.median([f.sum_of_means for f in figures])),
            float(np.median([f.per_state_percent for f in figures])),
            100.0 * float(np.median([f.nrmse for f in figures])),
            100.0 * float(np.median([a for a, _ in ours])),
        )
        for case, figures, ours in found
    )
    words = [line.strip() for item in found for line in (lines(*item)[0], *lines(*item)[4:])]
    return Table(
        "The two thesis flights again",
        (
            "window", "thesis printed %", "program's figure %", "that of nothing moving %",
            "eq. 5.3, units mixed", "relative error per state %", "NRMSE %",
            "NRMSE of this product %",
        ),
        rows,
        "\n\n".join(words),
    )  # fmt: skip


def thesis_flights_figure(found: DetectedManeuver) -> Figure:
    """Draw what the program prints and what it divides away."""
    figure = Figure(figsize=(9, 4.2))
    axis = figure.subplots()
    for shift, label, colour, values in (
        (-0.3, "program's figure", "0.6", [[f.program_percent for f in x] for _, x, _ in found]),
        (-0.1, "nothing moves", "k", [[f.nothing_percent for f in x] for _, x, _ in found]),
        (0.1, "per state", "C0", [[f.per_state_percent for f in x] for _, x, _ in found]),
        (0.3, "NRMSE", "C3", [[100.0 * f.nrmse for f in x] for _, x, _ in found]),
    ):
        for k, value in enumerate(values):
            axis.semilogy([k + shift] * len(value), value, "o", color=colour, ms=3, alpha=0.6)
            axis.semilogy(
                k + shift, float(np.median(value)), "_", color=colour, ms=16, mew=2,
                label=label if k == 0 else None,
            )  # fmt: skip
    axis.set_xticks(range(len(found)), [case.name for case, _, _ in found], fontsize=8)
    axis.set_ylabel("%, bars are medians")
    axis.legend(fontsize=7)
    return figure
