"""The counts on small packages whose figures are known."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.ideas.declared import kinds
from tests.ideas.sources import (
    Module,
    body_lines,
    circles,
    complexity,
    entry_points,
    functions,
    imports,
    modules,
    named_functions,
    reachable,
)


def written(folder: Path, **texts: str) -> dict[str, Module]:
    """Write modules of a package and return them."""
    (folder / "host").mkdir()
    (folder / "host" / "__init__.py").touch()
    for name, text in texts.items():
        (folder / "host" / f"{name}.py").write_text(text)
    return modules(folder)


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("pass", 1),
        ("if a: pass\n    elif b: pass\n    else: pass", 3),
        ("for a in b: pass", 2),
        ("while a and b and c: pass", 4),
        ("try: pass\n    except E: pass\n    except F: pass", 3),
        ("with a, b: pass", 2),
        ("return a if b or c else d", 3),
        ("return [a for b in c for a in b if a if b]", 5),
        ("return lambda: a or b", 2),
        ("def g():\n        if a: pass", 1),
    ],
)
def test_complexity_of_one_kind_of_branch(body: str, expected: int) -> None:
    node = ast.parse(f"def f():\n    {body}").body[0]
    assert isinstance(node, ast.FunctionDef)
    assert complexity(node) == expected


def test_lines_are_counted_without_docstring() -> None:
    text = 'def f(\n    a,\n):\n    """One.\n\n    Two.\n    """\n    return a'
    [(name, node)] = named_functions(ast.parse(text))
    assert (name, body_lines(node)) == ("f", 4)


def test_functions_within_have_dotted_names(tmp_path: Path) -> None:
    known = written(tmp_path, a="class B:\n    def c(self):\n        def d(): pass")
    assert [part.label for part in functions(known["host.a"])] == ["a:B.c", "a:B.c.d"]


def test_imports_in_functions_and_by_name_count_those_for_types_do_not(tmp_path: Path) -> None:
    text = """'''Of `host.d`.'''
from typing import TYPE_CHECKING
if TYPE_CHECKING:
    from host import d
def f():
    from .b import x
    return import_module("host.c")
"""
    known = written(tmp_path, a=text, b="", c="", d="")
    assert imports(known["host.a"], known) == {"host.b", "host.c"}
    assert imports(known["host.a"], known, by_name=False) == {"host.b"}
    assert reachable(["host.a"], known) == {"host.a", "host.b", "host.c"}


def test_a_name_of_a_face_leads_to_its_own_module_and_to_no_other(tmp_path: Path) -> None:
    face = '__getattr__ = lazily(__name__, {"one": "c", "two": "d", "three": ".e"})'
    text = "from host import b\nfrom host.b import two\ndef f():\n    return b.three"
    written(tmp_path, a=text, c="", d="", e="")
    (tmp_path / "host" / "b").mkdir()
    for name, inside in (("__init__", face), ("c", ""), ("d", "")):
        (tmp_path / "host" / "b" / f"{name}.py").write_text(inside)
    known = modules(tmp_path)
    assert imports(known["host.a"], known) == {"host.b", "host.b.d", "host.e"}


def test_methods_of_a_registry_are_reached(tmp_path: Path) -> None:
    known = written(tmp_path, a='M = {"one": Method("b", "fit")}', b="", c="")
    assert reachable(["host.a"], known) == {"host.a", "host.b"}


def test_entry_points_are_modules(tmp_path: Path) -> None:
    project = tmp_path / "pyproject.toml"
    project.write_text('[project.entry-points.methods]\none = "host.b:ONE"\ntwo = "host.c:TWO"\n')
    assert entry_points(project) == ["host.b", "host.c"]
    assert set(entry_points()) <= set(modules())


def test_circle_of_three_is_found_and_a_chain_is_not(tmp_path: Path) -> None:
    known = written(
        tmp_path,
        a="import host.b",
        b="def f():\n    from host import c",
        c="from host.a import x",
        d="import host.a",
    )
    assert circles(known) == [["host.a", "host.b", "host.c"]]


def test_declaration_names_what_is_gone_and_what_is_not_declared(tmp_path: Path) -> None:
    declared = tmp_path / "declared.toml"
    declared.write_text(
        '[doors]\nnames = ["a:identify", "b:identify"]\nothers = ["c:identify_not"]\n'
        'like = ":identify"\n'
    )
    [doors] = kinds({"a:identify", "d:identify_more"}, declared).values()
    assert doors.found == ("a:identify",)
    assert doors.gone == ("b:identify", "c:identify_not")
    assert doors.unseen == ("d:identify_more",)
    assert len(doors.faults) == 3
