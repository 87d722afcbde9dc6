"""Do the intervals of a type's mean and spreads hold? Fleets drawn at the level of estimates.

A cell is a size of fleet and a ratio of spreads. One row a fleet goes to a file that a later run
continues.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from host.constants import NORMAL_95
from host.fleet.statistics.spread_intervals import KnownSpreads, TypeEffect, type_effect
from host.fleet.statistics.variance_components import FleetEstimates
from scipy import special

from studies.stored_rows import flown_rows, rows_file

FIRST_SEED = 20_000
AIRCRAFT = (5, 8, 12, 50)
FLIGHTS = (3, 8, 30)
RATIOS = (0.0, 0.5, 2.0)  # spread between aircraft over that between flights, which is 1
OWN = (0.5, 1.5)  # standard deviation of a flight's estimate, drawn for each
COMMON = 0.3  # of an error of each aircraft's calibration, and of one of all
UNEVEN = 0.1  # by which its loading differs from flight to flight
MEAN = 5.0
ORACLES = 100  # fleets of a cell whose oracle is asked, too: a median needs no more
QUANTITIES = ("mean", "between", "within")
COLUMNS = (
    "cell", "seed",
    *(f"{q}_{what}" for q in QUANTITIES for what in ("holds", "width", "oracle")),
    "between_lower", "within_lower",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Cell:
    """A size of fleet, and its spread between aircraft over that between flights."""

    aircraft: int
    flights: int
    ratio: float

    @property
    def name(self) -> str:
        """Name in the rows."""
        return f"{self.aircraft} x {self.flights}, {self.ratio:g}"

    @property
    def size(self) -> str:
        """Name without the ratio."""
        return f"{self.aircraft} x {self.flights}"


def cells() -> list[Cell]:
    """Return all cells."""
    return [Cell(a, f, r) for a in AIRCRAFT for f in FLIGHTS for r in RATIOS]


def random_fleet(cell: Cell, seed: int) -> FleetEstimates:
    """Return a fleet whose truth is known."""
    rng = np.random.default_rng((seed, cell.aircraft, cell.flights, int(10 * cell.ratio)))
    count = cell.aircraft * cell.flights
    codes = np.repeat(np.arange(cell.aircraft), cell.flights)
    own = np.exp(rng.uniform(np.log(OWN[0]), np.log(OWN[1]), count))
    loadings = COMMON * (1.0 + UNEVEN * rng.standard_normal((2, count)))
    value = MEAN + cell.ratio * rng.standard_normal(cell.aircraft)[codes]
    value += rng.standard_normal(count) + own * rng.standard_normal(count)
    value += loadings[0] * rng.standard_normal(cell.aircraft)[codes]
    value += loadings[1] * rng.standard_normal()
    return FleetEstimates(value, own**2, codes, loadings[0][:, None], loadings[1][:, None])


def row_of(cell: Cell, seed: int, *, oracle: bool = True) -> dict[str, object]:
    """Return which intervals of one fleet hold, and how wide an oracle's are."""
    data = random_fleet(cell, seed)
    found = type_effect(data)
    truth = dict(zip(QUANTITIES, (MEAN, cell.ratio, 1.0), strict=True))
    row: dict[str, object] = {"cell": cell.name, "seed": seed}
    oracle_effects: Mapping[str, TypeEffect] = (
        {}
        if not oracle
        else {
            "mean": type_effect(data, KnownSpreads(cell.ratio, 1.0)),
            "between": type_effect(data, KnownSpreads(within=1.0)),
            "within": type_effect(data, KnownSpreads(between=cell.ratio)),
        }
    )
    for name in QUANTITIES:
        interval = getattr(found, name)
        row[f"{name}_holds"] = int(interval.holds(truth[name]))
        row[f"{name}_width"] = interval.width
        row[f"{name}_oracle"] = getattr(oracle_effects[name], name).width if oracle else ""
    return row | {"between_lower": found.between.lower, "within_lower": found.within.lower}


def allowed(aircraft: int) -> float:
    """Return the largest median width over an oracle's that is accepted."""
    if aircraft >= 8:
        return 1.2
    return 1.1 * float(special.stdtrit(aircraft - 1, 0.975)) / NORMAL_95


def table(rows: Sequence[Mapping[str, str]]) -> Iterator[str]:
    """Yield a line a size, of all ratios together, then the widths of each cell."""
    yield "size      fleets    mean holds  between  within   between's lower end 0 at ratio 0"
    for a in AIRCRAFT:
        for f in FLIGHTS:
            own = [r for r in rows if r["cell"].startswith(f"{a} x {f},")]
            if not own:
                continue
            zero = [r for r in own if r["cell"].endswith(", 0")]
            shares = [_share(own, f"{q}_holds") for q in QUANTITIES]
            nil = np.mean([float(r["between_lower"]) == 0.0 for r in zero]) if zero else np.nan
            yield (
                f"{a:3d} x {f:<3d} {len(own):7d}    "
                + "  ".join(f"{100.0 * s:7.1f}" for s in shares)
                + f"     {100.0 * nil:5.1f} %"
            )
    yield ""
    yield "cell             holds: mean between within     width over oracle's: mean between within"
    for cell in cells():
        own = [r for r in rows if r["cell"] == cell.name]
        if own:
            holds = "".join(f"{100.0 * _share(own, f'{q}_holds'):8.1f}" for q in QUANTITIES)
            wide = "".join(f"{_ratio(own, q):8.3f}" for q in QUANTITIES)
            yield f"{cell.name:16s} {holds}    {wide}   (allowed {allowed(cell.aircraft):.2f})"


def _share(rows: Sequence[Mapping[str, str]], name: str) -> float:
    return float(np.mean([float(r[name]) for r in rows]))


def _ratio(rows: Sequence[Mapping[str, str]], name: str) -> float:
    both = [r for r in rows if r[f"{name}_oracle"]]
    ours, oracle = (
        float(np.median([float(r[f"{name}_{k}"]) for r in both])) for k in ("width", "oracle")
    )
    return ours / oracle


def main(arguments: list[str] | None = None) -> int:
    """Draw what is missing and print the table."""
    parser = argparse.ArgumentParser(prog="python -m studies.fleet_truth", description=__doc__)
    parser.add_argument("--fleets", type=int, default=500, metavar="N", help="of each cell")
    parser.add_argument("--first", type=int, default=FIRST_SEED, metavar="SEED")
    parser.add_argument("--rows", type=rows_file, default=Path("../build/study/fleet_truth.csv"))
    args = parser.parse_args(arguments)
    named = {cell.name: cell for cell in cells()}
    seeds = range(args.first, args.first + args.fleets)
    rows = flown_rows(
        args.rows,
        COLUMNS,
        itertools.product(named, seeds),
        lambda cell, seed: [row_of(named[cell], seed, oracle=seed < args.first + ORACLES)],
    )
    print("\n".join(table([r for r in rows if int(r["seed"]) in seeds])))
    return 0


if __name__ == "__main__":
    sys.exit(main())
