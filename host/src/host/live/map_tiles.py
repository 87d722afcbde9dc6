"""Pictures of the ground from this computer: a folder z/x/y.png, or an MBTiles file (SQLite).

Whose file it is, is not known: numbers name a tile and nothing else, a link out of the folder is
not followed, a tile is small and begins as a picture does, and SQL of the file ends when it takes
long.
"""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Protocol

from host.errors import UsageError
from host.files.regular import regular_file
from host.text import shown

MOST_ZOOM = 22
MOST_BYTES = 1 << 20  # of a tile: 256 or 512 pixels square
_STEPS = 1000  # of SQLite's machine between two looks
_LOOKS = 2000  # 2 million steps: a tile takes some hundred, a look through an index some thousand
_SQLITE = b"SQLite format 3\0"
_PICTURES = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg"}
_EXPECTED = "expected a folder of z/x/y.png or .jpg, or an .mbtiles file of such"


class MapTiles(Protocol):
    """Where tiles come from.

    Attributes
    ----------
    zooms : (int, int)
        Least and largest zoom there is.
    """

    zooms: tuple[int, int]

    def tile(self, zoom: int, x: int, y: int) -> bytes | None:
        """Return a picture, y from north (as web maps count); None where there is none."""
        ...


def open_tiles(path: Path) -> MapTiles:
    """Return the tiles of a folder or a file.

    Raises
    ------
    UsageError
        In one line: nothing there, no tiles in it, or no MBTiles file.
    """
    if path.is_dir():
        return FolderTiles(path)
    if not path.exists():
        raise UsageError(f"--tiles {path}: no such file or folder")
    return MbTiles(regular_file(path))


def picture_type(data: bytes) -> str:
    """Return the media type of a tile by its first bytes; empty where it is no picture."""
    return next((kind for head, kind in _PICTURES.items() if data.startswith(head)), "")


class FolderTiles:
    """Tiles as files: ``z/x/y.png`` or ``.jpg``."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder.resolve()
        names = [one.name for one in self._folder.iterdir()]
        zooms = [int(name) for name in names if name.isascii() and name.isdecimal()]
        zooms = [zoom for zoom in zooms if zoom <= MOST_ZOOM]
        if not zooms:
            raise UsageError(f"--tiles {folder}: no tiles in it; {_EXPECTED}")
        self.zooms = min(zooms), max(zooms)

    def tile(self, zoom: int, x: int, y: int) -> bytes | None:
        """Return a picture; None where there is none, or a link leads elsewhere."""
        for ending in ("png", "jpg", "jpeg"):
            path = (self._folder / str(zoom) / str(x) / f"{y}.{ending}").resolve()
            if path.is_relative_to(self._folder) and path.is_file():
                with path.open("rb") as file:
                    return _whole(file.read(MOST_BYTES + 1))
        return None


class MbTiles:
    """Tiles of a file, opened to be read only."""

    def __init__(self, path: Path) -> None:
        with path.open("rb") as file:
            if file.read(len(_SQLITE)) != _SQLITE:
                raise UsageError(f"--tiles {path}: no SQLite in it; {_EXPECTED}")
        self._base = sqlite3.connect(
            f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True, check_same_thread=False
        )
        self._base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MOST_BYTES)
        self._looks = 0
        self._base.set_progress_handler(self._took_long, _STEPS)
        try:
            self._base.execute("PRAGMA trusted_schema = OFF")
            first = self._one("SELECT tile_data FROM tiles LIMIT 1")
            ends = [self._one(f"SELECT {end}(zoom_level) FROM tiles") for end in ("min", "max")]
        except sqlite3.Error as error:
            self._base.close()
            raise UsageError(f"--tiles {path}: {shown(str(error))}; {_EXPECTED}") from None
        zooms = [end for end in ends if isinstance(end, int) and 0 <= end <= MOST_ZOOM]
        if len(zooms) < len(ends) or not isinstance(first, bytes) or not picture_type(first):
            self._base.close()
            raise UsageError(f"--tiles {path}: no pictures in it; {_EXPECTED}")
        self.zooms = zooms[0], zooms[1]

    def tile(self, zoom: int, x: int, y: int) -> bytes | None:
        """Return a picture; None where there is none, or its file is damaged there."""
        asked = "SELECT tile_data FROM tiles WHERE zoom_level = ? AND tile_column = ?"
        try:  # rows count from south
            found = self._one(f"{asked} AND tile_row = ?", zoom, x, (1 << zoom) - 1 - y)
        except sqlite3.Error:
            return None
        return _whole(found) if isinstance(found, bytes) else None

    def _one(self, asked: str, *given: int) -> object:
        self._looks = 0
        with closing(self._base.execute(asked, given)) as rows:
            row = rows.fetchone()
        return row[0] if row else None

    def _took_long(self) -> bool:
        self._looks += 1
        return self._looks > _LOOKS


def _whole(data: bytes) -> bytes | None:
    """Return a tile that is a picture and no larger than one."""
    return data if len(data) <= MOST_BYTES and picture_type(data) else None
