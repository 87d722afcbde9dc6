"""Frozen answers with numbers of the code changed, by 20 % or a factor; no file is written."""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import ast
import importlib.abc
import importlib.machinery
import math
import signal
import sys
import tomllib
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

from studies.switch_off.apart import apart

from tests.ideas.effects import TOLERANCE, Again
from tests.ideas.literals import Key, number, numbers
from tests.ideas.sources import ROOT

CHANGE = 1.2
NEARLY_ALL = 0.9
LONGEST_S = 900


def changed(value: complex | float, by: float = CHANGE) -> complex | float:
    """Return a number times a factor; a whole one is moved by one at least.

    A share of nearly all, a quantile or a correlation, cannot exceed one: what it lacks is changed.
    """
    if isinstance(value, float) and NEARLY_ALL <= value < 1.0:
        return 1.0 - (1.0 - value) * by
    if not isinstance(value, int):
        return value * by
    limit, least = (max, abs(value) + 1) if by > 1.0 else (min, abs(value) - 1)
    return int(math.copysign(limit(round(abs(value) * by), least), value))


class _Change(ast.NodeTransformer):
    def __init__(self, nodes: Sequence[ast.expr], by: float) -> None:
        self.nodes, self.by = nodes, by

    def visit(self, node: ast.AST) -> ast.AST:
        if any(node is one for one in self.nodes):
            value = number(node)
            assert value is not None
            return ast.copy_location(ast.Constant(changed(value, self.by)), node)
        return self.generic_visit(node)


class Loader(importlib.machinery.SourceFileLoader):
    """Compile a module with numbers changed."""

    keys: Sequence[Key]
    by: float

    def get_code(self, fullname: str) -> CodeType:
        """Return the code of the module, and never what was kept of it."""
        tree: ast.Module = ast.parse(self.get_data(self.path))
        found = [node for key, node in numbers(tree, self.keys[0].file) if key in self.keys]
        if not found:
            raise SystemExit(f"none of {self.keys} in {self.path}")
        _Change(found, self.by).visit(tree)
        code: CodeType = compile(ast.fix_missing_locations(tree), self.path, "exec")
        return code


class Finder(importlib.abc.MetaPathFinder):
    """Find the files whose numbers are changed before all others do."""

    def __init__(self, keys: Sequence[Key], by: float) -> None:
        self.keys, self.by = keys, by
        self.imported: set[str] = set()

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Return how to load one of the files; None for every other."""
        own = [key for key in self.keys if key.file == name.rpartition(".")[2]]
        if not name.startswith("host.") or not own:
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path, target)
        if spec is not None and spec.origin is not None and Path(spec.origin).stem == own[0].file:
            loader = Loader(name, spec.origin)
            loader.keys, loader.by = own, self.by
            spec.loader = loader
            self.imported.add(own[0].file)
        return spec


def change_numbers(keys: Sequence[Key], by: float = CHANGE) -> Finder:
    """Change numbers of all modules that are imported from now on, and of TOML read from now on."""
    finder = Finder([key for key in keys if not key.file.endswith(".toml")], by)
    sys.meta_path.insert(0, finder)
    for key in keys:
        if key.file.endswith(".toml"):
            _change_toml(key, by)
    return finder


def _change_toml(key: Key, by: float) -> None:
    path = next((ROOT / "host" / "src" / "host").rglob(key.file))
    text, loads = path.read_text(encoding="utf-8"), tomllib.loads

    def changed_loads(given: str, **named: Any) -> dict[str, Any]:
        document: dict[str, Any] = loads(given, **named)
        found: dict[str, Any] = (
            _changed_leaves(document, "", key, by) if given == text else document
        )
        return found

    tomllib.loads = changed_loads


def _changed_leaves(value: Any, place: str, key: Key, by: float) -> Any:
    if isinstance(value, dict):
        inner = {name: f"{place}.{name}".lstrip(".") for name in value}
        return {name: _changed_leaves(one, inner[name], key, by) for name, one in value.items()}
    if isinstance(value, list):
        return [_changed_leaves(one, place, key, by) for one in value]
    return changed(value, by) if place == key.name and repr(value) == key.value else value


def answers(names: Collection[str]) -> dict[str, Again]:
    """Answer cases again, and return what each came to."""
    from tests.answers.cases import CASES
    from tests.answers.comparison import moved
    from tests.answers.frozen_answer import frozen

    found: dict[str, Again] = {}
    for case in CASES:
        if case.name not in names:
            continue
        old = frozen(case.name)
        assert old is not None, case.name
        try:
            new = case.answer()
            lines = moved(old, new, TOLERANCE)
        except Exception as error:
            new, lines = {}, [f"{type(error).__name__}: {error}"]
        found[case.name] = {"old": old, "new": new, "lines": lines}
    return found


def changed_answers(
    keys: Sequence[Key], names: Collection[str], by: float = CHANGE
) -> dict[str, Again]:
    """Return what cases come to with numbers changed, in a process of its own.

    All have no answer where that process dies or hangs. Modules of the package that this one has
    imported already stay as they are.
    """

    def work() -> dict[str, Again]:
        signal.alarm(LONGEST_S)
        change_numbers(keys, by)
        return answers(names)

    stopped: Again = {"old": {}, "new": {}, "lines": [f"stopped, or no end in {LONGEST_S} s"]}
    found: dict[str, Again] | None = apart(work)
    return dict.fromkeys(names, stopped) if found is None else found


def movers(keys: Sequence[Key], names: Collection[str]) -> Iterator[tuple[Key, dict[str, Again]]]:
    """Change numbers together; yield those that move a case by themselves, and the cases moved.

    Where an answer moves, the half of the numbers that moves it is sought, by that answer alone.
    """
    found = changed_answers(keys, names) if keys and names else {}
    found = {name: one for name, one in found.items() if one["lines"]}
    said = ", ".join(found) or "nothing"
    print(f"{said} moved by {', '.join(f'{k.file}:{k.name} {k.value}' for k in keys)}", flush=True)
    if found and len(keys) == 1:
        yield keys[0], found
    elif found:
        half = len(keys) // 2
        yield from movers(keys[:half], found)
        yield from movers(keys[half:], found)
