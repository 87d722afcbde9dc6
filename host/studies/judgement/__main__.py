"""Flights of every world, identified and judged; one table.

    python -m studies.judgement --flights 10

One row a parameter and flight goes to a file that a later run continues. Seeds below 1000 are those
that rules are made on; scales are of the first of them.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as `host identify` does

from host.compiled import prefer_machine_code

from studies.judgement.interval_score import judged
from studies.judgement.judged_rows import COLUMNS, judged_rows
from studies.judgement.judgement_table import lines, mode_lines
from studies.judgement.scaled_figures import read_scales, write_scales
from studies.judgement.worlds import WORLDS
from studies.stored_rows import Row, flown_rows, rows_file

SIZES = {"small": 4, "full": 200}


def fly(world: str, seed: int) -> list[Row]:
    """Return the rows of one flight."""
    return list(judged_rows(world, seed, WORLDS[world].fly(seed), WORLDS[world].names))


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    parser = argparse.ArgumentParser(prog="python -m studies.judgement", description=__doc__)
    parser.add_argument("--size", choices=tuple(SIZES), default="small")
    parser.add_argument("--flights", type=int, help="of each world (small: 4, full: 200)")
    parser.add_argument("--first", type=int, default=1, help="first seed")
    parser.add_argument("--only", default="", help="worlds whose name begins so")
    parser.add_argument("--rows", type=rows_file, default=Path("../build/study/judgement.csv"))
    parser.add_argument(
        "--calibrate", action="store_true", help="write scales.csv from these flights"
    )
    asked = parser.parse_args(arguments)
    count = asked.flights or SIZES[asked.size]
    seeds = range(asked.first, asked.first + count)
    worlds = [name for name in WORLDS if name.startswith(asked.only)]
    keys = ((world, seed) for seed in seeds for world in worlds)
    rows = flown_rows(asked.rows, COLUMNS, keys, fly)
    asked_for = {
        w: [r for r in rows if r["world"] == w and int(r["seed"]) in seeds] for w in worlds
    }
    own = {world: judged(flown) for world, flown in asked_for.items() if flown}
    if asked.calibrate:
        write_scales(own)
    print("\n".join(lines(own, read_scales(), {w: _cpu_s(asked_for[w]) for w in own})))
    print("\n".join(mode_lines(asked_for)))
    return 0


def _cpu_s(rows: Sequence[Mapping[str, str]]) -> list[float]:
    """Return the processor time of identifying each flight."""
    return list({r["seed"]: float(r["cpu_s"]) for r in rows}.values())


if __name__ == "__main__":
    prefer_machine_code()
    sys.exit(main())
