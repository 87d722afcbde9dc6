"""How soon is a changed aircraft noticed, and its cause named? At the level of estimates.

Eight flights say what an aircraft is; then something changes by so many standard deviations of one
flight's estimate, along the cause's own pattern. All causes are tested together at every flight.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from host.arrays import Array
from host.fleet.statistics.change_causes import cause_patterns
from host.fleet.statistics.changes import BASELINE, THRESHOLD, ChangeTest

FIRST_SEED = 21_000
# Of an Ultra Stick 25e, and standard deviations as one demonstration flight has them.
USUAL = {
    "CL_alpha": 4.6, "CL_q": 7.9, "CL_de": 0.56, "Cm_alpha": -1.75, "Cm_q": -11.4, "Cm_de": -1.3,
    "CY_beta": -0.83, "CY_r": 0.3, "CY_dr": 0.19, "Cl_beta": -0.06, "Cl_p": -0.45, "Cl_da": -0.17,
    "Cn_beta": 0.09, "Cn_r": -0.13, "Cn_dr": -0.09,
}  # fmt: skip
SHARES = (
    0.03, 0.12, 0.08, 0.04, 0.06, 0.04, 0.06, 0.4, 0.1, 0.1, 0.04, 0.04, 0.05, 0.08, 0.05,
)  # fmt: skip
CHORD_OVER_SPAN = 0.2
LATER = 3  # flights within which an alarm shall come
SHIFTS = (1.0, 2.0, 3.5, 5.0)


@dataclass(frozen=True, slots=True)
class Found:
    """Shares of aircraft: alarm within three flights, and the true cause named first."""

    alarmed: float
    named: float


def patterns() -> dict[str, Array]:
    """Return the patterns of all causes."""
    return cause_patterns(tuple(USUAL), USUAL, CHORD_OVER_SPAN)


def covariance() -> Array:
    """Return a flight's own covariance: derivatives of an equation go together."""
    sd = np.abs(np.array(list(USUAL.values()))) * np.array(SHARES)
    rows = np.array([name.partition("_")[0] for name in USUAL])
    correlation = np.where(rows[:, None] == rows, 0.3, 0.0)
    np.fill_diagonal(correlation, 1.0)
    return correlation * np.outer(sd, sd)


def power(cause: str, shift: float, aircraft: int, seed: int) -> Found:
    """Return how a change is noticed: `shift` in standard deviations along the cause's pattern."""
    rng, own, shapes = np.random.default_rng(seed), covariance(), patterns()
    test = ChangeTest(shapes, np.zeros(len(own)))
    size = shift / np.sqrt(shapes[cause] @ np.linalg.solve(own, shapes[cause]))
    root, usual = np.linalg.cholesky(own), np.array(list(USUAL.values()))
    alarmed = named = 0
    for _ in range(aircraft):
        values = usual + rng.standard_normal((BASELINE + LATER, len(usual))) @ root.T
        values[BASELINE:] += size * shapes[cause]
        found = test.alarms(list(values), [own] * len(values))
        alarmed += bool(found)
        named += bool(found) and found[0].cause == cause
    return Found(alarmed / aircraft, named / max(alarmed, 1))


def false_alarms(aircraft: int, flights: int, seed: int) -> float:
    """Return alarms a hundred flights of unchanged aircraft; after one a baseline begins anew."""
    rng, own = np.random.default_rng(seed), covariance()
    test = ChangeTest(patterns(), np.zeros(len(own)))
    root, alarms = np.linalg.cholesky(own), 0
    for _ in range(aircraft):
        values = rng.standard_normal((BASELINE + flights, len(own))) @ root.T
        found = test.alarms(list(values), [own] * len(values))
        alarms += _beginnings([a.flight for a in found])
    return 100.0 * alarms / (aircraft * flights)


def _beginnings(flights: Sequence[int]) -> int:
    """Return how many alarms begin: flights after one another are one alarm."""
    return sum(f - 1 not in flights for f in flights)


def table(aircraft: int, seed: int) -> Iterator[str]:
    """Yield false alarms, then the power of each cause."""
    each = max(aircraft // 2, 5)
    yield f"threshold {THRESHOLD:g}; unchanged, {each} aircraft of 40 flights:" + (
        f" {false_alarms(each, 40, seed):.2f} alarms a hundred flights"
    )
    yield f"alarm within {LATER} flights, of these the cause named first ({aircraft} aircraft)"
    yield "cause                       " + "".join(f"  {s:6.1f} sd     " for s in SHIFTS)
    for cause in patterns():
        found = [power(cause, s, aircraft, seed + 1 + k) for k, s in enumerate(SHIFTS)]
        cells = "".join(f"  {100 * f.alarmed:4.0f} % {100 * f.named:4.0f} %" for f in found)
        yield f"{cause:28s}{cells}"


def main(arguments: list[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m studies.fleet_changes", description=__doc__)
    parser.add_argument("--aircraft", type=int, default=200, metavar="N", help="of each cause")
    parser.add_argument("--first", type=int, default=FIRST_SEED, metavar="SEED")
    args = parser.parse_args(arguments)
    for line in table(args.aircraft, args.first):
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
