"""A map below the track: tiles of a folder and of MBTiles, and files of a stranger's making."""

import sqlite3
import struct
import time
import zlib
from pathlib import Path

import pytest
from host.cli import main
from host.errors import UsageError
from host.live.map_tiles import MOST_BYTES, open_tiles, picture_type

ZOOM, X, Y = 3, 5, 2  # y from north


def picture(grey: int) -> bytes:
    """Return a PNG of one grey, 4 pixels square."""

    def part(name: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    rows = zlib.compress((b"\0" + bytes([grey]) * 4) * 4)
    head = struct.pack(">IIBBBBB", 4, 4, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", rows) + part(b"IEND", b"")


def folder(path: Path, data: bytes) -> Path:
    place = path / "tiles" / str(ZOOM) / str(X)
    place.mkdir(parents=True)
    (place / f"{Y}.png").write_bytes(data)
    return path / "tiles"


def mbtiles(path: Path, data: bytes, *, view: str = "") -> Path:
    """Write a file as the format says: rows count from south."""
    file = path / "field.mbtiles"
    with sqlite3.connect(file) as base:
        if view:
            base.execute(f"CREATE VIEW tiles AS {view}")
        else:
            base.execute("CREATE TABLE tiles (zoom_level, tile_column, tile_row, tile_data BLOB)")
            base.execute("INSERT INTO tiles VALUES (?, ?, ?, ?)", (ZOOM, X, 7 - Y, data))
    base.close()
    return file


@pytest.mark.parametrize("make", [folder, mbtiles])
def test_a_tile_is_found_by_its_numbers_alone(make: object, tmp_path: Path) -> None:
    assert callable(make)
    tiles = open_tiles(make(tmp_path, picture(80)))
    assert tiles.zooms == (ZOOM, ZOOM)
    assert tiles.tile(ZOOM, X, Y) == picture(80)
    assert tiles.tile(ZOOM, X, Y + 1) is None
    assert tiles.tile(ZOOM + 1, X, Y) is None
    assert picture_type(picture(80)) == "image/png"


@pytest.mark.parametrize("make", [folder, mbtiles])
@pytest.mark.parametrize("data", [picture(1) + bytes(MOST_BYTES), b""], ids=["too large", "empty"])
def test_what_is_no_tile_is_a_hole(make: object, data: bytes, tmp_path: Path) -> None:
    assert callable(make)
    try:
        assert open_tiles(make(tmp_path, data)).tile(ZOOM, X, Y) is None
    except UsageError as refused:  # an MBTiles file shows its first tile when it is opened
        assert make is mbtiles
        assert "\n" not in str(refused)


def test_a_link_out_of_the_folder_is_not_followed(tmp_path: Path) -> None:
    tiles = folder(tmp_path, picture(80))
    secret = tmp_path / "secret.png"
    secret.write_bytes(picture(1))
    (tiles / "3/5/3.png").symlink_to(secret)
    (tiles / "3/6").symlink_to(tmp_path)
    (tmp_path / "4.png").write_bytes(picture(2))
    opened = open_tiles(tiles)
    assert opened.tile(3, 5, 2) == picture(80)
    assert opened.tile(3, 5, 3) is None
    assert opened.tile(3, 6, 4) is None


ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)"
HERE = "5 AS tile_column, 5 AS tile_row"


@pytest.mark.parametrize(
    "view",
    [
        f"{ENDLESS} SELECT i AS zoom_level, {HERE}, x'ffd8ff' AS tile_data FROM n",
        f"SELECT 3 AS zoom_level, {HERE}, zeroblob(2000000000) AS tile_data",
        f"SELECT 3 AS zoom_level, {HERE}, '<svg>' AS tile_data",
        f"SELECT 'a' AS zoom_level, {HERE}, x'ffd8ff' AS tile_data",
        "SELECT 1 AS other",
    ],
    ids=["endless", "huge", "text", "no zoom", "other columns"],
)
def test_sql_of_a_stranger_ends_in_one_line(view: str, tmp_path: Path) -> None:
    file = mbtiles(tmp_path, b"", view=view)
    began_s = time.monotonic()
    with pytest.raises(UsageError) as refused:
        open_tiles(file)
    assert time.monotonic() - began_s < 10.0
    assert str(refused.value).startswith(f"--tiles {file}: ")
    assert "\n" not in str(refused.value)


def test_what_is_no_map_is_refused_before_any_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("noise.mbtiles").write_bytes(bytes(range(256)) * 9)
    Path("cut.mbtiles").write_bytes(mbtiles(tmp_path, picture(9)).read_bytes()[:900])
    (tmp_path / "empty").mkdir()
    (tmp_path / "vector").mkdir()
    vector = mbtiles(tmp_path / "vector", b"\x1f\x8b\x08 a vector tile")
    for name in ("nowhere", "noise.mbtiles", "cut.mbtiles", "empty", str(vector)):
        assert main(["live", "sim:demo", "--no-page", "--tiles", name]) == 2
        err = capsys.readouterr().err
        assert err.count("\n") == 1, err
        assert f"--tiles {name}" in err
    assert not list(tmp_path.glob("*.radio"))
