"""What a fifth more of each tuned number does to frozen answers: ``make ideas IDEAS=--effects``.

Each number is changed alone, and cases that enter code with it are answered again: `FIRST` one by
one, all others for many numbers at once where nothing moved. A row of `effects.tsv` says how many
answers move, by how much at most, and what the change does to intervals of a known truth.
"""

from __future__ import annotations

import contextlib
import importlib
import multiprocessing
import sys
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path
from typing import Any

from tests.ideas.changed import TOLERANCE, change_numbers
from tests.ideas.literals import Key
from tests.ideas.number_users import users
from tests.ideas.sources import ROOT, Module

TABLE = Path(__file__).parent / "effects.tsv"
PACKAGE = str(ROOT / "host" / "src" / "host")
# Asked first, a fifth of the time of all: each kind of log, model and fault once.
FIRST = (
    "users-linear-gust", "users-linear-coloured", "equations-bend", "stuck", "no-vane",
    "backwards", "users-methods", "thor75-coefficients", "gap", "twin-log-coefficients",
    "trainer-gusty", "twin-multisine", "trainer-pitch-aircraft", "trainer-turn-aircraft",
    "ardupilot-elevons", "twin-log-alone",
)  # fmt: skip
TOGETHER = 16  # numbers that moved none of these, changed at once
MISSED = 40.0  # 2 over 5 %: what a half-width outside costs (Gneiting & Raftery, JASA 102, 2007)
UNKNOWN = 1e3  # half-width of what the data say nothing about
STOPPED = 99.0  # movement where the case did not end as an answer
LONGEST_S = 900.0
PRELOADED = ("numba", "pandas", "scipy.linalg", "scipy.optimize", "scipy.signal", "scipy.stats")


@dataclass(frozen=True)
class Effect:
    """What a fifth more of a number does.

    Attributes
    ----------
    file, name, value : str
        The number (`Key`).
    cases, moved : int
        Frozen cases that were answered again; of them those whose answer moved.
    most : float
        Largest movement of an estimate or of a half-width, in half-widths; 0 where words moved.
    where : str
        Case and text of that movement.
    held_before, held : int
        Intervals that hold a known truth in the cases that were answered for this number alone.
    score : float
        Sum of their interval scores over the sum before: below 1 the change is for the better.
    """

    file: str
    name: str
    value: str
    cases: int
    moved: int
    most: float
    where: str
    held_before: int
    held: int
    score: float

    @property
    def key(self) -> Key:
        """The number."""
        return Key(self.file, self.name, self.value)


def read(table: Path = TABLE) -> dict[Key, Effect]:
    """Return the rows of the table; none where there is no table."""
    if not table.is_file():
        return {}
    kinds = [{"int": int, "float": float}.get(str(one.type), str) for one in fields(Effect)]
    rows = (line.split("\t") for line in table.read_text(encoding="utf-8").splitlines()[1:])
    found = (Effect(*(kind(c) for kind, c in zip(kinds, row, strict=True))) for row in rows)
    return {one.key: one for one in found}


def write(rows: Iterable[Effect], table: Path = TABLE) -> None:
    """Write the table, sorted by number."""
    head = [one.name for one in fields(Effect)]
    lines = [head, *(map(str, astuple(row)) for row in sorted(rows, key=lambda row: row.key))]
    table.write_text("".join("\t".join(line) + "\n" for line in lines), encoding="utf-8")


def measure(keys: Sequence[Key], known: Mapping[str, Module], table: Path = TABLE) -> None:
    """Add a row for every number that has none; rows whose number is gone leave."""
    for name in PRELOADED:
        importlib.import_module(name)
    rows = {key: row for key, row in read(table).items() if key in set(keys)}
    entered = {name: _apart(_entering, name) for name in _apart(_case_names)}
    acting = users(known.values())
    cases = {
        key: [name for name in entered if key not in acting or acting[key] & entered[name]]
        for key in keys
    }
    for key in keys:
        if key not in rows:
            start_s = time.monotonic()
            rows[key] = _effect(key, [name for name in cases[key] if name in FIRST])
            write(rows.values(), table)
            print(f"{_said(rows[key])}, {time.monotonic() - start_s:.0f} s", flush=True)
    silent = [k for k in keys if not rows[k].moved and rows[k].cases < len(cases[k])]
    for start in range(0, len(silent), TOGETHER):
        group = silent[start : start + TOGETHER]
        others = sorted({name for key in group for name in cases[key]} - set(FIRST))
        rows |= {key: replace(rows[key], cases=len(cases[key])) for key in group}
        rows |= dict(_movers(group, cases, others))
        write(rows.values(), table)


def _said(row: Effect) -> str:
    return f"{' '.join(row.key.__dict__.values())}: {row.moved} of {row.cases}, {row.most:.2g}"


