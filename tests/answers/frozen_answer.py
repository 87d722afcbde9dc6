"""Frozen answers: one JSON file a case, a line an estimate."""

from __future__ import annotations

import json
from typing import Any

from tests.answers.answer_record import Record
from tests.answers.stored_input import HERE

FOLDER = HERE / "frozen"


def frozen(name: str) -> Record | None:
    """Return the frozen answer of a case; None where there is none."""
    path = FOLDER / f"{name}.json"
    if not path.is_file():
        return None
    record: Record = json.loads(path.read_text(encoding="utf-8"))
    return record


def freeze(name: str, record: Record) -> None:
    """Write the answer of a case."""
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f"{name}.json").write_text(_text(record) + "\n", encoding="utf-8")


def held(record: Record) -> str:
    """Return how many intervals hold the truth, where it is known."""
    off = record.get("off", {}).values()
    return f"{sum(x <= 1.0 for x in off)} of {len(off)} intervals hold" if off else ""


def fewer_hold(old: Record, new: Record, tolerance: float) -> list[str]:
    """Return a line where fewer intervals hold; those that near to their end are not counted."""
    was, now = old.get("off", {}), new.get("off", {})
    before = sum(x <= 1.0 for x in was.values())
    after = sum(x <= 1.0 + 2.0 * tolerance for x in now.values())
    lost = [name for name, x in was.items() if x <= 1.0 < now.get(name, 2.0)]
    return [f"{before} intervals held, {after} do: not {'; '.join(lost)}"] if after < before else []


def _text(value: Any, depth: int = 0) -> str:
    """Return JSON that a person can compare: short things on one line."""
    plain = json.dumps(value, ensure_ascii=False)
    if not isinstance(value, dict | list) or len(plain) <= 100 - depth or not value:
        return plain
    pad, end = "\n" + " " * (depth + 1), "\n" + " " * depth
    if isinstance(value, dict):
        inner = [f"{json.dumps(key)}: {_text(item, depth + 1)}" for key, item in value.items()]
        return "{" + pad + ("," + pad).join(inner) + end + "}"
    if all(isinstance(item, float | int) for item in value):
        return plain
    return "[" + pad + ("," + pad).join(_text(item, depth + 1) for item in value) + end + "]"
