"""How many times as fast one column moves as others say: the range that noise leaves.

Noise on the left of an identity takes nothing from a slope by regression, noise on its right does;
the slopes from both directions hold the factor between them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from host.arrays import Array
from host.constants import CERTAIN_SD

SIGN_CORRELATION, FACTOR_CORRELATION = 0.5, 0.25  # partial: less tells nothing of either
LARGEST_FACTOR = 1.5
RIGHT_SHARE = 0.1  # of a motion, that right sensors make of it by scale, or otherwise


@dataclass(frozen=True, slots=True)
class Identity:
    """Rate of one column, and what of it each other column must account for.

    Attributes
    ----------
    name : str
        The column that changes.
    rate : (steps,) array
        How fast.
    parts : dict
        What each other column makes of it, (steps,) each.
    terms : dict
        What single columns make of a part, (steps,) each.
    auxiliary : tuple of arrays
        What may have any factor, (steps,) each.
    opposed : float
        Correlation of its steps with those of the force that it makes: near -1 of a wind angle.
    inputs : tuple of arrays
        Surfaces that drive it, (steps,) each.
    driven : bool
        Whether one of them swings as a test input does.
    sensors : tuple of arrays
        What right sensors may add by their tilt and zero, one deviation, (steps,) each.
    delays_s : dict
        One deviation of a right sensor's delay, by the name of what is late ("" the column that
        changes).
    step_s : float
        Time between two steps.
    explained_share : float
        Share of the column's motion that the parts must account for.
    """

    name: str
    rate: Array
    parts: dict[str, Array]
    terms: dict[str, Array] = field(default_factory=dict)
    auxiliary: tuple[Array, ...] = ()
    opposed: float = 0.0
    inputs: tuple[Array, ...] = ()
    driven: bool = False
    sensors: tuple[Array, ...] = ()
    delays_s: Mapping[str, float] = field(default_factory=dict)
    step_s: float = 1.0
    explained_share: float = 0.0

    def scaled(self, name: str, factor: float) -> Identity:
        """Return the identity in which a part, or a term of one, counts so many times."""
        if name in self.parts:
            return replace(self, parts=self.parts | {name: factor * self.parts[name]})
        return replace(self, rate=self.rate - (factor - 1.0) * self.terms[name])


@dataclass(frozen=True, slots=True)
class Factor:
    """Ratio of a column's motion to what another says: the range that noise leaves."""

    law: Identity
    name: str
    low: float
    high: float
    explained: float  # share of the column's motion, of what the other parts leave

    @property
    def chance(self) -> float:
        """One deviation of the slope by noise on the left, as a share of it."""
        return float(np.sqrt((1.0 - self.explained) / (self.explained * len(self.law.rate))))

    @property
    def certain(self) -> bool:
        """Whether the sign is."""
        return self.explained >= SIGN_CORRELATION**2

    @property
    def misfit(self) -> float:
        """How many deviations squared the slope is from one; infinite if turned round.

        It is that of noise on the left: a difference of an angle has more of it than a mean rate.
        """
        if self.low <= 0.0:
            return np.inf
        spread = np.hypot(RIGHT_SHARE, 0.5 * np.log(self.high / self.low))
        return float((np.log(self.low) / spread) ** 2)


def factors(law: Identity, least: float = FACTOR_CORRELATION) -> Iterator[Factor]:
    """Return the factor of each part that is correlated with an identity, the others apart."""
    own = np.column_stack([np.ones(len(law.rate)), *law.auxiliary])
    for name, part in law.parts.items():
        others = [v for k, v in law.parts.items() if k != name]
        x, y = (without(v, np.column_stack([own, *others])) for v in (part, law.rate))
        xx, yy, xy = float(x @ x), float(y @ y), float(x @ y)
        if xx < 1e-12 * len(x) or xy == 0.0 or xy**2 < least**2 * xx * yy:
            continue
        low, high = sorted((xy / xx, yy / xy))  # noise on the left side, noise on the right
        yield Factor(law, name, low, high, xy**2 / (xx * yy))


def may_be_one(f: Factor) -> bool:
    """Return whether a factor may be one: of a speed gusts along the path leave more open."""
    if f.high < 0.0:
        return not f.certain
    chance = CERTAIN_SD * f.chance if f.law.name == "airspeed_mps" else 0.0
    within = LARGEST_FACTOR * (1.0 + chance)
    return f.low <= within and f.high >= 1.0 / within


def without(values: Array, columns: Array) -> Array:
    """Return what a regression on some columns leaves of values, (steps,)."""
    size = np.maximum(np.abs(columns).max(axis=0), 1e-12)
    beta, *_ = np.linalg.lstsq(columns / size, values, rcond=None)
    return np.asarray(values - (columns / size) @ beta)


def correlation(x: Array, y: Array) -> float:
    """Return the correlation of two signals, (steps,) each; 0 where one stands still."""
    x, y = x - x.mean(), y - y.mean()
    across = float(np.sqrt(np.sum(x**2) * np.sum(y**2)))
    return float(np.sum(x * y)) / across if across > 1e-12 * len(x) else 0.0
