"""Change every tuned number alone, and answer frozen cases again: ``make ideas IDEAS=--effects``.

`FIRST` are answered for each number by itself; all others for many numbers at once where nothing
moved. Only cases that enter code with a number are answered. ``--neighbours`` halves and doubles
those that moved an answer and name no source.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from studies.switch_off.apart import apart

from tests.ideas import neighbours
from tests.ideas.changed import changed_answers, movers
from tests.ideas.drawn import ALL_CASES
from tests.ideas.effects import TABLE, Effect, effect
from tests.ideas.literals import Key
from tests.ideas.number_users import users
from tests.ideas.rows import read_rows, write_rows
from tests.ideas.sources import ROOT, Module

PACKAGE = str(ROOT / "host" / "src" / "host")
# Asked first, a fifth of the time of all: each kind of log, model and fault once.
FIRST = (
    "users-linear-gust", "users-linear-coloured", "equations-bend", "stuck", "no-vane",
    "backwards", "users-methods", "thor75-coefficients", "gap", "twin-log-coefficients",
    "trainer-gusty", "twin-multisine", "trainer-pitch-aircraft", "trainer-turn-aircraft",
    "ardupilot-elevons", "twin-log-alone",
)  # fmt: skip
TOGETHER = 16  # numbers that moved none of these, changed at once
PRELOADED = ("numba", "pandas", "scipy.linalg", "scipy.optimize", "scipy.signal", "scipy.stats")


def measure(keys: Sequence[Key], known: Mapping[str, Module], table: Path = TABLE) -> None:
    """Add a row for every number that has none; rows whose number is gone leave."""
    for name in PRELOADED:
        importlib.import_module(name)
    rows = {key: row for key, row in read_rows(Effect, table).items() if key in set(keys)}
    cases = _cases(keys, known)
    for key in keys:
        if key not in rows:
            names = [name for name in cases[key] if name in FIRST]
            rows[key] = effect(key, len(names), changed_answers([key], names))
            write_rows(Effect, rows.values(), table)
            print(rows[key], flush=True)
    silent = [k for k in keys if not rows[k].moved and rows[k].cases < len(cases[k])]
    for start in range(0, len(silent), TOGETHER):
        group = silent[start : start + TOGETHER]
        others = {name for key in group for name in cases[key]} - set(FIRST)
        rows |= {key: effect(key, len(cases[key]), {}) for key in group}
        rows |= {key: effect(key, len(cases[key]), found) for key, found in movers(group, others)}
        write_rows(Effect, rows.values(), table)


def measure_neighbours(keys: Sequence[Key], known: Mapping[str, Module]) -> None:
    """Halve and double every number that moves an answer, and add a row; old rows stay."""
    for name in PRELOADED:
        importlib.import_module(name)
    effects = read_rows(Effect, TABLE)
    rows = read_rows(neighbours.Neighbours, neighbours.TABLE)
    moving = [key for key in keys if key not in rows and (key not in effects or effects[key].moved)]
    for key, cases in _cases(moving, known).items():
        most = effects[key].where.partition(":")[0] if key in effects else ""
        names = [name for name in cases if name in (*FIRST, most)]
        half, double = (changed_answers([key], names, by) for by in (0.5, 2.0))
        rows[key] = neighbours.neighbours(key, half, double)
        write_rows(neighbours.Neighbours, rows.values(), neighbours.TABLE)
        print(rows[key], flush=True)


def _cases(keys: Sequence[Key], known: Mapping[str, Module]) -> dict[Key, list[str]]:
    """Return the frozen cases that enter code with each number."""
    entered = {name: set(apart(lambda name=name: _entering(name))) for name in ALL_CASES}  # type: ignore[misc]
    acting = users(known.values())
    return {
        key: [name for name in entered if key not in acting or acting[key] & entered[name]]
        for key in keys
    }


def _entering(name: str) -> list[str]:
    """Return the functions that a case enters, as ``file:function``."""
    from tests.answers.cases import CASES

    codes: set[Any] = set()

    def started(frame: Any, event: str, _: object) -> None:
        if event == "call":
            codes.add(frame.f_code)

    case = next(case for case in CASES if case.name == name)
    sys.setprofile(started)
    try:
        case.answer()
    finally:
        sys.setprofile(None)
    own = (code for code in codes if code.co_filename.startswith(PACKAGE))
    return sorted(
        {f"{Path(code.co_filename).stem}:{code.co_qualname.partition('.')[0]}" for code in own}
    )
