"""What surfaces drive of an identity: how far it is broken there, and by which factor of a column.

Gusts turn the wind angles and change the speed as no rate and no force says. What surfaces drove
has none of them: they and their past are instruments (Ljung, System Identification, sec. 7.6), and
whatever of the identity they still explain breaks it. Each factor is put to that test (Anderson and
Rubin, 1949) in place of an estimate of it: where surfaces drive little, every factor passes, where
an estimate would be near to that of the gusts. The past of what is left whitens it, so pilots who
answer gusts prove nothing either.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, chdtri

from host.arrays import Array
from host.constants import CERTAIN_SD
from host.sysid.checks.identity_factors import LARGEST_FACTOR, RIGHT_SHARE, Identity
from host.sysid.numerics.first_order_filter import first_order_filter

PAST_STEPS = 6  # of what is left, that tell the next
LAGS_STEPS = (0.0, 1.5, 4.0, 10.0, 30.0, 100.0)  # of first order, behind a surface
ROWS_EACH = 8  # for each number that is fitted: with fewer it explains gusts too
SENSOR_DELAY_S = 0.03  # of right sensors, one deviation
REPEATS = 1e-10  # of the largest on a triangle's diagonal: the past may repeat itself
SHORTEST_S = 19.0  # of 20 with its ends: a trend of a shorter record is explained by chance
CERTAIN = CERTAIN_SD**2  # of a chi-square of one unknown
LIKELIER = 1.0  # of the same, one deviation: below it two units are alike
CERTAIN_P = float(chdtrc(1, CERTAIN))  # the same, as what chance exceeds
RIGHT = (1.0 / LARGEST_FACTOR, 1.0, LARGEST_FACTOR)
TRIED = tuple(10.0 ** (0.1 * k) for k in range(-20, 21))


@dataclass(frozen=True, slots=True)
class DrivenFactor:
    """Ratio of a column's motion to what another says, in what surfaces drive.

    It is certain not to be one: the likeliest value, and how far it leaves the identity broken.
    """

    law: Identity
    name: str
    slope: float
    misfit: float


@dataclass(frozen=True, slots=True)
class _Seen:
    """A signal and its past: along what surfaces explain at most, and all else of it.

    All else is held in an orthonormal basis that the signals of one identity share: sums of
    squares are all that is asked of it, for hundreds of factors.
    """

    along: Array  # (instruments, past + 1)
    rest: Array  # (signals times past + 1, past + 1)

    def plus(self, factor: float, other: _Seen) -> _Seen:
        """Return the sum with another signal, so many times."""
        return _Seen(self.along + factor * other.along, self.rest + factor * other.rest)


class DrivenTest:
    """An identity before its instruments: rate, parts and errors of right sensors."""

    def __init__(self, law: Identity) -> None:
        columns = [_lagged(u, lag)[PAST_STEPS:] for u in law.inputs for lag in LAGS_STEPS]
        own = np.column_stack([np.ones(len(law.rate)), *law.auxiliary])[PAST_STEPS:]
        self._own = _basis(own)
        self._basis = _basis(_off(np.column_stack(columns), self._own))
        self.instruments = self._basis.shape[1]
        values = [law.rate, *law.parts.values(), *law.terms.values()]
        self.rate, *seen = self._together(values)
        self.parts = dict(zip(law.parts, seen, strict=False))
        self.terms = dict(zip(law.terms, seen[len(law.parts) :], strict=True))
        self._delayed = []
        for name, one in (("", law.rate), *law.parts.items()):
            delay_s = law.delays_s.get(name, SENSOR_DELAY_S)
            self._delayed.append(self._split(delay_s * np.gradient(one, law.step_s))[0])
        self._errors = [self._split(error)[0] for error in law.sensors]

    def misfit(self) -> float:
        """Return how many deviations squared what surfaces explain of the identity is from none."""
        return float(self.misfits("", [1.0])[0])

    def misfits(self, scaled: str, factors: Sequence[float] | Array) -> Array:
        """Return the same where a part, or a term of one, counts so many times, one a factor.

        It has no scale as well then.
        """
        return _squared(*self._explained(scaled, factors))

    def _explained(self, scaled: str, factors: Sequence[float] | Array) -> tuple[Array, Array]:
        """Return what surfaces explain of the identity, (factors, instruments), and its covariance.

        One stacked factorisation for all factors: a table with a wrong unit asks for 100 000.
        """
        left = self.rate
        for part in self.parts.values():
            left = left.plus(-1.0, part)
        more = (1.0 - np.asarray(factors))[:, None, None]
        added = (self.parts | self.terms)[scaled] if scaled else left
        along = left.along + more * added.along
        weights, squares = _whitening(left.rest + more * added.rest)
        free = len(self._own) - PAST_STEPS - self._own.shape[1] - self.instruments
        variance = squares / free
        variance += RIGHT_SHARE**2 * np.mean((weights @ self.rate.along.T) ** 2, axis=1)
        unscaled = [part for name, part in self.parts.items() if name != scaled]
        unscaled += [] if scaled else [self.rate]
        errors = [RIGHT_SHARE * one.along for one in unscaled]
        errors += [*self._errors, *self._delayed]
        error = weights @ np.stack(errors).transpose(0, 2, 1)  # (errors, factors, instruments)
        covariance = np.einsum("efi,efj->fij", error, error)
        covariance += variance[:, None, None] * np.eye(self.instruments)
        return (along @ weights[:, :, None])[:, :, 0], covariance

    def _together(self, signals: Sequence[Array]) -> list[_Seen]:
        """Return signals and their pasts, all else of them in one basis of their own."""
        split = [self._split(values) for values in signals]
        triangle = np.linalg.qr(np.column_stack([rest for _, rest in split]), mode="r")
        parts = np.split(triangle, len(split), axis=1)
        return [_Seen(along, rest) for (along, _), rest in zip(split, parts, strict=True)]

    def _split(self, values: Array) -> tuple[Array, Array]:
        """Return a signal and its past along the instruments, and all else of it row by row."""
        back = np.lib.stride_tricks.sliding_window_view(values, PAST_STEPS + 1)[:, ::-1]
        back = _off(back, self._own)
        along = self._basis.T @ back
        return along, back - self._basis @ along


def driven_misfit(law: Identity) -> float | None:
    """Return how many deviations squared surfaces break an identity; None where none moved."""
    return DrivenTest(law).misfit() if testable(law) else None


def driven_test(law: Identity) -> DrivenTest | None:
    """Return the test of an identity; None where no surface swings as a test input does."""
    return DrivenTest(law) if law.driven and testable(law) else None


def driven_factors(law: Identity, test: DrivenTest) -> Iterator[DrivenFactor]:
    """Return the factors that must be another than one, of those that explain the motion best."""
    least = test.misfit()
    if least < chdtri(
        test.instruments, CERTAIN_P
    ):  # weak ones would choose among factors by chance
        return
    found = []
    for name in (*law.parts, *law.terms):
        broken = _by_factor([(test, name)], (-1.0, *TRIED))
        right = float(np.min(test.misfits(name, RIGHT)))
        slope = min(broken, key=broken.__getitem__)
        least = min(least, broken[slope], right)
        if right - broken[slope] > CERTAIN:
            found.append(DrivenFactor(law, name, slope, broken[slope]))
    yield from (f for f in found if f.misfit - least < CERTAIN)


def shared_factor(tests: Sequence[tuple[DrivenTest, str]], tried: Iterable[float]) -> float | None:
    """Return the factor that parts of several identities must share; None where it may be one.

    Parameters
    ----------
    tests : sequence of (DrivenTest, str)
        Tests of identities, and the part of each that has the factor.
    tried : iterable of float
        Factors that it may be.
    """
    whole = sum(test.misfit() for test, _ in tests)
    if whole < CERTAIN:
        return None
    broken = _by_factor(tests, tuple(tried))
    slope = min(broken, key=broken.__getitem__)
    return slope if whole - broken[slope] > CERTAIN else None


def likelier_factor(
    tests: Sequence[tuple[DrivenTest, str]],
    tried: Collection[float],
    unlikely: Mapping[float, float],
) -> float | None:
    """Return the factor with which parts of several identities agree better than as they are.

    No proof: the likeliest of those tried, None where all explain less of what surfaces drive.

    Parameters
    ----------
    tests, tried
        As `shared_factor`.
    unlikely : mapping
        How many deviations squared a factor is from what is usual; empty where nobody knows.
    """
    if not tests:
        return None
    broken = {
        f: value + unlikely.get(f, 0.0) for f, value in _by_factor(tests, (1.0, *tried)).items()
    }
    slope = min(broken, key=broken.__getitem__)
    least = LIKELIER * (2.0 if unlikely else 1.0)  # what is usual is a second measure
    return slope if broken[1.0] - broken[slope] > least else None


def _by_factor(
    tests: Sequence[tuple[DrivenTest, str]], factors: Sequence[float]
) -> dict[float, float]:
    """Return how far each factor of a part of each identity leaves them broken."""
    broken = sum(test.misfits(name, factors) for test, name in tests)
    return dict(zip(factors, np.atleast_1d(broken).tolist(), strict=True))


def testable(law: Identity) -> bool:
    """Return whether a record is long enough, and a surface moved, to test an identity."""
    count = PAST_STEPS + 1 + len(law.auxiliary) + len(law.inputs) * len(LAGS_STEPS)
    long = law.step_s * len(law.rate) >= SHORTEST_S
    return long and len(law.inputs) > 0 and len(law.rate) - PAST_STEPS >= ROWS_EACH * count


def _whitening(signals: Array) -> tuple[Array, Array]:
    """Return weights of signals and their pasts that leave the least, and how much that is.

    Parameters
    ----------
    signals : Array, shape (factors, rows, past + 1)
        The present first.

    Returns
    -------
    Array, shape (factors, past + 1)
        One, and minus what the past tells of the present.
    Array, shape (factors,)
        Sum of squares that is left.
    """
    triangle: Array = np.asarray(np.linalg.qr(np.roll(signals, -1, axis=2), mode="r"))
    past, present = triangle[:, :-1, :-1], triangle[:, :-1, -1:]
    size = np.abs(np.diagonal(past, axis1=1, axis2=2))
    if np.all(size.min(axis=1) > REPEATS * size.max(axis=1)):
        beta = np.linalg.solve(past, present)[:, :, 0]
    else:
        least = np.finfo(float).eps * signals.shape[1]
        beta = (np.linalg.pinv(past, rcond=least) @ present)[:, :, 0]
    left = present[:, :, 0] - (past @ beta[:, :, None])[:, :, 0]
    squares = np.sum(left**2, axis=1) + triangle[:, -1, -1] ** 2
    return np.concatenate([np.ones((len(beta), 1)), -beta], axis=1), squares


def _squared(off: Array, covariance: Array) -> Array:
    """Return how many deviations squared values are from none, (factors,)."""
    solved = np.linalg.solve(covariance, off[:, :, None])[:, :, 0]
    return np.asarray(np.sum(off * solved, axis=1))


def _lagged(values: Array, steps: float) -> Array:
    """Return values behind a lag of first order."""
    keep = float(np.exp(-1.0 / steps)) if steps > 0.0 else 0.0
    forget, recall = np.array([1.0 - keep, 0.0]), np.array([1.0, -keep])
    return first_order_filter(forget, recall, values - np.median(values))


def _basis(columns: Array) -> Array:
    """Return orthonormal columns that span some, without those that repeat others."""
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    basis, strength, _ = np.linalg.svd(columns / size, full_matrices=False)
    return np.asarray(basis[:, strength > 1e-4 * strength[0]])


def _off(columns: Array, basis: Array) -> Array:
    """Return columns without what a basis holds of them."""
    return np.asarray(columns - basis @ (basis.T @ columns))
