"""The pictures of the studies, one function each, from what the studies return."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from host.arrays import Array
from matplotlib.figure import Figure

from studies.accuracy import Accuracy
from studies.coverage import Coverage
from studies.imported_logs import Estimate
from studies.methods import Score
from studies.refusal import SURE, Agreement
from studies.thesis import HopfieldRun
from studies.turbulence import GustCase
from studies.windows import LIMIT_BOUND, LIMIT_WHOLE, Compared

GREY = "0.6"
LARGEST = "largest stable step"  # of the printed one only the table speaks


def thesis_figure(runs: Sequence[HopfieldRun], found: Agreement) -> Figure:
    """Draw the printed figure and honest ones, and refusal against the analytic bound."""
    figure = Figure(figsize=(11, 4.6))
    left, right = figure.subplots(1, 2)
    stood = [run for run in runs if not run.diverged and run.what.endswith(LARGEST)]
    place = np.arange(len(stood))
    for series, label, colour in (
        ([100.0 * r.frobenius for r in stood], "parameters", "C3"),
        ([r.honest_percent for r in stood], "relative error per state", "C0"),
        ([r.thesis_percent for r in stood], "figure the thesis prints", GREY),
    ):
        left.semilogy(place, series, "o", color=colour, label=label)
    left.set_xticks(place, [r.what.split(",")[0].replace(" ", "\n", 1) for r in stood], fontsize=7)
    left.set_ylabel("error, %")
    left.set_title("table 3.2, noise-free, largest stable step", fontsize=9)
    left.legend(fontsize=7)
    for checks, colour, label in (
        ([c for c in found.checks if c.agree], "C0", "agree"),
        ([c for c in found.checks if not c.agree], "C3", "disagree"),
    ):
        right.semilogx(
            [100.0 * min(c.worst_share, 1e3) for c in checks],
            [100.0 * c.judgement.probability for c in checks],
            ".", color=colour, label=f"{label}: {len(checks)}",
        )  # fmt: skip
    right.axvline(100.0, color=GREY, lw=0.8)
    right.axhline(50.0, color=GREY, lw=0.8)
    right.axhspan(100.0 * (1.0 - SURE), 100.0 * SURE, color="0.9", zorder=0, label="not firm")
    right.set_xlabel("worst bound at the truth, % (refuse right of the line)")
    right.set_ylabel("P(a bound above 100 %), % (refused above 50)")
    right.set_title(f"refusal of {found.systems} random systems", fontsize=9)
    right.legend(fontsize=7)
    return figure


def accuracy_figure(cases: Sequence[Accuracy]) -> Figure:
    """Draw the error of each method, and error over bound of every parameter."""
    figure = Figure(figsize=(11, 4.4))
    left, right = figure.subplots(1, 2)
    place = np.arange(len(cases))
    labels = [f"{c.shape}\n{c.rate_hz:.0f} Hz" for c in cases]
    for offset, (series, label, colour) in enumerate(
        (
            ([100.0 * c.hopfield_shared for c in cases], "Hopfield fixed point", "C3"),
            ([100.0 * c.smoothed_error for c in cases], "smoothed rates", "C1"),
            ([100.0 * c.output_error for c in cases], "output error", "C0"),
        )
    ):
        left.bar(place + 0.27 * (offset - 1), series, 0.25, color=colour, label=label)
    left.set_yscale("log")
    left.set_xticks(place, labels, fontsize=7)
    left.set_ylabel("median error of nine derivatives, %")
    left.legend(fontsize=7)
    right.axhspan(0.9, 1.1, color="0.92")
    right.axhline(1.0, color=GREY, lw=0.8)
    for k, c in enumerate(cases):
        right.plot(np.full(len(c.rms_over_bound), k), c.rms_over_bound, ".", color="C0")
        right.plot(k, float(c.rms_over_bound.mean()), "_", color="C3", ms=18, mew=2)
    right.set_xticks(place, labels, fontsize=7)
    right.set_ylabel("rms(error / Cramer-Rao bound)")
    right.set_title(f"dots: parameters, bar: mean; {cases[0].runs} runs", fontsize=9)
    return figure


def coverage_figure(cases: Sequence[Coverage]) -> Figure:
    """Draw coverage per parameter and pooled, and the width against the one for known noise."""
    figure = Figure(figsize=(11, 4.4))
    left, right = figure.subplots(1, 2)
    place = np.arange(len(cases))
    labels = [f"{c.noise}\n{c.rate_hz:.0f} Hz" for c in cases]
    left.axhspan(92.0, 97.5, color="0.92", label="wanted of every parameter")
    left.axhline(95.0, color=GREY, lw=0.8)
    for k, c in enumerate(cases):
        left.plot(np.full(len(c.covered), k), 100.0 * c.covered, ".", color="C0", ms=4)
    left.plot(place, [100.0 * c.pooled for c in cases], "_", color="C3", ms=18, mew=2,
              label="pooled")  # fmt: skip
    left.plot(place, [100.0 * float(np.mean(c.white_covered)) for c in cases], "x", color=GREY,
              label="pooled, noise taken for white")  # fmt: skip
    left.set_xticks(place, labels, fontsize=6, rotation=45)
    left.set_ylabel("truth inside the 95 % interval, %")
    left.set_title(f"{cases[0].runs} runs", fontsize=9)
    left.legend(fontsize=7)
    right.axhline(1.15, color="C3", lw=0.8, ls="--", label="limit of the median")
    right.axhline(1.0, color=GREY, lw=0.8)
    for k, c in enumerate(cases):
        right.plot(np.full(len(c.width_ratio), k), c.width_ratio, ".", color="C0")
    right.set_xticks(place, labels, fontsize=6, rotation=45)
    right.set_ylabel("median width over width for known noise")
    right.legend(fontsize=7)
    return figure


def turbulence_figure(cases: Sequence[GustCase]) -> Figure:
    """Draw rms errors of both methods for every case, and their coverage."""
    figure = Figure(figsize=(11, 4.2))
    *bars, right = figure.subplots(1, len(cases) + 1, width_ratios=[1.0] * len(cases) + [1.3])
    for axis, c in zip(bars, cases, strict=True):
        place = np.arange(len(c.names))
        axis.bar(place - 0.2, 100.0 * c.output_rms, 0.38, color="C3", label="output error")
        axis.bar(place + 0.2, 100.0 * c.filter_rms, 0.38, color="C0", label="filter error")
        axis.plot(place + 0.2, 100.0 * c.bound, "k_", ms=9, label="bound")
        axis.set_yscale("log")
        axis.set_ylim(0.05, 100.0)
        axis.set_xticks(place, list(c.names), fontsize=6, rotation=45)
        axis.set_title(_case(c), fontsize=8)
    bars[0].set_ylabel("rms error, %")
    bars[0].legend(fontsize=6)
    place = np.arange(len(cases))
    right.axhspan(90.0, 98.0, color="0.92")
    right.plot(place + 0.1, [100.0 * c.filter_covered for c in cases], "o", color="C0")
    right.plot(place - 0.1, [100.0 * c.output_covered for c in cases], "o", color="C3")
    right.set_xticks(place, [_case(c) for c in cases], fontsize=6, rotation=45)
    right.set_title("coverage of 95 % intervals, %\n(wanted: shaded)", fontsize=8)
    return figure


def _case(case: GustCase) -> str:
    return f"{case.intensity_mps} m/s, {'pilot' if case.pilot else 'open loop'}"


def methods_figure(scores: Sequence[Score]) -> Figure:
    """Draw error, coverage and time of every method as shaded tables."""
    methods = list(dict.fromkeys(s.method for s in scores))
    data = list(dict.fromkeys(s.data for s in scores))
    figure = Figure(figsize=(11, 0.3 * len(methods) + 2.0))
    for axis, (title, key, best, worst) in zip(
        figure.subplots(1, 3, sharey=True),
        (
            ("median error, %", "error", 0.03, 0.6),
            ("coverage, %", "covered", 0.95, 0.3),
            ("time, ms", "seconds", 0.005, 1.0),
        ),
        strict=True,
    ):
        values = np.array(
            [[_pick(scores, m, d, key) for d in data] for m in methods], dtype=np.float64
        )
        axis.imshow(
            _badness(values, best, worst), cmap="RdYlGn_r", vmin=-0.6, vmax=1.5, aspect="auto"
        )
        scale = 1e3 if key == "seconds" else 100.0
        for i in range(len(methods)):
            for j in range(len(data)):
                text = f"{scale * values[i, j]:.3g}" if np.isfinite(values[i, j]) else "failed"
                axis.text(j, i, text, ha="center", va="center", fontsize=6)
        axis.set_xticks(range(len(data)), data, fontsize=6, rotation=35, ha="right")
        axis.set_yticks(range(len(methods)), methods, fontsize=7)
        axis.set_title(title, fontsize=9)
    return figure


def _pick(scores: Sequence[Score], method: str, data: str, key: str) -> float:
    return next(float(getattr(s, key)) for s in scores if (s.method, s.data) == (method, data))


def _badness(values: Array, best: float, worst: float) -> Array:
    """Return 0 at `best`, 1 at `worst`; logarithmic if best is the smaller one."""
    if best < worst:
        ratio = np.log(np.maximum(values, 1e-12) / best) / np.log(worst / best)
    else:
        ratio = (best - values) / (best - worst)
    return np.asarray(np.nan_to_num(np.clip(ratio, 0.0, 1.0), nan=1.0), dtype=np.float64)


def windows_figure(cases: Sequence[Compared]) -> Figure:
    """Draw errors from windows over those from the whole record, and over the bound."""
    figure = Figure(figsize=(11, 4.6))
    left, right = figure.subplots(1, 2)
    place = np.arange(len(cases))
    labels = [c.label.replace(", ", "\n", 1) for c in cases]
    bounded = [k for k, c in enumerate(cases) if not c.label.startswith("card ")]
    for axis, shown, limit, title in (
        (left, place, LIMIT_WHOLE, "error from windows over error from the whole record"),
        (right, place[bounded], LIMIT_BOUND, "error from windows over bound of the whole record"),
    ):
        for k in shown:
            values = cases[k].ratio if axis is left else cases[k].found_rms
            axis.plot(np.full(len(values), k), values, ".", color="C0", ms=4)
        axis.axhline(limit, color="C3", lw=0.8, ls="--", label="limit")
        axis.set_yscale("log")
        axis.set_xticks(shown, [labels[k] for k in shown], fontsize=6, rotation=60)
        axis.set_title(title, fontsize=9)
        axis.legend(fontsize=7)
    return figure


def imported_figure(found: Sequence[Estimate]) -> Figure:
    """Draw the error of every coefficient over its half-width, by the log it came from."""
    over: dict[str, list[float]] = {}
    for one in found:
        over.setdefault(one.source, []).append((one.value - one.true) / one.half_width)
    return intervals_figure(over)


def intervals_figure(over: Mapping[str, Sequence[float] | Array]) -> Figure:
    """Draw errors over their 95 % half-widths: beyond the lines an interval does not hold.

    Parameters
    ----------
    over : mapping of str to sequence of float
        Ratios of each group.
    """
    figure = Figure(figsize=(max(9.0, 2.0 + 0.22 * len(over)), 4.6))
    axis = figure.subplots()
    for k, values in enumerate(over.values()):
        axis.plot(np.full(len(values), k), values, ".", color="C0", ms=4)
    for edge in (-1.0, 1.0):
        axis.axhline(edge, color="C3", lw=0.8, ls="--")
    axis.set_xticks(range(len(over)), list(over), fontsize=7, rotation=40, ha="right")
    axis.set_title("error over 95 % half-width", fontsize=9)
    return figure
