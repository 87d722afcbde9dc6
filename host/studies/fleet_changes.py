"""How soon is a changed aircraft noticed, and its cause named? At the level of estimates.

Fleets of 12 aircraft: eight flights say what each is, and all of them how much flights of an
unchanged aircraft differ. Then something changes in one of them by so many standard deviations of
one flight's estimate (estimation and flight to flight), along the cause's own pattern. All causes
are tested together at every flight.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from host.arrays import Array
from host.fleet.statistics.change_causes import CG, RARE, THROW, cause_patterns
from host.fleet.statistics.changes import BASELINE, THRESHOLD, ChangeTest
from host.fleet.statistics.loaded_flight import LoadedFlight
from host.fleet.statistics.watched_quantities import flight_spread

FIRST_SEED = 22_400
# Coefficients of an Ultra Stick 25e, and standard deviations as one demonstration flight has them.
USUAL = {
    "CL_alpha": 4.6, "CL_q": 7.9, "CL_de": 0.56, "Cm_alpha": -1.75, "Cm_q": -11.4, "Cm_de": -1.3,
    "CY_beta": -0.83, "CY_r": 0.3, "CY_dr": 0.19, "Cl_beta": -0.06, "Cl_p": -0.45, "Cl_da": -0.17,
    "Cn_beta": 0.09, "Cn_r": -0.13, "Cn_dr": -0.09,
}  # fmt: skip
SHARES = (
    0.03, 0.12, 0.08, 0.04, 0.06, 0.04, 0.06, 0.4, 0.1, 0.1, 0.04, 0.04, 0.05, 0.08, 0.05,
)  # fmt: skip
# What no derivative shows, with deviations as half a minute of flight has them.
ZEROS = {"alpha_zero_rad": (0.004, 0.0016), "beta_zero_rad": (0.0, 0.0021)}
POTS = {
    f"{surface}{what}": pair
    for surface in ("elevator", "aileron", "rudder")
    for what, pair in {"_slope": (1.07e-3, 1.1e-5), "_lag_s": (0.0165, 8e-4)}.items()
}
COMMANDS = {"servo_lag_s": (0.02, 2e-3)}
CHORD_OVER_SPAN = 0.2
FLEET = 12  # aircraft
SPREAD = 0.5  # between flights, of the deviation of one flight's estimate
WITHIN = 3  # flights within which an alarm shall come
SHIFTS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 5.0)
ASKED = 3.5  # from there on an alarm shall come in 90 %


@dataclass(frozen=True)
class Watched:
    """What is known of every flight of a kind of fleet: with pots, or with commands only."""

    pots: bool = True
    usual: dict[str, float] = field(init=False)
    own: Array = field(init=False)

    def __post_init__(self) -> None:
        more = ZEROS | (POTS if self.pots else COMMANDS)
        object.__setattr__(
            self, "usual", USUAL | {name: value for name, (value, _) in more.items()}
        )
        own = np.diag([0.0] * len(USUAL) + [sd**2 for _, sd in more.values()])
        own[: len(USUAL), : len(USUAL)] = covariance()
        object.__setattr__(self, "own", own)

    @property
    def full(self) -> Array:
        """Covariance of one flight's estimate, flight to flight with it."""
        return np.asarray(self.own + SPREAD**2 * np.diag(np.diag(self.own)))

    def patterns(self) -> dict[str, Array]:
        """Return the patterns of all causes."""
        return cause_patterns(tuple(self.usual), self.usual, CHORD_OVER_SPAN)

    def random_estimates(self, rng: np.random.Generator, flights: int) -> Array:
        """Return the estimates of flights of an unchanged aircraft, (flights, P)."""
        noise = rng.standard_normal((flights, len(self.usual)))
        return np.array(list(self.usual.values())) + noise @ np.linalg.cholesky(self.full).T

    def test(self, first: Sequence[Array]) -> ChangeTest:
        """Return the test whose spread between flights the aircraft's first flights tell."""
        names = tuple(self.usual)
        none = np.zeros((0, len(names)))
        flights = [
            LoadedFlight(f"N{k}", names, row, self.own, (), none)
            for k, rows in enumerate(first)
            for row in rows
        ]
        spread = np.array([flight_spread(flights, n) for n in names])
        test = ChangeTest(self.patterns(), spread, RARE)
        return test.scaled([(list(rows), [self.own] * len(rows)) for rows in first])


@dataclass(frozen=True, slots=True)
class Found:
    """Shares of aircraft: alarm within three flights, and the true cause named first."""

    alarmed: float
    named: float


