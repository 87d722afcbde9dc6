"""The package as syntax trees: modules, imports, functions with their size and complexity."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "host" / "src"
PROJECT = ROOT / "host" / "pyproject.toml"

MODULE_NAME = re.compile(r"\bhost(?:\.\w+)+")
FunctionNode = ast.FunctionDef | ast.AsyncFunctionDef
# Each adds a path through a function; `and` and `or` are counted apart.
BRANCHES = (ast.If, ast.For, ast.AsyncFor, ast.While, ast.ExceptHandler, ast.With, ast.AsyncWith,
            ast.IfExp, ast.comprehension)  # fmt: skip


@dataclass(frozen=True)
class Module:
    """One file of the package.

    Attributes
    ----------
    name : str
        Dotted, as it is imported.
    path : Path
    """

    name: str
    path: Path

    @cached_property
    def text(self) -> str:
        """Return the text of the file."""
        return self.path.read_text(encoding="utf-8")

    @cached_property
    def tree(self) -> ast.Module:
        """Return the syntax tree."""
        return ast.parse(self.text)

    @property
    def stem(self) -> str:
        """Return the name of the file; of a package that of its folder."""
        return self.name.rpartition(".")[2]

    @cached_property
    def offered(self) -> dict[str, str]:
        """Return what a face offers (`host.faces.lazily`): module, relative, by name."""
        for node in self.tree.body:
            made = node.value if isinstance(node, ast.Assign) else None
            if isinstance(made, ast.Call) and ast.unparse(made.func) == "lazily":
                return dict(ast.literal_eval(made.args[-1]))
        return {}

    def homes(self, name: str, known: Mapping[str, Module]) -> list[str]:
        """Return the module that holds a name of this face; nothing of another file."""
        if name not in self.offered:
            return []
        up = len(self.offered[name]) - len(self.offered[name].lstrip("."))
        package = ".".join(self.name.split(".")[: len(self.name.split(".")) - up])
        return [m for m in (f"{package}.{self.offered[name].lstrip('.')}",) if m in known]

    @property
    def lines(self) -> int:
        """Return how many lines the file has."""
        return self.text.count("\n")


@dataclass(frozen=True)
class Function:
    """A function, its body's lines without docstring, and its paths."""

    module: Module
    name: str
    lines: int
    complexity: int

    @property
    def label(self) -> str:
        """Return file and name, as they are declared."""
        return f"{self.module.stem}:{self.name}"


def modules(sources: Path = SOURCES) -> dict[str, Module]:
    """Return every module below a folder by its dotted name."""
    found = {}
    for path in sorted(sources.rglob("*.py")):
        parts = path.relative_to(sources).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found[name] = Module(name, path)
    return found


def functions(module: Module) -> Iterator[Function]:
    """Yield every function of a module, those within others too; each counts only its own."""
    for name, node in named_functions(module.tree):
        yield Function(module, name, body_lines(node), complexity(node))


