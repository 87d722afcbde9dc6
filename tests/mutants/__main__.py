"""Share of killed mutants of the files that decide: ``make mutants``.

    make mutants                          all eleven files; stopped, it goes on where it was
    make mutants MUTANTS="rc_decoder"     some; --survivors names what was not killed

Exit codes: 0, 1 where nothing could be judged, 2 for an unknown file, 6 if a share is below 85 %.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys

from tests.mutants.judge import (
    INVALID,
    KILLED,
    SAME,
    SURVIVED,
    MutantError,
    judge_file,
    survivor_lines,
)

LEAST_SHARE = 0.85
FILES = {
    "rc_decoder": ("test_rc_decoder",),
    "imu_receiver": ("test_imu_receiver",),
    "block_writer": ("test_block_writer",),
    "drive": ("test_drive",),
    "recording": ("test_recording",),
    "flight_card": ("test_flight_card",),
    "test_input": ("test_test_input",),
    "input_command": ("test_input_command",),
    "flying_proof": ("test_flying_proof",),
    "input_watch": ("test_input_watch",),
    "stick_travel": ("test_input_watch",),
}


def _processor_s() -> float:
    """Processor time of compilers and suites so far: other work does not alter it."""
    of_children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return of_children.ru_utime + of_children.ru_stime


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="mutants", description=__doc__)
    parser.add_argument("names", nargs="*", help="files of firmware/core; none means all")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--most", type=int, help="judge a sample of so many of each file")
    parser.add_argument("--survivors", action="store_true", help="name what was not killed")
    asked = parser.parse_args(arguments)
    strange = set(asked.names) - set(FILES)
    if strange:
        print(
            f"no file {', '.join(sorted(strange))}; there are {', '.join(FILES)}", file=sys.stderr
        )
        return 2
    print(f"{'file':14}{'killed':>8}{'of':>6}{'share':>8}{'same':>7}{'invalid':>9}{'CPU s':>8}")
    below = []
    for name in asked.names or FILES:
        start_s = _processor_s()
        try:
            result = judge_file(name, FILES[name], jobs=asked.jobs, most=asked.most)
        except MutantError as error:
            print(f"mutants: {error}", file=sys.stderr)
            return 1
        killed = result.count(KILLED)
        counted = killed + result.count(SURVIVED)
        print(
            f"{name:14}{killed:>8}{counted:>6}{result.share:>8.1%}"
            f"{result.count(SAME):>7}{result.count(INVALID):>9}"
            f"{_processor_s() - start_s:>8.0f}",
            flush=True,
        )
        if asked.survivors:
            print("\n".join(survivor_lines(result)), flush=True)
        if result.share < LEAST_SHARE:
            below.append(name)
    if below:
        print(f"below {LEAST_SHARE:.0%}: {', '.join(below)}")
        return 6
    return 0


if __name__ == "__main__":
    sys.exit(main())
