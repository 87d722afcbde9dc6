"""Maps that come with the package: of public data whose layout is documented, by name."""

from __future__ import annotations

from collections.abc import Container
from pathlib import Path

from host.errors import IdentificationError
from host.files.user_text import read_toml

FOLDER = Path(__file__).with_name("maps")
LIST = "list"


def shipped_maps() -> tuple[str, ...]:
    """Return their names."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def is_shipped(given: Path) -> bool:
    """Return whether a map is meant by its name, and no file of the user's is there."""
    return str(given) in shipped_maps() and not given.exists()


def map_file(given: Path) -> Path:
    """Return the file of a map given by name or as a file.

    Raises
    ------
    IdentificationError
        If there is neither.
    """
    if is_shipped(given):
        return FOLDER / f"{given}.toml"
    if not given.exists():
        raise IdentificationError(
            f"{given}: no such map; a file, or of {', '.join(shipped_maps())} (`--map list`)"
        )
    return given


def maps_for(columns: Container[str]) -> list[str]:
    """Return the maps most of whose columns a table has, by names."""
    found = []
    for name in shipped_maps():
        lines = read_toml(FOLDER / f"{name}.toml", IdentificationError)["columns"].values()
        theirs = [line["from"] if isinstance(line, dict) else line for line in lines]
        if sum(one in columns and not one.isdigit() for one in theirs) > 0.5 * len(theirs):
            found.append(name)
    return found


def map_lines() -> list[str]:
    """Return what `--map list` prints: each map's data, and what its layout was taken from."""
    said = []
    for name in shipped_maps():
        about = read_toml(FOLDER / f"{name}.toml", IdentificationError)["about"]
        how = "tried on such data" if about["tried"] else "made from documents alone, not tried"
        said += [f"{name:16s} {about['data']}", f"{'':16s} {how}: {about['layout']}"]
    return said
