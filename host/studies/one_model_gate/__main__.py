"""Flights of every cell by the method on trial and by coefficients; one table and a verdict.

    python -m studies.one_model_gate --method NAME

The seeds were chosen before the first run and nothing was changed after it. Rows go to a file that
a later run continues.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as `host identify` does

from host.compiled import prefer_machine_code

from studies.judgement.judged_rows import COLUMNS, judged_rows
from studies.one_model_gate.gate_cells import CELLS
from studies.one_model_gate.gate_limits import lines
from studies.stored_rows import Row, flown_rows, rows_file

STANDARD = "coefficients"
FIRST_SEED, FLIGHTS = 51001, 20


def fly(name: str, seed: int) -> list[Row]:
    """Return the rows of one flight by one method."""
    cell, _, method = name.partition(" by ")
    own = CELLS[cell]
    flown = own.fly(own.air_mps, seed, None if method == STANDARD else method)
    return list(judged_rows(name, seed, flown, own.names))


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly what is not in the file yet, then print the table."""
    parser = argparse.ArgumentParser(prog="python -m studies.one_model_gate", description=__doc__)
    parser.add_argument("--method", required=True, help="of `--model coefficients`, on trial")
    parser.add_argument("--flights", type=int, default=FLIGHTS, help="of each cell")
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first seed")
    parser.add_argument("--only", default="", help="cells whose name begins so")
    parser.add_argument("--rows", type=rows_file, default=Path("../build/study/one_model_gate.csv"))
    asked = parser.parse_args(arguments)
    seeds = range(asked.first, asked.first + asked.flights)
    cells = [name for name in CELLS if name.startswith(asked.only)]
    both = (STANDARD, asked.method)
    keys = ((f"{cell} by {m}", seed) for seed in seeds for cell in cells for m in both)
    rows = [r for r in flown_rows(asked.rows, COLUMNS, keys, fly) if int(r["seed"]) in seeds]
    standard, trial = (
        {cell: [r for r in rows if r["world"] == f"{cell} by {m}"] for cell in cells} for m in both
    )
    print("\n".join(lines(trial, standard)))
    return 0


if __name__ == "__main__":
    prefer_machine_code()
    sys.exit(main())
