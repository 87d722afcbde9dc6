"""Frozen answers with numbers of the code changed: run in a process of its own.

Standard input holds JSON: ``keys`` (file, name, value) and ``cases``. Each number is changed by
20 % as its module is imported or its TOML is read, wherever it stands under that name; no file is
written. Prints JSON:
the first lines of each case that moved, and the files that were imported.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import ast
import importlib.abc
import importlib.machinery
import json
import math
import sys
import tomllib
from collections.abc import Sequence
from types import CodeType, ModuleType
from typing import Any

from tests.ideas.literals import Key, number, numbers
from tests.ideas.sources import ROOT

CHANGE = 1.2
TOLERANCE = 1e-2  # of a half-width, as between two machines: a search ends that near to its minimum
MOST_LINES = 3


def changed(value: complex | float) -> complex | float:
    """Return a number 20 % larger; a whole one is moved by one at least."""
    if not isinstance(value, int):
        return value * CHANGE
    return int(math.copysign(max(round(abs(value) * CHANGE), abs(value) + 1), value))


class _Change(ast.NodeTransformer):
    def __init__(self, nodes: Sequence[ast.expr]) -> None:
        self.nodes = nodes

    def visit(self, node: ast.AST) -> ast.AST:
        if any(node is one for one in self.nodes):
            value = number(node)
            assert value is not None
            return ast.copy_location(ast.Constant(changed(value)), node)
        return self.generic_visit(node)


class Loader(importlib.machinery.SourceFileLoader):
    """Compile a module with numbers changed."""

    keys: Sequence[Key]

    def get_code(self, fullname: str) -> CodeType:
        """Return the code of the module, and never what was kept of it."""
        tree: ast.Module = ast.parse(self.get_data(self.path))
        found = [node for key, node in numbers(tree, self.keys[0].file) if key in self.keys]
        if not found:
            raise SystemExit(f"none of {self.keys} in {self.path}")
        _Change(found).visit(tree)
        code: CodeType = compile(ast.fix_missing_locations(tree), self.path, "exec")
        return code


class Finder(importlib.abc.MetaPathFinder):
    """Find the files whose numbers are changed before all others do."""

    def __init__(self, keys: Sequence[Key]) -> None:
        self.keys = keys
        self.imported: set[str] = set()

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Return how to load one of the files; None for every other."""
        own = [key for key in self.keys if key.file == name.rpartition(".")[2]]
        if not name.startswith("host.") or not own:
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path, target)
        if spec is not None and spec.origin is not None:
            loader = Loader(name, spec.origin)
            loader.keys = own
            spec.loader = loader
            self.imported.add(own[0].file)
        return spec


def change_numbers(keys: Sequence[Key]) -> Finder:
    """Change numbers of all modules that are imported from now on, and of TOML read from now on."""
    finder = Finder([key for key in keys if not key.file.endswith(".toml")])
    sys.meta_path.insert(0, finder)
    for key in keys:
        if key.file.endswith(".toml"):
            _change_toml(key)
    return finder


def _change_toml(key: Key) -> None:
    path = next((ROOT / "host" / "src" / "host").rglob(key.file))
    text, loads = path.read_text(encoding="utf-8"), tomllib.loads

    def changed_loads(given: str, **named: Any) -> dict[str, Any]:
        document: dict[str, Any] = loads(given, **named)
        found: dict[str, Any] = _changed_leaves(document, "", key) if given == text else document
        return found

    tomllib.loads = changed_loads


def _changed_leaves(value: Any, place: str, key: Key) -> Any:
    if isinstance(value, dict):
        inner = {name: f"{place}.{name}".lstrip(".") for name in value}
        return {name: _changed_leaves(one, inner[name], key) for name, one in value.items()}
    if isinstance(value, list):
        return [_changed_leaves(one, place, key) for one in value]
    return changed(value) if place == key.name and repr(value) == key.value else value


def main() -> None:
    """Run the cases and print what moved."""
    asked = json.load(sys.stdin)
    finder = change_numbers([Key(*key) for key in asked["keys"]])
    from tests.answers.cases import CASES
    from tests.answers.comparison import moved
    from tests.answers.frozen_answer import frozen

    found: dict[str, list[str]] = {}
    for case in CASES:
        if case.name not in asked["cases"]:
            continue
        old = frozen(case.name)
        assert old is not None, case.name
        try:
            lines = moved(old, case.answer(), TOLERANCE)
        except Exception as error:
            lines = [f"{type(error).__name__}: {error}"]
        if lines:
            found[case.name] = lines[:MOST_LINES]
    print(json.dumps({"moved": found, "imported": sorted(finder.imported)}))


if __name__ == "__main__":
    main()
