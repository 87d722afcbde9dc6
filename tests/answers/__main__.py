"""Compare answers with the frozen ones, or freeze them anew.

    .venv/bin/python -m tests.answers                      every case, what moved
    .venv/bin/python -m tests.answers demo --tolerance 1e-9
    .venv/bin/python -m tests.answers --update             freeze, and print what moved

Exits with 1 where something moved, or where an update was refused.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import sys
import time

from tests.answers.cases import CASES
from tests.answers.comparison import STRICT, moved
from tests.answers.frozen_answer import fewer_hold, freeze, frozen, held

MOST_LINES = 20


def main() -> int:
    """Identify every case asked for; print a line for each, and what moved."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", help="cases; none means all")
    parser.add_argument("--update", action="store_true", help="freeze the new answers")
    parser.add_argument(
        "--lower", action="store_true", help="freeze even where fewer intervals hold the truth"
    )
    parser.add_argument(
        "--tolerance", type=float, default=STRICT, help="share of the half-width (default 1e-9)"
    )
    parser.add_argument("--full", action="store_true", help="print every line that moved")
    asked = parser.parse_args()
    known = {case.name: case for case in CASES}
    if strange := set(asked.names) - set(known):
        parser.error(f"no case {', '.join(sorted(strange))}; there are {', '.join(known)}")
    bad = 0
    for name in asked.names or known:
        start_s = time.process_time()
        new, old = known[name].answer(), frozen(name)
        lines = ["new"] if old is None else moved(old, new, asked.tolerance)
        fewer = [] if old is None else fewer_hold(old, new, asked.tolerance)
        took_s = time.process_time() - start_s
        print(f"{name}: {len(lines)} moved; {held(new) or 'no truth'} ({took_s:.1f} s)", flush=True)
        print("".join(f"    {line}\n" for line in (*shown(lines, asked.full), *fewer)), end="")
        if asked.update and fewer and not asked.lower:
            print("    not frozen: fewer intervals hold; --lower freezes it, a note says why")
            bad = 1
        elif asked.update:
            freeze(name, new)
        elif lines or fewer:
            bad = 1
    return bad


def shown(lines: list[str], full: bool) -> list[str]:
    """Return the lines to print: the first, unless all were asked for."""
    if full or len(lines) <= MOST_LINES:
        return lines
    return [*lines[:MOST_LINES], f"... and {len(lines) - MOST_LINES} more: --full"]


if __name__ == "__main__":
    sys.exit(main())
