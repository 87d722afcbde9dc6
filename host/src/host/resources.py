"""Where the layouts and the default calibration are: in the wheel, else in the clone."""

from __future__ import annotations

import os
from pathlib import Path

PACKED = Path(__file__).parent / "data"
CLONE = Path(__file__).parents[3]

# name -> place in the clone; hatch packs the same files into host/data (pyproject.toml).
_FILES = {
    "schema.json": Path("protocol/generated/schema.json"),
    "packets.json": Path("protocol/generated/packets.json"),
    "default.toml": Path("hw/calibration/default.toml"),
    "settings.toml": Path("firmware/settings.toml"),
}

# Schemas of released formats that the firmware of today no longer writes, a file each.
_RELEASED = (PACKED / "released", CLONE / "protocol/released")


def user_cache() -> Path | None:
    """Return the folder for what is made once and kept; None where nobody has a home."""
    own = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    try:
        return Path(own).expanduser() / "flight-test-host"
    except RuntimeError:
        return None


def released_schemas() -> list[Path]:
    """Return the files of schemas that logs of earlier firmware follow."""
    return next((sorted(folder.glob("*.json")) for folder in _RELEASED if folder.is_dir()), [])


def resource(name: str) -> Path:
    """Return the path of a packed file.

    Parameters
    ----------
    name : str
        ``schema.json``, ``packets.json``, ``default.toml`` or ``settings.toml``.

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
