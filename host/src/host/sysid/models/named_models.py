"""Models that come with packages, by name: files of folders plugged in by entry point."""

from __future__ import annotations

from pathlib import Path

from host.errors import IdentificationError
from host.plugins import plugged_in

GROUP = "host.identification_models"


def shipped_files() -> dict[str, Path]:
    """Return the model files of all folders that are plugged in, by name.

    Raises
    ------
    IdentificationError
        If a package plugs in what is no folder.
    """
    found: dict[str, Path] = {}
    for plug in plugged_in(GROUP).values():
        folder = plug.load(IdentificationError)
        if not (isinstance(folder, Path) and folder.is_dir()):
            raise IdentificationError(f"{plug.name}: {plug.place}, expected the path of a folder")
        found |= {path.stem: path for path in sorted(folder.glob("*.toml"))}
    return found


def model_path(given: str | Path) -> Path:
    """Return the file of a model: that of its name, unless a file of the user's is called so."""
    path = Path(given)
    return path if path.exists() else shipped_files().get(str(given), path)


def shipped_lines() -> list[str]:
    """Return each name with the first line of its file."""
    said = []
    for name, path in shipped_files().items():
        text = path.read_text(encoding="utf-8")
        comment = [line[2:] for line in text.splitlines() if line.startswith("# ")]
        said += [f"{name:26s} {comment[0]}", *(f"{'':26s} {line}" for line in comment[1:])]
    return said
