"""Run the studies and write their tables: `python -m host.sysid.study --size small OUT`."""

from __future__ import annotations

import argparse
import contextlib
import io
import sys
import time
from collections.abc import Callable
from pathlib import Path

from host.sysid.study import accuracy, coverage, flights, methods, thesis, turbulence

Main = Callable[[list[str] | None], int]
# name -> (program, arguments by size)
STUDIES: dict[str, tuple[Main, dict[str, list[str]]]] = {
    "a_thesis": (
        thesis.main,
        {"small": ["--iterations", "20000", "--systems", "20"], "full": []},
    ),
    "b_accuracy": (
        accuracy.main,
        {"small": ["--runs", "20"], "full": ["--runs", "1000"]},
    ),
    "c_coverage": (
        coverage.main,
        {"small": ["--runs", "20"], "full": ["--runs", "2000"]},
    ),
    "d_turbulence": (
        turbulence.main,
        {"small": ["--flights", "4"], "full": ["--flights", "100"]},
    ),
    "e_flights": (flights.main, {"small": ["--flights", "1"], "full": ["--flights", "20"]}),
    "g_methods": (methods.main, {"small": ["--runs", "2"], "full": ["--runs", "20"]}),
}


def main(arguments: list[str] | None = None) -> int:
    """Run the chosen studies one after another on one core."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where the tables go")
    parser.add_argument("--size", choices=("small", "full"), default="small")
    parser.add_argument("--only", choices=list(STUDIES), action="append")
    options = parser.parse_args(arguments)
    options.folder.mkdir(parents=True, exist_ok=True)
    for name in options.only or STUDIES:
        program, sizes = STUDIES[name]
        begin = time.perf_counter()
        table = io.StringIO()
        with contextlib.redirect_stdout(table):
            program(sizes[options.size])
        path = options.folder / f"{name}.txt"
        path.write_text(f"simulated data; size {options.size}\n{table.getvalue()}")
        sys.stdout.write(f"{path}  {time.perf_counter() - begin:.0f} s\n")
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
