"""A picture of a calibration: points, line and residuals of each channel, as SVG."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from host.bench_calibration.bench_plan import Subject
from host.bench_calibration.calibrated_lines import Calibrated
from host.bench_calibration.line_fit import LineFit
from host.export.atomic_files import atomic_write

_COLOURS = ("#0b5cad", "#c2410c", "#15803d", "#7e22ce", "#64748b")
_MARKS = {1: "^", -1: "v", 0: "o"}
_WORDS = {1: "from below", -1: "from above"}
_RAW = {"channel": "counts", "pulse": "us", "imu": ""}
_WIDTH_IN, _HEIGHT_IN = 3.4, 4.6


def draw_picture(subject: Subject, lines: Sequence[Calibrated], target: Path) -> None:
    """Write points, fit and residuals as SVG, a column for each channel that has a line.

    Raises
    ------
    UsageError
        If the place cannot be written to.
    """
    fits = [(c.fit, c.doubt) for c in lines if c.fit is not None]
    if not fits:
        return
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    style: Any = {"svg.hashsalt": "host calibrate", "svg.fonttype": "none", "font.size": 9.0}
    with mpl.rc_context(style):
        figure, axes = plt.subplots(
            2, len(fits), figsize=(max(_WIDTH_IN * len(fits), 4.5), _HEIGHT_IN), squeeze=False,
            sharex="col", height_ratios=(2, 1), layout="constrained",
        )  # fmt: skip
        for column, (fit, doubt) in enumerate(fits):
            _draw(subject, fit, doubt, axes[0, column], axes[1, column])
            if column == 0:
                _legend(fit, axes[0, 0])
        try:
            with atomic_write(target) as part:
                metadata = {"Date": None, "Creator": "host calibrate"}
                figure.savefig(part, format="svg", metadata=metadata)
        finally:
            plt.close(figure)


def _legend(fit: LineFit, axis: Any) -> None:
    """Say once what colours and marks are."""
    for repeat in np.unique(fit.repeat):
        colour = _COLOURS[(int(repeat) - 1) % len(_COLOURS)]
        axis.plot([], [], "s", color=colour, markersize=4, label=f"repeat {repeat}")
    for side, mark in _MARKS.items():
        if side and (fit.direction == side).any():
            axis.plot([], [], mark, color="#475569", markersize=4, label=_WORDS[side])
    axis.legend(fontsize=7, loc="best", frameon=False)


def _draw(subject: Subject, fit: LineFit, doubt: str | None, above: Any, below: Any) -> None:
    unit = _RAW[subject.table] or (subject.tool.setting if subject.tool else "")
    at = fit.position
    order = np.argsort(at)
    line = fit.fitted
    above.plot(at[order], line[order], color="#94a3b8", linewidth=1.0, zorder=1)
    for repeat in np.unique(fit.repeat):
        colour = _COLOURS[(int(repeat) - 1) % len(_COLOURS)]
        for side, mark in _MARKS.items():
            chosen = (fit.repeat == repeat) & (fit.direction == side)
            if not chosen.any():
                continue
            for axis, y in ((above, fit.raw), (below, fit.raw - line)):
                axis.plot(at[chosen], y[chosen], mark, color=colour, markersize=4,
                          fillstyle="full" if side else "none")  # fmt: skip
    limit = subject.limits.get("spot", 0.0)
    below.axhline(0.0, color="#94a3b8", linewidth=1.0)
    if doubt:
        for edge in (-limit, limit):
            below.axhline(edge, color="#dc2626", linewidth=0.8, linestyle="--")
    above.set_title(
        fit.channel + (" (doubted)" if doubt else " (curve)" if fit.curve else ""), fontsize=10
    )
    above.set_ylabel(unit)
    below.set_ylabel(f"off the line, {unit}" if unit else "off the line")
    below.set_xlabel(subject.tool.setting if subject.tool else "")
