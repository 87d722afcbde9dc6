"""Docstrings of sysid: a function's begins with an imperative verb, a class's with a noun.

Everywhere a docstring, a paragraph or a description in it, and a comment open with their subject:
"Of the trim." says what belongs to the trim, and leaves open what.
"""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SYSID = ROOT / "host/src/host/sysid"
FOLDERS = ("host/src/host", "host/studies", "tests", "protocol", ".ci")
# Verbs that a function may begin with; a new one is added here.
VERBS = """
    Add Apply Assess Average Build Call Check Choose Compare Convert Correct Cut Delay Discretise
    Do Doubt Draw End Estimate Evaluate Filter Find Fit Fly Free Go Grade Halve Hold Identify
    Integrate Invert Iterate Join Leave Mark Maximise Minimise Name Overwrite Pass Predict Put Raise
    Read Reconstruct Refuse Regress Replace Return Run Say Set Show Simulate Solve Step Take Test
    Transfer Try Update Whiten Write Yield
"""
# Openings of a class that are no noun.
NO_NOUN = """
    All Are As At By Collects Do Does For How If In Is No Of On Per Since What When Where Whether
    Which Who Whose Why With Without
"""
# Words with too many meanings (`GRADES` and a key of the reconstruction's JSON are public).
UNCLEAR = re.compile(r"\b(felt|what stands)\b", re.IGNORECASE)
WITHOUT_SUBJECT = "Of "


def docstring_breaches(tree: ast.AST, where: str) -> Iterator[str]:
    """Yield a line for every docstring that begins with another kind of word."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.FunctionDef | ast.ClassDef):
            continue
        first = (ast.get_docstring(node) or "Return").split()[0].rstrip(".,:;")
        if isinstance(node, ast.ClassDef):
            if first in NO_NOUN.split():
                yield f"{where}: class {node.name} begins with {first!r}, expected a noun"
        elif not _is_property(node) and first not in VERBS.split():
            yield f"{where}: {node.name} begins with {first!r}, expected an imperative verb"


def without_subject(text: str) -> Iterator[str]:
    """Yield the lines of docstrings and comments that open with a genitive of nothing."""
    if WITHOUT_SUBJECT not in text:
        return
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            yield from _opening_lines((ast.get_docstring(node) or "").split("\n"))
    comments = {
        token.start: token.string.removeprefix("# ")
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type == tokenize.COMMENT
    }
    for (row, column), comment in comments.items():
        if comment.startswith(WITHOUT_SUBJECT) and (row - 1, column) not in comments:
            yield comment


def _opening_lines(lines: list[str]) -> Iterator[str]:
    """Yield lines that open a paragraph or a description, the first of a deeper indent."""
    for before, line in zip(["", *lines], lines, strict=False):
        deeper = len(line) - len(line.lstrip()) > len(before) - len(before.lstrip())
        if line.lstrip().startswith(WITHOUT_SUBJECT) and (deeper or not before.strip()):
            yield line.strip()


def _is_property(node: ast.FunctionDef) -> bool:
    """Return whether a function is read like an attribute: a noun says what it is."""
    return any("property" in ast.unparse(one) for one in node.decorator_list)


def test_docstrings_begin_with_a_verb_or_a_noun() -> None:
    found: list[str] = []
    for path in sorted(SYSID.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        where = str(path.relative_to(ROOT))
        found += docstring_breaches(ast.parse(text), where)
        found += [f"{where}: {word}" for word in UNCLEAR.findall(text)]
    assert not found, "\n".join(found)


def test_docstrings_and_comments_open_with_their_subject() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {line}"
        for folder in FOLDERS
        for path in sorted((ROOT / folder).rglob("*.py"))
        for line in without_subject(path.read_text(encoding="utf-8"))
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    "text",
    [
        'def f():\n    """Of a check."""',
        '"""A flight.\n\nOf several the first.\n"""',
        'class C:\n    """A flight.\n\n    x : float\n        Of the trim.\n    """',
        "# Of a sample.\nX = 1",
        "X = 1  # Of a sample",
    ],
)
def test_an_opening_without_a_subject_is_found(text: str) -> None:
    assert len(list(without_subject(text))) == 1


@pytest.mark.parametrize(
    "text",
    [
        'def f():\n    """Return rows, and those\n    Of the trim.\n    """',
        "# A share.\n# Of several the first.\nX = 1",
        "X = 1  # of a sample",
        'X = """Of a sample"""',
    ],
)
def test_what_opens_with_a_subject_passes(text: str) -> None:
    assert not list(without_subject(text))


@pytest.mark.parametrize(
    "text",
    [
        'def f():\n    """What a flight says."""',
        'def f():\n    """The lines."""',
        'def f():\n    """Names of the constants."""',
        'def f():\n    """Attitude and wind angles."""',
        'def f():\n    """Returns the lines."""',
        'class C:\n    """What a flight says."""',
        'class C:\n    """Collects terms."""',
        'class C:\n    def f(self):\n        """A value."""',
    ],
)
def test_another_opening_is_found(text: str) -> None:
    assert list(docstring_breaches(ast.parse(text), "here"))


@pytest.mark.parametrize(
    "text",
    [
        'def f():\n    """Return what a flight says."""',
        'def f():\n    """Pass the lines on."""',
        'class C:\n    """A flight."""',
        'class C:\n    @property\n    def f(self):\n        """The lines."""',
        "def f(): pass",
    ],
)
def test_a_verb_and_a_noun_pass(text: str) -> None:
    assert not list(docstring_breaches(ast.parse(text), "here"))