def patterns() -> dict[str, Array]:
    """Return the patterns of all causes over the derivatives alone."""
    return cause_patterns(tuple(USUAL), USUAL, CHORD_OVER_SPAN)


def covariance() -> Array:
    """Return the covariance of a flight's derivatives: those of an equation go together."""
    sd = np.abs(np.array(list(USUAL.values()))) * np.array(SHARES)
    rows = np.array([name.partition("_")[0] for name in USUAL])
    correlation = np.where(rows[:, None] == rows, 0.3, 0.0)
    np.fill_diagonal(correlation, 1.0)
    return correlation * np.outer(sd, sd)


def one_deviation(kind: Watched, cause: str) -> float:
    """Return the size of a change that is one standard deviation of one flight's estimate."""
    shape = kind.patterns()[cause]
    return float(1.0 / np.sqrt(shape @ np.linalg.solve(kind.full, shape)))


Fleet = tuple[list[Array], ChangeTest]  # first flights of each aircraft, and what they tell


def unchanged(kind: Watched, aircraft: int, seed: int, size: int = FLEET) -> list[Fleet]:
    """Return fleets of `size` with the first flights of so many aircraft in all."""
    rng, fleets = np.random.default_rng(seed), []
    for _ in range(-(-aircraft // size)):
        first = [kind.random_estimates(rng, BASELINE) for _ in range(size)]
        fleets.append((first, kind.test(first)))
    return fleets


def power(kind: Watched, fleets: Sequence[Fleet], cause: str, shift: float, seed: int) -> Found:
    """Return how a change is noticed: `shift` in standard deviations along the cause's pattern."""
    rng, shape = np.random.default_rng(seed), kind.patterns()[cause]
    size = shift * one_deviation(kind, cause)
    alarmed = named = count = 0
    for first, test in fleets:
        for own in first:
            values = [*own, *(kind.random_estimates(rng, WITHIN) + size * shape)]
            found = test.alarms(values, [kind.own] * len(values))
            alarmed += bool(found)
            named += bool(found) and found[0].cause == cause
            count += 1
    return Found(alarmed / count, named / max(alarmed, 1))


def false_alarms(kind: Watched, fleets: Sequence[Fleet], flights: int, seed: int) -> float:
    """Return alarms that begin in a hundred further flights of unchanged aircraft."""
    rng, alarms, count = np.random.default_rng(seed), 0, 0
    for first, test in fleets:
        for own in first:
            values = [*own, *kind.random_estimates(rng, flights)]
            found = test.alarms(values, [kind.own] * len(values))
            alarms += _beginnings([a.flight for a in found])
            count += flights
    return 100.0 * alarms / count


def _beginnings(flights: Sequence[int]) -> int:
    """Return how many alarms begin: flights after one another are one alarm."""
    return sum(f - 1 not in flights for f in flights)


def table(kind: Watched, aircraft: int, seed: int) -> Iterator[str]:
    """Yield false alarms, then the power of each cause."""
    yield "surfaces measured by pots" if kind.pots else "surfaces known by their commands"
    for size in (FLEET, 3):
        fleets = unchanged(kind, aircraft, seed + size, size)
        alarms = false_alarms(kind, fleets, 40, seed + size + 1)
        yield (
            f"threshold {THRESHOLD:g}; {aircraft} unchanged aircraft of 40 flights in fleets of"
            f" {size}: {alarms:.2f} alarms a hundred flights"
        )
    for cause, change in {CG: 0.05, f"{THROW} elevator": 0.15}.items():
        yield f"{cause} by {100 * change:g} %: {change / one_deviation(kind, cause):.1f} sd"
    yield f"alarm within {WITHIN} flights, of these the cause named first ({aircraft} aircraft)"
    yield "cause                     " + "".join(f" {s:8.1f} sd " for s in SHIFTS)
    fleets = unchanged(kind, aircraft, seed)
    for cause in kind.patterns():
        found = [power(kind, fleets, cause, s, seed + 20 + k) for k, s in enumerate(SHIFTS)]
        cells = "".join(f" {100 * f.alarmed:3.0f} %{100 * f.named:4.0f} %" for f in found)
        yield f"{cause:26s}{cells}"


def main(arguments: list[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m studies.fleet_changes", description=__doc__)
    parser.add_argument("--aircraft", type=int, default=300, metavar="N", help="of each cause")
    parser.add_argument("--first", type=int, default=FIRST_SEED, metavar="SEED")
    args = parser.parse_args(arguments)
    for line in (
        line for k, pots in enumerate((True, False))
        for line in table(Watched(pots), args.aircraft, args.first + 50 * k)
    ):  # fmt: skip
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
