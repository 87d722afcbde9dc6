"""The tables of the studies, one function each, from what the studies return."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from host.sysid.models.diagnostics import GRADES

from studies.accuracy import Accuracy
from studies.coverage import Coverage
from studies.imported_logs import Estimate, rows
from studies.methods import Score
from studies.refusal import Agreement, Repeated, agreement_text
from studies.study_table import Table
from studies.thesis import HopfieldRun
from studies.turbulence import GustCase
from studies.windows import LIMIT_WHOLE, Compared


def thesis_table(
    runs: Sequence[HopfieldRun],
    seeds: Sequence[Repeated],
    found: Sequence[Agreement],
) -> Table:
    """Return table 3.2 re-run; what is refused of table 3.1 and others goes below it."""
    first = seeds[0].checks[0]
    over = ", ".join(
        f"{name} {100.0 * share:.0f} %"
        for name, share in zip(first.names, first.shares, strict=True)
        if name in first.expected
    )
    graded = "; ".join(
        f"{grade}: {' '.join(first.judgement.names(grade)) or 'none'}" for grade in GRADES
    )
    return Table(
        "Tables 3.1 and 3.2 of the thesis re-run",
        (
            "input, rate, step",
            "iterations",
            "seconds",
            "parameter error %",
            "printed figure %",
            "relative error per state %",
        ),
        tuple(
            (
                run.what,
                run.iterations,
                run.seconds,
                "diverged" if run.diverged else 100.0 * run.frobenius,
                run.thesis_percent,
                run.honest_percent,
            )
            for run in runs
        ),
        f"Table 3.1 at SNR 10, noise seed 1: {graded}.\n\n"
        f"Analytic bounds above 100 %: {over}.\n\n"
        + "\n\n".join(f"{one.text[0].upper()}{one.text[1:]}." for one in seeds)
        + "\n\n"
        + "\n\n".join(f"{agreement_text(one).capitalize()}." for one in found),
    )


def accuracy_table(cases: Sequence[Accuracy]) -> Table:
    """Return errors of three methods and error over bound, a row per input and rate."""
    return Table(
        "NAVION at SNR 10: error of three methods, and error over Cramer-Rao bound",
        (
            "input", "rate Hz", "runs", "failed",
            "Hopfield, its 20 %", "Hopfield, the 9 %", "smoothed rates %", "output error %",
            "ratio of 20", "ratio of 9", "ratio smoothed",
            "rms/bound least", "rms/bound mean", "rms/bound most",
        ),
        tuple(
            (
                c.shape, c.rate_hz, c.runs, c.failed,
                100.0 * c.hopfield_error, 100.0 * c.hopfield_shared,
                100.0 * c.smoothed_error, 100.0 * c.output_error,
                c.ratio, c.shared_ratio, c.smoothed_ratio,
                float(c.rms_over_bound.min()), float(c.rms_over_bound.mean()),
                float(c.rms_over_bound.max()),
            )
            for c in cases
        ),
        "Errors are medians over runs and parameters. rms(error/bound) of a perfect estimator"
        f" scatters by {100.0 / np.sqrt(2.0 * cases[0].runs):.1f} % over {cases[0].runs} runs.",
    )  # fmt: skip


def coverage_table(cases: Sequence[Coverage]) -> Table:
    """Return coverage and width of the default intervals, a row per noise and rate."""
    return Table(
        "Coverage of the default 95 % intervals; the code does not get the noise",
        (
            "noise", "rate Hz", "runs", "failed", "pooled %", "lowest %", "of", "highest %",
            "width/known median", "width/known most", "pooled %, taken for white",
        ),
        tuple(
            (
                c.noise, c.rate_hz, c.runs, c.failed, 100.0 * c.pooled,
                100.0 * float(c.covered.min()), c.names[int(c.covered.argmin())],
                100.0 * float(c.covered.max()),
                float(np.median(c.width_ratio)), float(c.width_ratio.max()),
                100.0 * float(np.mean(c.white_covered)),
            )
            for c in cases
        ),
        "Width is compared with the same model fitted with the true noise covariance.",
    )  # fmt: skip


def turbulence_table(cases: Sequence[GustCase]) -> Table:
    """Return errors in gusts, a row per case and coefficient."""
    rows = []
    for c in cases:
        for k, name in enumerate(c.names):
            rows.append(
                (
                    f"{c.intensity_mps} m/s", "pilot" if c.pilot else "open loop", name,
                    100.0 * float(c.filter_rms[k]), 100.0 * float(c.output_rms[k]),
                    100.0 * float(c.bound[k]),
                    float(c.output_rms[k] / c.filter_rms[k]),
                    float(c.filter_rms[k] / c.bound[k]),
                    100.0 * float(c.filter_mean[k]), 200.0 * float(c.filter_scatter[k]),
                    100.0 * float(c.output_mean[k]),
                    100.0 * c.filter_covered, 100.0 * c.output_covered,
                    "yes" if c.close[k] and c.unbiased[k] else "NO",
                )
            )  # fmt: skip
    failed = sum(c.failed for c in cases)
    return Table(
        "Filter error against output error, Ultra Stick 25e in Dryden gusts, "
        + ("non-linear as it is" if cases[0].nonlinear else "linear"),
        (
            "gust", "loop", "coefficient", "rms filter error %", "rms output error %", "bound %",
            "output/filter", "filter/bound", "mean filter error %", "two standard errors %",
            "mean output error %", "coverage filter error %", "coverage output error %", "holds",
        ),
        tuple(rows),
        f"{cases[0].flights} flights a case, {failed} failed fits. Bound: of the stochastic model"
        " with turbulence and sensor noise known, on the linear aircraft. Coverage of 95 %"
        " intervals is pooled over the six coefficients of a case. Holds: error at most a third of"
        " output error's or 1.3 bounds, and mean error at most 3 % and two standard errors.",
    )  # fmt: skip


def methods_table(scores: Sequence[Score]) -> Table:
    """Return every method on every data set."""
    return Table(
        "Every method on the same five data sets (NAVION, nine derivatives)",
        (
            "method", "data", "runs", "failed", "median error %", "median half-width %",
            "coverage %", "ms",
        ),
        tuple(
            (
                s.method, s.data, s.runs, s.failed, 100.0 * s.error, 100.0 * s.half_width,
                100.0 * s.covered, 1e3 * s.seconds,
            )
            for s in scores
        ),
    )  # fmt: skip


def windows_table(cases: Sequence[Compared]) -> Table:
    """Return errors from found windows and from the whole record, a row per case and parameter."""
    return Table(
        "Found windows against the whole record",
        (
            "case", "parameter", "flights", "failed", "missed", "rms from windows",
            "rms from the whole", "windows/whole", "covered from windows %",
            "covered from the whole %", "half-width of the whole", "holds",
        ),
        tuple(
            (
                c.label, name, c.flights, c.failed, c.missed, float(c.found_rms[k]),
                float(c.whole_rms[k]), float(c.ratio[k]), 100.0 * float(c.found_held[k]),
                100.0 * float(c.whole_held[k]), float(c.whole_half[k]),
                "yes" if c.ratio[k] <= LIMIT_WHOLE else "NO",
            )
            for c in cases
            for k, name in enumerate(c.names)
        ),
        "Errors of linear records are in Cramer-Rao bounds of the whole record, those of cards over"
        " the truth. Missed: flights without a window.",
    )  # fmt: skip


def imported_table(found: Sequence[Estimate]) -> Table:
    """Return the estimates from each log of the same flights, a row per format and airframe."""
    return Table(
        "The same flights as our logger, PX4 and ArduPilot had logged them",
        (
            "log", "estimated", "held %", "agrees with the own log %",
            "half-width over the own log's", "median error %",
        ),
        tuple(rows(list(found))),
        "Nine principal coefficients of each flight (eight with elevons). Held: the 95 % interval"
        " holds the truth. Agrees: differs from our own log's by less than the joint interval."
        " Imports have no vanes; errors of their sensors and servos are in every interval.",
    )  # fmt: skip
