"""How many ideas stand between a flight and an answer: ``make ideas``.

    make ideas                 figures of the package, and what an identification enters
    make ideas IDEAS=--still   what the syntax trees say alone, in seconds
    make ideas IDEAS=--check   the table of numbers alone: 6 if one has no class
    make ideas IDEAS=--follow  the table rewritten for the code as it is
    make ideas IDEAS=--effects what each tuned number does to frozen answers: hours, goes on
    make ideas IDEAS=--neighbours  what half and twice of those that name no source do
    make ideas LITERALS=30     numbers drawn and changed by 20 %: 6 if a frozen answer moves

Exits with 6 where the declaration names what is not there, too.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.ideas.classes import (
    CLASSES,
    OPEN,
    Row,
    counted,
    follow,
    missing,
    read,
    row_of,
    stale,
    write,
)
from tests.ideas.declared import Kind, kinds
from tests.ideas.drawn import ALL_CASES, CASES, TOGETHER, drawn
from tests.ideas.effects import TABLE as EFFECTS
from tests.ideas.effects import Effect
from tests.ideas.entered import Entered, entered, simulated, total_calls
from tests.ideas.literals import Key, code_literals, toml_files, toml_literals
from tests.ideas.neighbours import NOTHING, WORSE
from tests.ideas.rows import read_rows
from tests.ideas.sources import (
    ROOT,
    Function,
    Module,
    circles,
    entry_points,
    functions,
    modules,
    reachable,
)

FLIGHT = ROOT / "build" / "ideas"
SYSID = "host.sysid"
DOOR = "host.sysid.pipeline.stages"
MOST_LINES, MOST_COMPLEXITY = 60, 15
MOST_FILE_LINES = 400


def main(arguments: list[str] | None = None) -> int:
    """Print every figure; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="ideas", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--still", action="store_true", help="run nothing: syntax trees alone")
    parser.add_argument("--names", action="store_true", help="name every long or branched function")
    parser.add_argument("--check", action="store_true", help="only: has every number a class?")
    parser.add_argument("--follow", action="store_true", help="rewrite the table of numbers")
    parser.add_argument("--effects", action="store_true", help="change every tuned number alone")
    parser.add_argument("--neighbours", action="store_true", help="halve and double, too")
    parser.add_argument("--change", type=int, metavar="N", help="draw N numbers and change them")
    parser.add_argument("--all", action="store_true", help="by every frozen answer, not three")
    parser.add_argument("--seed", type=int, default=1, help="of the draw (default 1)")
    asked = parser.parse_args(arguments)
    known = modules()
    rows = read()
    reached = sorted(reachable([DOOR, *entry_points()], known))
    code = sorted(code_literals(known[name] for name in reached))
    keys = sorted({*code, *toml_literals(toml_files(known, reached))})
    if asked.follow:
        write(follow(keys, rows))
        rows = read()
    if asked.check or asked.follow:
        return _print_numbers(keys, rows)
    if asked.effects:
        tuned = [key for key in keys if (row := row_of(key, rows)) and row.kind == "tuned"]
        from tests.ideas.sensitivity import measure  # studies are on the path of `make ideas`

        measure(tuned, known)
        return _print_numbers(keys, rows)
    if asked.neighbours:
        bare = [k for k in keys if (r := row_of(k, rows)) and r.kind == "tuned" and not r.source]
        from tests.ideas.sensitivity import measure_neighbours

        measure_neighbours(bare, known)
        return _print_numbers(keys, rows)
    if asked.change:
        cases = ALL_CASES if asked.all else CASES
        return _change(drawn(code, rows, asked.change, asked.seed), cases)
    inside = [one for one in known.values() if one.name.startswith(SYSID)]
    parts = [part for one in inside for part in functions(one)]
    declared = kinds({part.label for part in parts})
    if not asked.still:
        _print_entered(simulated(FLIGHT), declared)
    _print_kinds(declared)
    _print_sizes(list(known.values()), inside)
    _print_functions(parts, names=asked.names)
    _print_numbers(keys, rows)
    found = circles(known)
    _row("circles of imports", len(found), "; ".join(", ".join(circle) for circle in found))
    faults = [fault for kind in declared.values() for fault in kind.faults]
    print("\n".join(faults), file=sys.stderr, end="\n" if faults else "")
    return 6 if faults else 0


def _print_numbers(keys: list[Key], rows: dict[Key, Row]) -> int:
    """Print how many numbers each class has; return 6 and name them where some have none."""
    of_class = counted(keys, rows)
    listed = ", ".join(f"{kind} {of_class[kind]}" for kind in (*CLASSES, OPEN) if of_class[kind])
    _row("numbers that host.identify can reach", len(keys), listed)
    tuned = {k: row for k in keys if (row := row_of(k, rows)) and row.kind == "tuned"}
    effects = read_rows(Effect, EFFECTS)
    moving = [key for key in tuned if key not in effects or effects[key].moved]
    sourced = sum(bool(row.source) for row in tuned.values())
    _row("tuned numbers with a source", sourced, f"of {len(tuned)}")
    sourced = sum(bool(tuned[key].source) for key in moving)
    _row("tuned numbers that move a frozen answer", len(moving), f"{sourced} of them with a source")
    worse, nothing = (sum(tuned[key].source == one for key in moving) for one in (WORSE, NOTHING))
    _row("of these, half or double is worse", worse, f"{nothing} more where they decide nothing")
    bare, gone = missing(keys, rows), stale(keys, rows)
    for key in bare:
        print(f"no class: {key.file} {key.name} {key.value}", file=sys.stderr)
    if bare or gone:
        said = f"{len(bare)} numbers have no class, {len(gone)} rows no number"
        print(f"{said}; make ideas IDEAS=--follow, then say what '?' is", file=sys.stderr)
    return 6 if bare else 0


def _change(keys: list[Key], cases: Sequence[str]) -> int:
    """Change numbers, and name those that move a frozen answer."""
    from tests.ideas.changed import movers  # studies are on the path of `make ideas`

    groups = [keys[start : start + TOGETHER] for start in range(0, len(keys), TOGETHER)]
    found = [one for group in groups for one in movers(group, cases)]
    _row("numbers changed by 20 %", len(keys), f"{len(found)} move a frozen answer")
    for key, moved in found:
        print(f"{key.file} {key.name} {key.value}")
        print(
            "".join(
                f"    {name}: {line}\n" for name, one in moved.items() for line in one["lines"][:3]
            ),
            end="",
        )
    return 6 if found else 0


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
