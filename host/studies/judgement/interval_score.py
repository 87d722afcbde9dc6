"""Right, wrong and the interval score of one parameter of one flight.

Gneiting & Raftery, Strictly proper scoring rules, JASA 102 (2007), eq. 43: width of the interval
and 2 / 0.05 of what the truth lies beyond it. A narrow interval that holds scores least.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from host.arrays import Array, BoolArray
from host.sysid.answer import CAREFUL, MARKS, TRUSTED

from studies.judgement.judged_rows import MODE, PRINCIPAL

BEYOND = 2.0 / 0.05
RIGHT, FAR = 0.10, 0.30  # error: of a right parameter at most; that is wrong under care
SMALL = MARKS[2]


@dataclass(frozen=True, slots=True)
class Judged:
    """Parameters of flights of one world, each (n,).

    Attributes
    ----------
    flight : Array
        Seeds.
    name : Array
        Name of each parameter.
    principal : Array
        Whether it is one of the nine.
    error : Array
        |estimate - truth| over |truth|, or over 5 % of the row; NaN of what is missing.
    width : Array
        Half-width over the same; NaN of what is missing.
    trusted, careful, answered : Array
        Under "trust"; under "use with care", a small one too; with an interval.
    """

    flight: Array
    name: Array
    principal: BoolArray
    error: Array
    width: Array
    trusted: BoolArray
    careful: BoolArray
    answered: BoolArray

    @property
    def relied(self) -> BoolArray:
        """Whether the answer says that it may be relied on."""
        return np.asarray(self.trusted | self.careful)

    @property
    def right(self) -> BoolArray:
        """Whether the error is at most 10 %."""
        return np.asarray(self.error <= RIGHT)

    @property
    def wrong(self) -> BoolArray:
        """Whether it is under a mark that it should not be under."""
        far = self.careful & (self.error > FAR)
        return np.asarray(self.trusted & (self.error > RIGHT) | far)

    @property
    def holds(self) -> BoolArray:
        """Whether the interval holds the truth."""
        return np.asarray(self.error <= self.width)

    def score(self) -> Array:
        """Return the relative interval score; what is not relied on counts as +-100 %."""
        own = interval_score(self.error, self.width)
        return np.asarray(np.where(self.relied, own, 2.0))


def interval_score(error: Array, half_width: Array) -> Array:
    """Return the score of intervals by error and half-width in one unit."""
    return np.asarray(2.0 * half_width + BEYOND * np.maximum(error - half_width, 0.0))


def judged(rows: Sequence[Mapping[str, str]]) -> Judged:
    """Return rows of one world, as `judged_rows` makes them, as arrays."""
    rows = [r for r in rows if r["mark"] != MODE]
    true, estimate, half, reference = (
        np.array([float(r[k] or "nan") for r in rows])
        for k in ("true", "estimate", "half_width", "reference")
    )
    marks = [r["mark"] for r in rows]
    reference = np.maximum(reference, 1e-300)
    # A small one is known only where the true one is small, too.
    small = np.array([m == SMALL for m in marks]) & (reference > np.abs(true) * (1.0 + 1e-9))
    return Judged(
        flight=np.array([int(r["seed"]) for r in rows]),
        name=np.array([r["name"] for r in rows]),
        principal=np.array([r["name"] in PRINCIPAL for r in rows]),
        error=np.abs(estimate - true) / reference,
        width=half / reference,
        trusted=np.array([m == TRUSTED for m in marks]),
        careful=np.array([m == CAREFUL for m in marks]) | small,
        answered=np.isfinite(half),
    )
