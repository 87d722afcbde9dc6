"""How many ideas stand between a flight and an answer: ``make ideas``.

    make ideas                 figures of the package, and what an identification enters
    make ideas IDEAS=--still   what the syntax trees say alone, in seconds

Exits with 6 where the declaration names what is not there.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tests.ideas.declared import Kind, kinds
from tests.ideas.entered import Entered, entered, simulated, total_calls
from tests.ideas.sources import ROOT, Function, Module, circles, functions, modules

FLIGHT = ROOT / "build" / "ideas"
SYSID = "host.sysid"
MOST_LINES, MOST_COMPLEXITY = 60, 15
MOST_FILE_LINES = 400


def main(arguments: list[str] | None = None) -> int:
    """Print every figure; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="ideas", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--still", action="store_true", help="run nothing: syntax trees alone")
    parser.add_argument("--names", action="store_true", help="name every long or branched function")
    asked = parser.parse_args(arguments)
    known = modules()
    inside = [one for one in known.values() if one.name.startswith(SYSID)]
    parts = [part for one in inside for part in functions(one)]
    declared = kinds({part.label for part in parts})
    if not asked.still:
        _print_entered(simulated(FLIGHT), declared)
    _print_kinds(declared)
    _print_sizes(list(known.values()), inside)
    _print_functions(parts, names=asked.names)
    found = circles(known)
    _row("circles of imports", len(found), "; ".join(", ".join(circle) for circle in found))
    faults = [fault for kind in declared.values() for fault in kind.faults]
    print("\n".join(faults), file=sys.stderr, end="\n" if faults else "")
    return 6 if faults else 0


def _row(what: str, value: object, more: str = "") -> None:
    print(f"{what:52} {value!s:>8}  {more}".rstrip(), flush=True)


def _print_entered(flight: Path, declared: dict[str, Kind]) -> None:
    runs = {models: entered(flight, models) for models in ("default", "coefficients")}
    for label, room in (("sysid", "sysid/"), ("host", "")):
        for models, run in runs.items():
            every, called = (run.places(room, bodies=bodies) for bodies in (True, False))
            for what, count, less in zip(("files", "functions"), every, called, strict=True):
                more = f"{less} without bodies of classes"
                _row(f"{what} of {label} entered, {models}", count, more)
    default = runs["default"]
    _row("FitResult made, default", default.made, f"{default.replaced} by replace")
    for models, run in runs.items():
        _row(f"searches, {models}", _calls(run, declared["searches"]))
        _row(f"verdicts written, {models}", _verdicts(run, declared["verdicts"]))


def _calls(run: Entered, kind: Kind) -> int:
    return total_calls(run.calls, kind.found)


def _verdicts(run: Entered, kind: Kind) -> int:
    return total_calls(run.written, kind.found)


def _print_kinds(declared: dict[str, Kind]) -> None:
    for kind in declared.values():
        _row(kind.name, len(kind.found), ", ".join(kind.found))


def _print_sizes(every: list[Module], inside: list[Module]) -> None:
    _row("lines of sysid", sum(one.lines for one in inside), f"{len(inside)} files")
    _row("lines of host/src", sum(one.lines for one in every), f"{len(every)} files")
    large = sorted((one for one in every if one.lines > MOST_FILE_LINES), key=lambda m: -m.lines)
    listed = ", ".join(f"{one.stem} {one.lines}" for one in large)
    _row(f"files above {MOST_FILE_LINES} lines", len(large), listed)


def _print_functions(parts: list[Function], *, names: bool) -> None:
    long = [part for part in parts if part.lines > MOST_LINES]
    branched = [part for part in parts if part.complexity > MOST_COMPLEXITY]
    either = [part for part in parts if part in long or part in branched]
    _row(f"functions of sysid above {MOST_LINES} lines", len(long), f"of {len(parts)}")
    _row(f"functions of sysid above complexity {MOST_COMPLEXITY}", len(branched))
    worst = sorted(either, key=lambda part: (-part.complexity, -part.lines))
    said = (f"{part.label} {part.complexity}, {part.lines} lines" for part in worst)
    _row("functions of sysid above either", len(either), "" if names else next(said, ""))
    if names:
        print("".join(f"    {line}\n" for line in said), end="")


if __name__ == "__main__":
    sys.exit(main())
