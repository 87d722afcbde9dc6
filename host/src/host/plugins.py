"""What packages plug in by entry point; of a clone what its own pyproject.toml names."""

from __future__ import annotations

import functools
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from host.errors import HostError
from host.resources import CLONE

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

OURS = "flight-test-host"


@dataclass(frozen=True, slots=True)
class Plug:
    """One name that packages plug in.

    Attributes
    ----------
    name : str
    packages : tuple of str
        Installed packages that have this name: one, or it cannot be loaded.
    entry : EntryPoint
    """

    name: str
    packages: tuple[str, ...]
    entry: EntryPoint

    @property
    def place(self) -> str:
        """Module and object, and the package that it is of."""
        return f"{self.entry.value} of package {' and '.join(self.packages)}"

    def load(self, error: type[HostError]) -> Any:
        """Return the object that is plugged in.

        Raises
        ------
        HostError
            As `error`: several packages have the name, or its module cannot be imported.
        """
        if len(self.packages) > 1:
            raise error(
                f"{self.name} is plugged in by {' and '.join(self.packages)}; uninstall all but one"
            )
        try:
            return self.entry.load()
        except Exception as reason:  # whatever the import of somebody's module runs into
            said = " ".join(str(reason).split())
            raise error(
                f"{self.name}: {self.place} cannot be loaded ({type(reason).__name__}: {said});"
                " install that package again"
            ) from reason


def plugged_in(group: str) -> dict[str, Plug]:
    """Return everything that is plugged into a group, by name; nothing is imported.

    Parameters
    ----------
    group : str
        Group of entry points, ``host.identification_methods``.
    """
    return dict(_read(group, tuple(sys.path)))


@functools.lru_cache
def _read(group: str, path: tuple[str, ...]) -> dict[str, Plug]:
    """Return the same; `path` is what a change of makes the answer another."""
    found: dict[str, Plug] = {}
    for package, entry in sorted(_entries(group), key=lambda one: one[1].name):
        packages = found[entry.name].packages if entry.name in found else ()
        found[entry.name] = Plug(entry.name, (*packages, package), entry)
    return found


def _entries(group: str) -> Iterator[tuple[str, EntryPoint]]:
    # An import of 40 ms: where a name is asked for that is not built in.
    from importlib.metadata import EntryPoint, entry_points

    # An editable install keeps the entry points of its day, and PYTHONPATH brings none.
    own = CLONE / "host" / "pyproject.toml"
    in_clone = own.is_file() and (CLONE / "host" / "src").is_dir()
    if in_clone:
        import tomllib

        project = tomllib.loads(own.read_text(encoding="utf-8"))["project"]
        for name, value in project.get("entry-points", {}).get(group, {}).items():
            yield OURS, EntryPoint(name, value, group)
    for entry in entry_points(group=group):
        package = entry.dist.name if entry.dist else "unknown"
        if not (in_clone and package == OURS):
            yield package, entry
