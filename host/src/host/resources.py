"""Where the schema and the default calibration are: in the wheel, else in the clone."""

from __future__ import annotations

from pathlib import Path

PACKED = Path(__file__).parent / "data"
CLONE = Path(__file__).parents[3]

# name -> place in the clone; hatch packs the same files into host/data (pyproject.toml).
_FILES = {
    "schema.json": Path("protocol/generated/schema.json"),
    "default.toml": Path("hw/calibration/default.toml"),
}


def resource(name: str) -> Path:
    """Return the path of a packed file.

    Parameters
    ----------
    name : str
        ``schema.json`` or ``default.toml``.

    Raises
    ------
    FileNotFoundError
        If neither the wheel nor a clone around this package holds it.
    """
    for path in (PACKED / name, CLONE / _FILES[name]):
        if path.is_file():
            return path
    raise FileNotFoundError(
        f"{name} is neither in the installed package ({PACKED}) nor in a clone ({CLONE});"
        " install ./host again"
    )
