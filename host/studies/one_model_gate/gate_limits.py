"""The limits of the gate, stated before the first run, and the table of what they say.

Scores are `interval_score`'s over the scale of `make judgement`, paired by flight. A flight that
does not converge has no estimates, so each counts as +-100 %.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from host.arrays import Array

from studies.judgement.interval_score import Judged, judged
from studies.judgement.scaled_figures import MOST, read_scales
from studies.one_model_gate.gate_cells import CELLS, Cell

LEAST_COVERAGE = 90.0  # %, pooled over all cells
MOST_SCORE = 0.8  # pooled, of that of coefficients
MOST_OF_A_CELL, ERRORS_ABOVE = 1.0, 2.0  # standard errors
BIAS_ERRORS, BIAS_SHARE = 3.0, 0.25  # standard errors, and share of the median half-width
MOST_CPU_S, OF_S = 20.0, 120.0  # processor time for two minutes of maneuvers
FLOWN_S = {"trainer": 100.0, "flying wing": 100.0, "real records": 100.0, "twin": 120.0}
DRAWS, SEED = 1000, 51
Rows = Sequence[Mapping[str, str]]


def lines(own: Mapping[str, Rows], other: Mapping[str, Rows]) -> Iterator[str]:
    """Return the table and the verdict.

    Parameters
    ----------
    own, other : mapping
        Rows of each cell, of the method on trial and of coefficients, of the same flights.
    """
    yield "| cell | flights | coverage % | score | of coefficients | ratio | +- | s CPU | |"
    yield "| --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    failed: list[str] = []
    mine: list[Array] = []
    theirs: list[Array] = []
    held: list[Judged] = []
    for name, rows in own.items():
        cell, trial, standard = CELLS[name], judged(rows), judged(other[name])
        a, b = (_by_flight(cell, x) for x in (trial, standard))
        ratio = float(a.mean() / b.mean())
        error = _ratio_error(a, b)
        holds = 100.0 * _coverage(trial)
        seconds = float(np.median([float(r["cpu_s"]) for r in rows])) * OF_S / FLOWN_S[cell.world]
        missed = []
        if ratio - ERRORS_ABOVE * error > MOST_OF_A_CELL:
            missed.append("score")
        if seconds > MOST_CPU_S:
            missed.append("time")
        failed += [f"{name}: {m}" for m in missed]
        mine, theirs, held = [*mine, a], [*theirs, b], [*held, trial]
        yield (
            f"| {name} | {len(a)} | {holds:.1f} | {a.mean():.2f} | {b.mean():.2f} | {ratio:.2f}"
            f" | {error:.2f} | {seconds:.1f} | {' '.join(missed)} |"
        )
    pooled = float(np.mean([x.mean() for x in mine]) / np.mean([x.mean() for x in theirs]))
    coverage = 100.0 * float(np.mean([_coverage(x) for x in held]))
    yield f"pooled: coverage {coverage:.1f} %, score {pooled:.3f} of that of coefficients"
    if coverage < LEAST_COVERAGE:
        failed.append(f"coverage below {LEAST_COVERAGE:g} %")
    if pooled > MOST_SCORE:
        failed.append(f"score above {MOST_SCORE:g}")
    failed += _mean_errors(own)
    yield f"the gate is {'passed' if not failed else 'not passed: ' + '; '.join(failed)}"


def _by_flight(cell: Cell, own: Judged) -> Array:
    """Return the mean scaled score of each flight."""
    scale = read_scales()[cell.scale]
    score = own.score() / np.array([scale[n] for n in own.name])
    return np.array([score[own.flight == seed].mean() for seed in np.unique(own.flight)])


def _coverage(own: Judged) -> float:
    """Return the share of intervals that hold; what is missing counts as +-100 % and holds."""
    return float(np.mean(own.holds | ~own.answered))


def _ratio_error(a: Array, b: Array) -> float:
    """Return the standard error of a ratio of means, flights drawn anew with replacement."""
    drawn = np.random.default_rng(SEED).integers(0, len(a), (DRAWS, len(a)))
    return float(np.std(a[drawn].mean(axis=1) / b[drawn].mean(axis=1)))


def _mean_errors(own: Mapping[str, Rows]) -> Iterator[str]:
    """Return the parameters of a world whose mean error is too large."""
    for world in dict.fromkeys(CELLS[name].world for name in own):
        rows = [
            r for n, of in own.items() if CELLS[n].world == world for r in of if r["half_width"]
        ]
        for name in dict.fromkeys(r["name"] for r in rows if r["mark"] != "mode"):
            mine = [r for r in rows if r["name"] == name]
            size, estimate, true, half = (
                np.array([float(r[k]) for r in mine])
                for k in ("reference", "estimate", "true", "half_width")
            )
            size = np.maximum(size, 1e-300)
            error, half = (estimate - true) / size, half / size
            error = np.clip(error, -MOST, MOST)
            mean, sd = float(error.mean()), float(error.std(ddof=1)) if len(error) > 1 else np.inf
            limits = BIAS_ERRORS * sd / np.sqrt(len(error)), BIAS_SHARE * float(np.median(half))
            if abs(mean) > max(limits):
                yield f"{world}: mean error of {name} {100.0 * mean:+.1f} %"
