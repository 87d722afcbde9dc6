"""One equation in one window: its rows over the few unknowns that move it, and sums over all.

Forty maneuvers have two hundred stretches of rows and three hundred unknowns; one stretch moves
sixty of them: its terms, its slow gusts, errors of the instrument. Normal equations are sums over
stretches, so that the matrix with a row for every frequency of a flight is never there. Constant
and slope are each stretch's own: projected out, which is what solving for them leaves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, IntArray
from host.sysid.coefficients.window_spectra import FLAT, Block, Key, degree, row_weight, used
from host.sysid.compatibility.inverse_sensor_model import Spectrum


@dataclass(frozen=True, slots=True)
class Unknowns:
    """What is solved for: coefficients of every row, slow gusts, errors of the instrument."""

    places: Mapping[str, IntArray]
    terms: int
    gusts: int
    errors: int

    @property
    def count(self) -> int:
        """How many they are."""
        return self.first_error + self.errors

    @property
    def first_error(self) -> int:
        """Where errors of the instrument begin."""
        return self.terms + self.gusts


@dataclass(frozen=True, slots=True)
class Side:
    """What rows are made of, by equation and window, (F, k) each.

    `spectra` are left side and regressors; `gusts` what slow gusts add, `slopes` how the residual
    moves with the instrument's errors: both empty as long as they are not estimated.
    """

    spectra: Mapping[Key, Spectrum]
    gusts: Mapping[Key, Spectrum]
    slopes: Mapping[Key, Spectrum]


@dataclass(frozen=True, slots=True)
class Stretch:
    """Slopes `A`, left factors `Z` and residual `y` of one equation in one window.

    Rows are real, then imaginary parts, weighted; `columns` are the unknowns that stand in `A` and
    `Z`, `lines` an orthonormal basis of constant and slope.
    """

    name: str
    window: int
    columns: IntArray
    A: Array
    Z: Array
    y: Array
    lines: Array

    def level(self, values: Array) -> Array:
        """Return rows, (rows,) or (rows, k), without constant and slope."""
        return values - self.lines @ (self.lines.T @ values)

    def left(self, step: Array) -> Array:
        """Return what a step of all unknowns leaves of the residual."""
        return self.level(self.y - self.A @ step[self.columns])


@dataclass(frozen=True, slots=True)
class Sums:
    """Normal equations: left factors times slopes, times themselves, times residuals.

    `sizes` is the diagonal of the first with constants and slopes in it: what a regressor that
    never moves is told by.
    """

    normal: Array
    meat: Array
    right: Array
    sizes: Array


def stretches(
    blocks: Sequence[Block],
    measured: Side,
    calm: Side,
    own: Mapping[str, Array],
    unknowns: Unknowns,
    noise: Mapping[str, tuple[Array, Array]],
) -> list[Stretch]:
    """Return every equation of every window, weighted.

    Parameters
    ----------
    blocks : sequence of Block
    measured, calm : Side
        Of the flight for slopes and residuals, of the gust-free one for left factors.
    own : mapping
        Coefficients of each equation so far.
    unknowns : Unknowns
    noise : mapping
        Spectra of residuals; weight is one where none is known yet.
    """
    found = []
    after = unknowns.terms
    errors = np.arange(unknowns.first_error, unknowns.count)
    for window, block in enumerate(blocks):
        for name in block.names:
            key = name, window
            kept = used(block, name)
            weight = row_weight(block.hertz[kept], noise.get(name))
            columns = [unknowns.places[name]]
            if key in measured.gusts:
                before, after = after, after + measured.gusts[key].shape[1]
                columns.append(np.arange(before, after))
            if measured.slopes:
                columns.append(errors)
            A, Z = (_real(_beside(side, key)[kept] * weight[:, None]) for side in (measured, calm))
            spectrum = measured.spectra[key]
            y = _real((spectrum[:, 0] - spectrum[:, 1:] @ own[name])[kept] * weight)
            lines = _real(block.trends[kept, : degree(name)] * weight[:, None])
            found.append(Stretch(name, window, np.concatenate(columns), A, Z, y, _basis(lines)))
    return found


def _beside(side: Side, key: Key) -> Spectrum:
    """Return columns of one stretch, (F, k)."""
    parts = [side.spectra[key][:, 1:]]
    if key in side.gusts:
        parts.append(side.gusts[key])
    if side.slopes:
        parts.append(-side.slopes[key])
    return np.hstack(parts)


def _real(values: Spectrum) -> Array:
    return np.concatenate([values.real, values.imag])


def _basis(lines: Array) -> Array:
    """Return orthonormal columns, (rows, k); what is only rounding spans nothing."""
    sizes = np.sqrt(np.einsum("ij,ij->j", lines, lines))
    there = sizes > FLAT * np.max(sizes)
    return np.linalg.qr(lines[:, there] / sizes[there])[0]


def summed(parts: Sequence[Stretch], count: int) -> Sums:
    """Return the normal equations of some stretches over all unknowns."""
    normal, meat = np.zeros((count, count)), np.zeros((count, count))
    right, sizes = np.zeros(count), np.zeros(count)
    for part in parts:
        at = np.ix_(part.columns, part.columns)
        free = part.level(part.Z)
        normal[at] += free.T @ part.A
        meat[at] += free.T @ free
        right[part.columns] += free.T @ part.y
        sizes[part.columns] += np.einsum("ij,ij->j", part.Z, part.A)
    return Sums(normal, meat, right, sizes)
