"""Test whether surfaces that lag behind their columns move the coefficients of a moment.

The spectrum of the residual is what weighs it: an unknown lag makes it large where the lag acts,
and passes for noise. With 50 ms of it Cm_alpha, Cm_de and Cl_p err by 42 to 55 %, known to 4. To
first order a lag is the slope of a surface, one more column next to the terms of an equation: how
it moves them says whether it matters, a one-sided test whether it is there: a surface ahead of its
column is no lag (the demonstration's aileron seems 5 ms early, by 3 deviations). Instrumental
variables keep gusts out: by least squares Cl_p of a right flight in 0.5 m/s is accused.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy import special

from host.arrays import Array
from host.constants import SIGNIFICANCE
from host.sysid.coefficients.coefficient_fit import Derivative
from host.sysid.coefficients.coefficient_intervals import SearchResult
from host.sysid.coefficients.equation_blocks import EquationBlock
from host.sysid.coefficients.window_spectra import equation_weight

MOMENTS = ("Cl", "Cm", "Cn")
SURFACES = ("de", "da", "dr")


def lagging_moments(
    searches: Sequence[SearchResult], derivatives: Sequence[Derivative]
) -> tuple[str, ...]:
    """Return the moments of which a lag of surfaces moves a coefficient beyond its interval.

    To first order the shift is too small to be a width: of a lag of 50 ms it put Cm_alpha, 46 %
    off, at +- 19 %.

    Parameters
    ----------
    searches : sequence of SearchResult
        Search of each flight: one that shows it is enough.
    derivatives : sequence of Derivative
        Derivatives of all flights.
    """
    half = {d.name: d.half_width for d in derivatives}
    significant = {d.name: d.value for d in derivatives if abs(d.value) > d.half_width}
    return tuple(
        equation
        for equation in MOMENTS
        if any(
            abs(shift) > half[name] > 0.0
            for search in searches
            for name, shift in _shifts(search, equation, significant).items()
            if name in half
        )
    )


def _shifts(search: SearchResult, equation: str, known: Mapping[str, float]) -> dict[str, float]:
    """Return how each coefficient of an equation moves, if a surface that it tells lags."""
    labels = [term.label for _, of, term in search.problem.model.named() if of == equation]
    moved = [k for k, label in enumerate(labels) if label in SURFACES]
    blocks = [b for b in search.final.blocks if b.equation == equation]
    if not moved or not blocks:
        return {}
    count = len(labels)
    terms, instruments = _term_columns(blocks, count)
    lags = np.vstack([_lag_columns(search, b, moved) for b in blocks])
    left = np.concatenate([b.residual_after(search.final.solution.step) for b in blocks])
    alone, _ = _instrumented(terms, instruments, left)
    wide, ours = np.hstack([terms, lags]), np.hstack([instruments, lags])
    with_lags, covariance = _instrumented(wide, ours, left)
    freedom = len(left) - wide.shape[1] - sum(b.trend_basis.shape[1] for b in blocks)
    noise = float(np.sum((left - wide @ with_lags) ** 2)) / max(freedom, 1)
    deviation = np.sqrt(noise * np.diag(covariance)[count:])
    signs = np.sign([known.get(f"{equation}_{labels[k]}", 0.0) for k in moved])
    if not _late(-signs * with_lags[count:], deviation, freedom):
        return {}
    shift = with_lags[:count] - alone
    return {f"{equation}_{label}": float(s) for label, s in zip(labels, shift, strict=True)}


def _term_columns(blocks: Sequence[EquationBlock], count: int) -> tuple[Array, Array]:
    """Return the terms of an equation in all blocks and their instruments, without trends."""
    terms = np.vstack([b.without_trend(b.A[:, :count]) for b in blocks])
    instruments = np.vstack([b.without_trend(b.Z[:, :count]) for b in blocks])
    return terms, instruments


def _late(slopes: Array, deviation: Array, freedom: int) -> bool:
    """Return whether a surface comes later than its column, by a one-sided test of all.

    The slope of a surface that comes later has the other sign.
    """
    largest = float(np.max(slopes / np.maximum(deviation, 1e-300)))
    chance = len(slopes) * special.stdtr(freedom, -largest)
    return freedom >= 1 and not chance > SIGNIFICANCE


def _instrumented(columns: Array, instruments: Array, left: Array) -> tuple[Array, Array]:
    """Return the estimate by instrumental variables, and its covariance in unit noise."""
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    inverse = np.linalg.pinv((instruments / size).T @ (columns / size))
    spread = inverse @ (instruments / size).T
    return spread @ left / size, (spread @ spread.T) / np.outer(size, size)


def _lag_columns(search: SearchResult, block: EquationBlock, moved: Sequence[int]) -> Array:
    """Return the slopes of surfaces in one block, weighted as it is, (2 F, surfaces)."""
    window = search.problem.windows[block.window]
    frequency_hz = window.frequency_hz
    weight = equation_weight(frequency_hz, search.final.noise.get(block.equation))
    spectrum = search.final.spectra[block.equation, block.window][:, [1 + k for k in moved]]
    slope = spectrum * (2j * np.pi * frequency_hz * weight)[:, None]
    return block.without_trend(np.concatenate([slope.real, slope.imag]))
