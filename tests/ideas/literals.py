"""Every number that `host.identify` can reach: in code, and in TOML of the rooms it reads."""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from tests.ideas.sources import FunctionNode, Module

PLAIN = (0, 1, -1, 2)
LAYOUT_ARGUMENTS = ("axis", "axis1", "axis2", "ndmin", "k", "maxsize")
LAYOUT_CALLS = ("zeros", "ones", "empty", "eye", "reshape", "transpose", "slice")


@dataclass(frozen=True, order=True)
class Key:
    """What a number is known by wherever its file moves, in the table of `classes.tsv`.

    Attributes
    ----------
    file : str
        Name of the file without folder: no two of the package share one. TOML keeps its suffix.
    name : str
        Constant, or function in which the number stands, dotted; the place within a TOML file.
    value : str
        As it is written; the same number twice in one function is one row.
    """

    file: str
    name: str
    value: str


@dataclass(frozen=True)
class Literal:
    """A number of the code.

    Attributes
    ----------
    key : Key
    module : Module
    nodes : tuple
        Where it stands in the syntax tree of the module, as often as it does.
    """

    key: Key
    module: Module
    nodes: tuple[ast.expr, ...]


def code_literals(modules: Iterable[Module]) -> dict[Key, Literal]:
    """Return every number of these modules but 0, 1, -1, 2 and what counts the layout."""
    found: dict[Key, Literal] = {}
    for module in modules:
        for key, node in numbers(module.tree, module.stem):
            before = found.get(key, Literal(key, module, ()))
            found[key] = Literal(key, module, (*before.nodes, node))
    return found


def numbers(
    node: ast.AST, file: str, names: tuple[str, ...] = ()
) -> Iterator[tuple[Key, ast.expr]]:
    """Yield every number below a node, with its key."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, FunctionNode | ast.ClassDef):
            yield from numbers(child, file, (*names, child.name))
        elif isinstance(child, ast.Assign | ast.AnnAssign) and isinstance(
            node, ast.Module | ast.ClassDef
        ):
            yield from numbers(child, file, (*names, assigned(child)))
        elif counts(node, child) or (isinstance(node, ast.AnnAssign) and child is node.annotation):
            continue
        elif (value := number(child)) is None:
            yield from numbers(child, file, names)
        elif value not in PLAIN and isinstance(child, ast.expr):
            yield Key(file, ".".join(names), ast.unparse(child)), child


def number(node: ast.AST) -> float | complex | None:
    """Return the number that a node is, with its sign; None for what is none."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        inner = number(node.operand)
        return None if inner is None else -inner
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float | complex):
        return None if isinstance(node.value, bool) else node.value
    return None


def assigned(node: ast.Assign | ast.AnnAssign) -> str:
    """Return the name that an assignment binds."""
    target = node.targets[0] if isinstance(node, ast.Assign) else node.target
    return ast.unparse(target)


def counts(parent: ast.AST, child: ast.AST) -> bool:
    """Return whether a place takes a count of the program's own layout: index, power, shape.

    Another number there is another program, not the same one tuned otherwise.
    """
    if isinstance(parent, ast.Subscript):
        return child is parent.slice
    if isinstance(parent, ast.BinOp):
        return isinstance(parent.op, ast.Pow) and child is parent.right
    if isinstance(parent, ast.keyword):
        return parent.arg in LAYOUT_ARGUMENTS
    if isinstance(parent, ast.For | ast.comprehension) and child is parent.iter:
        # `for _ in range(20)` counts attempts, `for axis in range(3)` what there is.
        counter = isinstance(parent.target, ast.Name) and parent.target.id == "_"
        return not counter and ast.unparse(child).startswith("range(")
    if isinstance(parent, ast.Call) and child is not parent.func:
        called = parent.func.attr if isinstance(parent.func, ast.Attribute) else parent.func
        return (called.id if isinstance(called, ast.Name) else called) in LAYOUT_CALLS
    return False


def toml_literals(files: Iterable[Path]) -> list[Key]:
    """Return every number of these files but 0, 1, -1 and 2."""
    return [
        Key(path.name, place, repr(value))
        for path in files
        for place, value in _leaves(tomllib.loads(path.read_text(encoding="utf-8")), ())
        if value not in PLAIN
    ]


def _leaves(value: object, names: tuple[str, ...]) -> Iterator[tuple[str, float]]:
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _leaves(inner, (*names, str(name)))
    elif isinstance(value, list):
        for inner in value:
            yield from _leaves(inner, names)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield ".".join(names), value


def toml_files(known: Mapping[str, Module], reached: Iterable[str]) -> list[Path]:
    """Return the TOML files of every room of the package that has a module reached."""
    package = known["host"].path.parent
    rooms = {name.split(".")[1] for name in reached if name.count(".") > 1}
    return [path for room in sorted(rooms) for path in sorted((package / room).rglob("*.toml"))]
