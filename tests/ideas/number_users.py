"""Which functions a number acts in: its own, or those that read the constant it stands in."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator

from tests.ideas.literals import Key, numbers
from tests.ideas.sources import FunctionNode, Module

BODY = "<module>"
KERNEL = ("compiled", "kernel", "part_by_arrays")  # decorators of what Python may never enter


def users(known: Iterable[Module]) -> dict[Key, set[str]]:
    """Return the outermost functions in which each number acts, as ``file:function``.

    A number without an entry may act anywhere: it is read in the body of a module or of a class, or
    in a kernel, or nobody names its constant.
    """
    modules = list(known)
    readers: dict[str, set[str]] = {}
    for module in modules:
        for place, name in _read(module.tree, module.stem, ()):
            readers.setdefault(name, set()).add(place)
    found = {}
    for module in modules:
        for key, _ in numbers(module.tree, module.stem):
            places = _places(key, readers)
            if places and not any(one.endswith(BODY) for one in places):
                found[key] = places
    return found


def _places(key: Key, readers: dict[str, set[str]]) -> set[str]:
    names = key.name.strip("()").split(", ")
    if all(name.isupper() for name in names):
        return {place for name in names for place in readers.get(name, ())}
    outermost = key.name.partition(".")[0]
    return {f"{key.file}:{BODY if outermost[:1].isupper() else outermost}"}


def _read(node: ast.AST, stem: str, inside: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Yield where a name is read, as ``file:outermost function``, and the name."""
    for child in ast.iter_child_nodes(node):
        below = inside
        if isinstance(child, FunctionNode | ast.ClassDef) and not inside:
            below = (_entered_as(child),)
        elif isinstance(child, ast.Name | ast.Attribute) and isinstance(child.ctx, ast.Load):
            name = child.id if isinstance(child, ast.Name) else child.attr
            yield f"{stem}:{inside[0] if inside else BODY}", name
        yield from _read(child, stem, below)


def _entered_as(node: ast.AST) -> str:
    """Return the name under which Python notes its entry; the module's body where it may not."""
    if not isinstance(node, FunctionNode):
        return BODY
    decorators = " ".join(ast.unparse(one) for one in node.decorator_list)
    return BODY if any(word in decorators for word in KERNEL) else node.name