def _movers(
    keys: Sequence[Key], cases: Mapping[Key, Collection[str]], names: Sequence[str]
) -> Iterator[tuple[Key, Effect]]:
    """Yield the rows of those among these numbers that move any of these cases."""
    found = _apart(_answered, keys, names) if names else {}
    moved = names if found is None else [name for name, one in found.items() if one["line"]]
    said = f"{len(keys)} from {keys[0].file} {keys[0].name}"
    print(f"{said}: {', '.join(moved) or 'nothing'} moved", flush=True)
    if moved and len(keys) == 1:
        yield keys[0], replace(_effect(keys[0], moved), cases=len(cases[keys[0]]))
    elif moved:
        half = len(keys) // 2
        yield from _movers(keys[:half], cases, moved)
        yield from _movers(keys[half:], cases, moved)


def _apart(work: Callable[..., Any], *given: Any) -> Any:
    """Return what a function returns in a process of its own; None where that dies or hangs."""
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)
    child = context.Process(target=lambda: theirs.send(work(*given)))
    child.start()
    theirs.close()
    answer = None
    if ours.poll(LONGEST_S):
        with contextlib.suppress(EOFError):
            answer = ours.recv()
    child.kill()
    child.join()
    return answer


def _case_names() -> list[str]:
    from tests.answers.cases import CASES

    return [case.name for case in CASES]


def _entering(name: str) -> set[str]:
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
    return {f"{Path(code.co_filename).stem}:{code.co_qualname.partition('.')[0]}" for code in own}


def _effect(key: Key, names: Sequence[str]) -> Effect:
    found = _apart(_answered, [key], names)
    if found is None:
        return Effect(*_cells(key), len(names), len(names), STOPPED, "stopped", 0, 0, 1.0)
    moved = [(one["most"], f"{name}: {one['line']}") for name, one in found.items() if one["line"]]
    most, where = max(moved, default=(0.0, ""))
    before, now, held_before, held = (
        sum(one[part] for one in found.values())
        for part in ("before", "now", "held_before", "held")
    )
    score = now / before if before else 1.0
    where = where.replace("\t", " ")[:160]
    return Effect(
        *_cells(key), len(names), len(moved), round(most, 3), where, held_before, held,
        round(score, 4),
    )  # fmt: skip


def _cells(key: Key) -> tuple[str, str, str]:
    return key.file, key.name, key.value


def _answered(keys: Sequence[Key], names: Sequence[str]) -> dict[str, Any]:
    """Return what numbers changed together do to each case."""
    change_numbers(keys)
    from tests.answers.cases import CASES
    from tests.answers.comparison import moved
    from tests.answers.frozen_answer import frozen

    by_name = {case.name: case for case in CASES}
    found: dict[str, Any] = {}
    for name in names:
        old = frozen(name)
        assert old is not None, name
        try:
            new = by_name[name].answer()
            lines = moved(old, new, TOLERANCE)
            found[name] = {**_scored(old, new), **_largest(old, new, lines)}
        except Exception as error:
            nothing = dict.fromkeys(("before", "now", "held_before", "held"), 0)
            found[name] = {**nothing, "most": STOPPED, "line": f"{type(error).__name__}: {error}"}
    return found


def _estimates(record: Mapping[str, Any]) -> dict[str, Any]:
    return {
        f"{one['template']}, {one['method']}, {name}": pair
        for one in record.get("answers", ())
        for name, pair in one["estimates"].items()
    }


def _scored(old: Mapping[str, Any], new: Mapping[str, Any]) -> dict[str, float]:
    """Return interval scores in half-widths of the frozen answer, and how many intervals hold."""
    was, now = _estimates(old), _estimates(new)
    off, others = old.get("off", {}), new.get("off", {})
    both = [name for name in off if name in others and was[name][1] and now[name][1]]
    return {
        "before": sum(_score(off[name]) for name in both),
        "now": sum(now[name][1] / was[name][1] * _score(others[name]) for name in both),
        "held_before": sum(x <= 1.0 for x in off.values()),
        "held": sum(x <= 1.0 for x in others.values()),
    }


def _score(off: float) -> float:
    return 2.0 + MISSED * max(off - 1.0, 0.0)


def _largest(
    old: Mapping[str, Any], new: Mapping[str, Any], lines: Sequence[str]
) -> dict[str, Any]:
    """Return the largest movement of an estimate or a half-width, else the first line."""
    most, line = 0.0, lines[0] if lines else ""
    now = _estimates(new) if lines else {}
    for name, (value, half) in _estimates(old).items():
        other, wide = now.get(name, (None, None))
        if None in (value, half, other, wide) or not 0.0 < half < UNKNOWN:
            continue
        by = max(abs(other - value), abs(wide - half)) / half
        if by > max(most, TOLERANCE):
            most, line = by, f"{name} {value:.4g} +- {half:.2g} -> {other:.4g} +- {wide:.2g}"
    return {"most": most, "line": line}
