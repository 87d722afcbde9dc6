"""Frozen inputs with each step of `studies.switch_off` off in turn: what moves at all?

    PYTHONPATH=host .venv/bin/python -m tests.ideas.switched FILE [--cases NAMES] [--only NAMES]

A row of FILE is a switch and an input that enters it: the largest movement of an estimate and of a
half-width, in half-widths, and how many marks, findings and words changed. Rows that are there are
not run again.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import csv
import importlib
import re
import sys
import time
from collections.abc import Callable, Mapping
from functools import wraps
from pathlib import Path
from typing import Any

from studies.switch_off.apart import apart
from studies.switch_off.patched import switch_off
from studies.switch_off.switches import ROOM, SWITCHES, Switch

from tests.answers.answer_record import Record
from tests.answers.cases import CASES
from tests.answers.comparison import UNKNOWN, same_text

COLUMNS = (
    "switch", "case", "estimate", "half_width", "which", "marks", "findings", "words", "cpu_s"
)  # fmt: skip
SLOWEST_S = 6.0
NUISANCE = re.compile(r" \w+\.\w|@|error$")  # constants of maneuvers, noise, errors
LOADS = ("twin-multisine", "users-linear-gust", "trainer-turn-aircraft")


def main() -> int:
    """Run what is not in the file yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--cases", default="", help="by a comma; all that are quick without")
    parser.add_argument("--only", default="", help="switches, by a comma")
    asked = parser.parse_args()
    wanted = [name for name in asked.cases.split(",") if name]
    only = [name for name in asked.only.split(",") if name]
    done = _done(asked.file)
    for case in CASES:
        if case.name in LOADS:  # once, what every child would import and compile
            case.answer()
    before = {
        case.name: one
        for case in CASES
        if (not wanted or case.name in wanted)
        and (one := apart(lambda case=case: _entering(case))) is not None  # type: ignore[misc]
        and (wanted or one["cpu_s"] < SLOWEST_S)
    }
    by_name = {switch.name: switch for switch in SWITCHES}
    for switch in [by_name[name] for name in only or by_name]:
        for name, one in before.items():
            if (switch.name, name) in done or not {*switch.off} & {*one["entered"]}:
                continue
            case = next(case for case in CASES if case.name == name)
            start_s = time.monotonic()
            after = apart(lambda: _without(switch, case))  # noqa: B023
            moved = _moved(one["record"], after) if after else {"which": "stopped"}
            row = {"switch": switch.name, "case": name, "cpu_s": time.monotonic() - start_s}
            _append(asked.file, {**row, **moved})
    return 0


def _entering(case: Any) -> dict[str, Any]:
    """Return the answer of a case, and which functions of switches it enters."""
    entered: set[str] = set()

    def noting(path: str, function: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(function)
        def noted(*given: Any, **named: Any) -> Any:
            entered.add(path)
            return function(*given, **named)

        return noted

    for path in {path for switch in SWITCHES for path in switch.off}:
        module, _, name = path.partition(":")
        own = getattr(importlib.import_module(ROOM + module), name)
        if callable(own):
            switch_off({path: noting(path, own)})
        else:
            entered.add(path)
    start_s = time.process_time()
    record = case.answer()
    cpu_s = time.process_time() - start_s
    print(f"{case.name}: {cpu_s:.1f} s, enters {len(entered)}", flush=True)
    return {"record": record, "entered": sorted(entered), "cpu_s": cpu_s}


def _without(switch: Switch, case: Any) -> dict[str, Any]:
    switch_off(switch.off)
    record: dict[str, Any] = case.answer()
    return record


def _moved(old: Record, new: Record) -> dict[str, Any]:
    if "refused" in old or "refused" in new:
        same = old.get("refused") == new.get("refused")
        return {} if same else {"which": "refusal"}
    before, after = (
        {f"{a['template']} {a['method']} {n}": v for a in one["answers"]
         for n, v in a["estimates"].items()}
        for one in (old, new)
    )  # fmt: skip
    largest, widest, which = 0.0, 0.0, ""
    for name, (value, half) in before.items():
        now, other = after.get(name, (None, None))
        if NUISANCE.search(name) or None in (value, half, now, other) or not 0.0 < half < UNKNOWN:
            continue
        by, wider = abs(now - value) / half, other / half - 1.0
        if max(by, abs(wider)) > max(largest, abs(widest)):
            which = name
        largest = max(largest, by)
        widest = wider if abs(wider) > abs(widest) else widest
    lost = sorted(before.keys() ^ after.keys())
    marks = _differ(
        *({f"{a['template']} {a['method']} {n}": m for a in one["answers"]
           for n, m in a["marks"].items()} for one in (old, new))
    )  # fmt: skip
    findings = _differ(
        *({(f["check"], *f["channels"], f["flight"]): f["text"] for f in one["findings"]}
          for one in (old, new))
    )  # fmt: skip
    words = sum(
        not same_text(a, b)
        for key in ("warnings", "verdict")
        for x, y in zip(old["answers"], new["answers"], strict=False)
        for a, b in zip(x[key], y[key], strict=False)
    )
    return {
        "estimate": f"{largest:.2g}", "half_width": f"{widest:+.2g}",
        "which": f"{which}; {len(lost)} estimates come or go: {lost[0]}" if lost else which,
        "marks": marks, "findings": findings, "words": words,
    }  # fmt: skip


def _differ(old: Mapping[Any, Any], new: Mapping[Any, Any]) -> int:
    return sum(old.get(name) != new.get(name) for name in {**old, **new})


def _done(file: Path) -> set[tuple[str, str]]:
    if not file.exists():
        return set()
    with file.open(encoding="utf-8", newline="") as source:
        return {(row["switch"], row["case"]) for row in csv.DictReader(source)}


def _append(file: Path, row: Mapping[str, Any]) -> None:
    new = not file.exists()
    with file.open("a", encoding="utf-8", newline="") as out:
        writer = csv.DictWriter(out, COLUMNS, restval="")
        if new:
            writer.writeheader()
        writer.writerow(row)


if __name__ == "__main__":
    sys.exit(main())
