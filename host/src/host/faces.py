"""Names that a package offers, each imported from its module when it is first used."""

from __future__ import annotations

TYPE_CHECKING = False  # of `typing`, whose import takes longer than the rest of this file
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


def lazily(package: str, homes: Mapping[str, str]) -> Callable[[str], object]:
    """Return the `__getattr__` of a package that imports what is asked of it.

    Importing one module of a package runs the package's `__init__`: eager imports there would make
    rooms import each other in a circle, and everything slow.

    Parameters
    ----------
    package : str
    homes : mapping of str to str
        Module inside the package by name. No name may be that of a module, which would hide it.
    """

    def find(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        import importlib

        return getattr(importlib.import_module(f".{homes[name]}", package), name)

    return find