def named_functions(
    node: ast.AST, outer: tuple[str, ...] = ()
) -> Iterator[tuple[str, FunctionNode]]:
    """Yield every function below a node with its name, dotted from class or function."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, FunctionNode | ast.ClassDef):
            inner = (*outer, child.name)
            if isinstance(child, FunctionNode):
                yield ".".join(inner), child
            yield from named_functions(child, inner)
        else:
            yield from named_functions(child, outer)


def body_lines(node: FunctionNode) -> int:
    """Return the lines of a function from `def` to its end, without its docstring."""
    size = (node.end_lineno or node.lineno) - node.lineno + 1
    if ast.get_docstring(node) is not None:
        text = node.body[0]
        size -= (text.end_lineno or text.lineno) - text.lineno + 1
    return size


def complexity(node: FunctionNode) -> int:
    """Return 1 and one more for each branch, loop, comprehension and its ifs, `and` and `or`.

    Functions within count for themselves, lambdas for the function they stand in.
    """
    count = 1
    for part in _own(node):
        if isinstance(part, BRANCHES):
            count += 1
        if isinstance(part, ast.comprehension):
            count += len(part.ifs)
        if isinstance(part, ast.BoolOp):
            count += len(part.values) - 1
    return count


def _own(node: ast.AST) -> Iterator[ast.AST]:
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, FunctionNode | ast.ClassDef):
            yield child
            yield from _own(child)


def imports(module: Module, known: Mapping[str, Module], *, by_name: bool = True) -> set[str]:
    """Return the modules of the package that one imports when it runs, in functions too.

    Imports for type checkers are left out. A name that a face offers leads to the module that it
    is in, and no other name of that face does.

    Parameters
    ----------
    module : Module
    known : mapping of str to Module
        Every module of the package.
    by_name : bool
        Count a module that a text names, as `import_module` and generated code do.
    """
    found: set[str] = set()
    _collect(module.tree, module, known, found, by_name)
    found.discard(module.name)
    return found


def _collect(
    node: ast.AST, module: Module, known: Mapping[str, Module], found: set[str], by_name: bool
) -> None:
    if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
        for part in node.orelse:
            _collect(part, module, known, found, by_name)
        return
    if isinstance(node, ast.Import):
        found.update(name.name for name in node.names if name.name in known)
    elif isinstance(node, ast.ImportFrom):
        base = _base(node, module)
        for name in node.names:
            inner = f"{base}.{name.name}"
            found.update({inner if inner in known else base} & set(known))
            if base in known:
                found.update(known[base].homes(name.name, known))
    elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        for face in [one for one in found if one.rpartition(".")[2] == node.value.id]:
            found.update(known[face].homes(node.attr, known))
    elif by_name and isinstance(node, ast.Constant) and isinstance(node.value, str):
        found.update(set(MODULE_NAME.findall(node.value)) & set(known))
    for child in ast.iter_child_nodes(node):
        if not is_text(child):
            _collect(child, module, known, found, by_name)


def is_text(node: ast.AST) -> bool:
    """Return whether a statement is a string alone, as docstrings are."""
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def _base(node: ast.ImportFrom, module: Module) -> str:
    if not node.level:
        return node.module or ""
    parts = module.name.split(".")
    above = node.level - (module.path.name == "__init__.py")
    return ".".join((*parts[: len(parts) - above], *filter(None, [node.module])))


def reachable(starts: Iterable[str], known: Mapping[str, Module]) -> set[str]:
    """Return the modules that importing some can lead to, and themselves.

    A method is registered by the name of its file alone.
    """
    found: set[str] = set()
    ahead = list(starts)
    while ahead:
        name = ahead.pop()
        if name not in found:
            found.add(name)
            ahead += imports(known[name], known)
            ahead += plugged_in(known[name], known)
    return found


def plugged_in(module: Module, known: Mapping[str, Module]) -> set[str]:
    """Return the modules that a registry of methods names by their file.

    They are the first argument of a call of `Method`.
    """
    stems = {
        node.args[0].value
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "Method"
        and node.args
        and isinstance(node.args[0], ast.Constant)
    }
    return {name for name, one in known.items() if one.stem in stems}


def entry_points(project: Path = PROJECT) -> list[str]:
    """Return the modules that the package plugs into its own doors."""
    groups = tomllib.loads(project.read_text(encoding="utf-8"))["project"].get("entry-points", {})
    return [text.partition(":")[0] for group in groups.values() for text in group.values()]


def circles(known: Mapping[str, Module]) -> list[list[str]]:
    """Return every set of modules that import each other in a circle (Tarjan's components).

    Imports within functions count: who needs whom is the question, not whether it loads.
    """
    links = {name: sorted(imports(one, known, by_name=False)) for name, one in known.items()}
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in links[name]:
            if other not in index:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], index[other])
        if low[name] == index[name]:
            part = stack[stack.index(name) :]
            del stack[stack.index(name) :]
            if len(part) > 1:
                found.append(sorted(part))

    for name in sorted(links):
        if name not in index:
            visit(name)
    return sorted(found)
