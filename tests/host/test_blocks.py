"""protocol/cases.toml against the host's block reader, and where blocks are looked for."""

import os
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from host.wire.blocks import scan
from host.wire.extents import data_extents
from host.wire.frames import find_schemas, frame_pieces
from host.wire.schema import Schema
from host.wire.schema_text import known_schemas, packed_schema, parse_schema

from tests.host.logs import ROOT
from tests.protocol.flights import simple_log
from tests.protocol.log_writer import BLOCK

TABLE = tomllib.loads((ROOT / "protocol/cases.toml").read_text())
LOG = simple_log(3.0).data()


def unhex(text: str) -> bytes:
    return bytes.fromhex("".join(text.split()))


@pytest.mark.parametrize("case", TABLE["block"], ids=lambda case: case["name"])
def test_case(tmp_path: Path, case: dict[str, Any]) -> None:
    path = tmp_path / "block.bin"
    path.write_bytes(unhex(case["head"]).ljust(508, b"\0") + unhex(case["crc"]))
    blocks = scan(path).blocks
    assert len(blocks) == (case["verdict"] == "ok")
    if case["verdict"] != "ok":
        return
    for key in ("file_id", "session", "sequence", "schema_hash", "dropped", "used", "kind"):
        assert int(getattr(blocks, key)[0]) == case[key], key
    if case["kind"] == 1:
        return
    schema = parse_schema(known_schemas()[case["schema_hash"]])
    (piece,) = frame_pieces(path, blocks, schema, list(schema.by_name))
    found = [row.tobytes() for frames in piece.frames.values() for row in frames.data]
    assert sorted(found) == sorted(unhex(frame) for frame in case["frames"])
    assert piece.unread_bytes == case["unread"]


@pytest.mark.parametrize("shift", [1, 100, 511])
def test_shifted_blocks_are_found_across_windows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shift: int
) -> None:
    monkeypatch.setattr("host.wire.blocks.WINDOW_BYTES", 8 * BLOCK)
    path = tmp_path / "shifted.bin"
    path.write_bytes(LOG[: 9 * BLOCK] + b"\x11" * shift + LOG[9 * BLOCK :])
    found = scan(path)
    assert found.blocks.sequence.tolist() == list(range(len(LOG) // BLOCK))
    assert found.bad == [(9 * BLOCK, 9 * BLOCK + shift)]


def test_schema_comes_from_the_log_itself(tmp_path: Path) -> None:
    writer = simple_log(1.0)
    text = writer.text.replace(b'["mx","i16","T",9.174311926606e-08', b'["mx","i16","T",2')
    other = type(writer)(text=text)
    other.begin()
    other.end()
    path = tmp_path / "other.bin"
    path.write_bytes(other.data())
    ((_, schema),) = find_schemas(path, scan(path).blocks)
    assert isinstance(schema, Schema)
    assert schema.by_name["mag"].fields[1].scale == 2.0
    assert schema.hash != packed_schema().hash


def test_packed_schema_is_the_generated_one() -> None:
    header = (ROOT / "protocol/generated/schema_blob.h").read_text()
    assert f"0x{packed_schema().hash:08X}u" in header
    assert packed_schema().by_name["ident"].size_bytes <= 68


def test_holes_are_not_read(tmp_path: Path) -> None:
    path = tmp_path / "sparse.bin"
    with path.open("wb") as file:
        file.write(b"x" * 5000)
        file.seek(1 << 30)
        file.write(b"y" * 1000)
    size = path.stat().st_size
    with path.open("rb", buffering=0) as file:
        extents = data_extents(file, size)
    assert sum(end - start for start, end in extents) < 1 << 20
    assert extents[0][0] == 0
    assert extents[-1][1] == size
    assert all(start % BLOCK == 0 for start, _ in extents)
    os.truncate(path, 0)
    with path.open("rb", buffering=0) as file:
        assert data_extents(file, 0) == []


def test_progress_reaches_the_end(tmp_path: Path) -> None:
    path = tmp_path / "log.bin"
    path.write_bytes(LOG)
    seen: list[tuple[int, int]] = []
    scan(path, lambda done, total: seen.append((done, total)))
    assert seen[-1] == (len(LOG), len(LOG))
    assert np.all(np.diff([done for done, _ in seen]) > 0)
