"""protocol/cases.toml against the independent decoder and against the host's."""

import tomllib
import zlib
from typing import Any

import pytest

from tests.protocol import log_writer, oracle
from tests.protocol.agreement import decoded

TABLE = tomllib.loads((log_writer.ROOT / "protocol/cases.toml").read_text())
# The schema that the table was made with; later ones have its frames too.
HASHES = {case["schema_hash"] for case in TABLE["block"] if case["verdict"] == "ok"}
(SCHEMA,) = (text for text in log_writer.released_texts() if zlib.crc32(text) in HASHES)
FORMATS = oracle.frame_formats(SCHEMA)


def unhex(value: str) -> bytes:
    return bytes.fromhex("".join(value.split()))


def block_bytes(case: dict[str, Any]) -> bytes:
    return unhex(case["head"]).ljust(508, b"\0") + unhex(case["crc"])


@pytest.mark.parametrize("case", TABLE["telemetry"], ids=lambda case: case["name"])
def test_stream(case: dict[str, Any]) -> None:
    found = oracle.decode_stream(unhex(case["bytes"]))
    expected = oracle.Stream(
        [unhex(frame) for frame in case["frames"]], case["failed"], case["skipped"], case["pending"]
    )
    assert found == expected


@pytest.mark.parametrize("case", TABLE["block"], ids=lambda case: case["name"])
def test_block(case: dict[str, Any]) -> None:
    block = oracle.parse_block(block_bytes(case))
    assert block.verdict == case["verdict"]
    if case["verdict"] != "ok":
        return
    for key in ("file_id", "session", "sequence", "schema_hash", "dropped", "used", "kind"):
        assert getattr(block, key) == case[key], key
    if case["kind"] == 1:
        piece = oracle.PIECE_FORMAT.parse(block.payload[: block.used])
        assert (piece.offset, piece.total) == (case["offset"], case["total"])
        assert piece.text == case["text"].encode()
        return
    frames, unread = oracle.read_frames(block.payload[: block.used], FORMATS)
    assert unread == case["unread"]
    again = []
    for name, values in frames:
        number, layout = next((i, f) for i, (n, f) in FORMATS.items() if n == name)
        again.append(bytes([number]) + layout.build(values))
    assert again == [unhex(frame) for frame in case["frames"]]


@pytest.mark.parametrize("case", TABLE["block"], ids=lambda case: case["name"])
def test_block_as_the_host_reads_it(case: dict[str, Any]) -> None:
    with decoded(block_bytes(case)) as log:
        if case["verdict"] != "ok":
            assert log is None
            return
        assert log is not None
        for key in ("file_id", "session", "sequence", "schema_hash", "dropped", "used", "kind"):
            assert int(getattr(log.blocks, key)[0]) == case[key], key
        wanted: dict[int, bytes] = {}
        for frame in case.get("frames", []):
            wanted[unhex(frame)[0]] = wanted.get(unhex(frame)[0], b"") + unhex(frame)
        for number, (name, _) in FORMATS.items():
            assert log.frames[name].tobytes() == wanted.get(number, b""), name
        assert log.store.unread_bytes == case.get("unread", 0)
