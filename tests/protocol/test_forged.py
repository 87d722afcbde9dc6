"""What a forged log once did to the computer, and may not: memory, time, files, the terminal."""

import json
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from host.cli import main
from host.errors import LogError
from host.log import read_log
from host.text import shown
from host.wire.blocks import scan
from host.wire.window_crc import RESIDUE, sealed
from numpy.typing import NDArray

from tests.protocol import fuzz_log
from tests.protocol.flights import simple_log
from tests.protocol.forging import with_schema
from tests.protocol.log_writer import BLOCK, LogWriter, block

FLIGHT = simple_log(1.0)
DATA = FLIGHT.data()
# Runs `host decode` with 1.5 GB of memory, numpy and pandas included.
LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (3 << 29, 3 << 29))
from host.cli import main
sys.exit(main(["decode", sys.argv[1], "-o", sys.argv[1] + ".csv"]))
"""


def of_flight(sequence: int, payload: bytes = b"", **head: Any) -> bytes:
    """Return a sealed block of the flight."""
    of = {"file_id": FLIGHT.file_id, "session": 1, "schema_hash": FLIGHT.schema_hash}
    return block(payload, **{**of, "sequence": sequence, **head})


def altered(change: Callable[[dict[str, Any]], None]) -> bytes:
    """Return the flight with a changed schema, every CRC right."""

    def of_text(text: bytes) -> bytes:
        schema = json.loads(text)
        change(schema)
        return json.dumps(schema).encode("ascii")

    return with_schema(DATA, of_text)


def of(schema: dict[str, Any], name: str) -> dict[str, Any]:
    """Return a frame of a schema."""
    frame: dict[str, Any] = next(one for one in schema["frames"] if one["name"] == name)
    return frame


def test_sequence_of_four_billion_takes_no_memory(tmp_path: Path) -> None:
    path = tmp_path / "flight.bin"
    path.write_bytes(DATA + of_flight(4_000_000_000))
    ended = subprocess.run(
        [sys.executable, "-c", LIMITED, str(path)], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 3, ended.stderr
    (gap, _) = read_log(path).loss.losses
    assert gap.blocks == 4_000_000_000 - FLIGHT.sequence


BAD_NAMES = ["../escape", "/tmp/escape", "a/b", "con", "", "A", "=1+1", "\x1b[31m", "a" * 33, "a b"]


@pytest.mark.parametrize("name", BAD_NAMES)
@pytest.mark.parametrize("what", ["frame", "field"])
def test_names_are_checked_at_the_door(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], what: str, name: str
) -> None:
    def rename(schema: dict[str, Any]) -> None:
        if what == "frame":
            of(schema, "mag")["name"] = name
        else:
            of(schema, "mag")["fields"][1][0] = name

    folder = tmp_path / "in"
    folder.mkdir()
    path = folder / "flight.bin"
    path.write_bytes(altered(rename))
    code = main(["decode", str(path), "--frames", "-o", str(folder / "flight.csv")])
    said = capsys.readouterr()
    if (what, name) == ("field", "con"):  # a column may be called so
        assert code == 0
        return
    assert code == 2
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert said.err.rstrip("\n").isprintable()
    assert [one.name for one in tmp_path.iterdir()] == ["in"]
    assert [one.name for one in folder.iterdir()] == ["flight.bin"]
    assert not Path("/tmp/escape.csv").exists()


CHANGES: dict[str, Callable[[dict[str, Any]], None]] = {
    "no ident": lambda s: s["frames"].remove(of(s, "ident")),
    "ident without a field": lambda s: of(s, "ident")["fields"].pop(10),
    "t_us of another type": lambda s: of(s, "ident")["fields"][0].__setitem__(1, "f32"),
    "gps without fix": lambda s: of(s, "gps")["fields"].__delitem__(slice(14, 16)),
    "two frames of one name": lambda s: of(s, "mag").update(name="gps"),
    "two frames of one id": lambda s: of(s, "mag").update(id=5),
    "id 0": lambda s: of(s, "mag").update(id=0),
    "id true": lambda s: of(s, "mag").update(id=True),
    "id of a hundred digits": lambda s: of(s, "mag").update(id=10**100),
    "array of a billion": lambda s: of(s, "mag")["fields"][1].__setitem__(1, "u8[999999999]"),
    "frame of 600 bytes": lambda s: of(s, "mag")["fields"].append(["more", "char[600]"]),
    "field called id": lambda s: of(s, "mag")["fields"][1].__setitem__(0, "id"),
    "scale 0": lambda s: of(s, "ident")["fields"][4].__setitem__(3, 0),
    "scale infinite": lambda s: of(s, "ident")["fields"][4].__setitem__(3, float("inf")),
    "scale not a number": lambda s: of(s, "ident")["fields"][4].__setitem__(3, float("nan")),
    "scale a text": lambda s: of(s, "ident")["fields"][4].__setitem__(3, "1"),
    "unit of a line": lambda s: of(s, "ident")["fields"][4].__setitem__(2, "a\nb"),
    "delay of a year": lambda s: of(s, "ident")["fields"][4].__setitem__(8, 3.2e13),
    "delay keyed by text": lambda s: of(s, "ident")["fields"][4].__setitem__(8, {"x": 1}),
    "valid bit 99": lambda s: of(s, "ident")["fields"][4].__setitem__(6, 99),
    "age of nothing": lambda s: of(s, "ident")["fields"][4].__setitem__(7, "nothing"),
    "forty valid bits": lambda s: s["bits"].update(valid=[f"b{at}" for at in range(40)]),
    "no words of events": lambda s: s["enum"].update(event={}),
    "words that are no numbers": lambda s: s["enum"].update(event={"session_end": "2"}),
    "frames no list": lambda s: s.update(frames={}),
    "fields no lists": lambda s: of(s, "mag").update(fields=[1, 2]),
}


@pytest.mark.parametrize("what", CHANGES)
def test_numbers_and_shapes_are_checked_at_the_door(tmp_path: Path, what: str) -> None:
    path = tmp_path / "flight.bin"
    path.write_bytes(altered(CHANGES[what]))
    with pytest.raises(LogError, match="schema") as caught:
        read_log(path)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("text", [b"[" * 60_000, b"\xff\xfe{}", b"9" * 5000, b"null", b"", b"{}"])
def test_text_that_is_no_schema(tmp_path: Path, text: bytes) -> None:
    path = tmp_path / "flight.bin"
    path.write_bytes(with_schema(DATA, lambda _: text))
    with pytest.raises(LogError, match="schema"):
        read_log(path)


def test_a_schema_that_may_stand_there_is_read(tmp_path: Path) -> None:
    path = tmp_path / "flight.bin"
    path.write_bytes(altered(lambda schema: of(schema, "mag").update(name="compass")))
    log = read_log(path)
    assert log.frames["compass"].tobytes() == FLIGHT.truth("mag")[0].tobytes()


def test_log_texts_do_not_reach_the_terminal_nor_a_spreadsheet(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    writer = LogWriter()
    writer.begin()
    writer.put("identity", t_us=1, board=b"\x1b[2J\x07mega", firmware=b"a\nb\x9b31m\rc")
    writer.put("config", t_us=2, rate_hz=100, aircraft=b'=1+1,"x')
    for count in range(3):
        writer.put("ident", t_us=10_000 * count, count=count)
    writer.end(t_us=40_000)
    path = tmp_path / "flight.bin"
    path.write_bytes(writer.data())
    assert main(["decode", str(path), "--frames", "-o", str(tmp_path / "flight.csv")]) == 0
    assert main(["info", str(path)]) == 0
    said = capsys.readouterr()
    assert all(line.isprintable() for line in (said.out + said.err).splitlines())
    assert "\\x1b[2J\\x07mega" in said.out
    cells = (tmp_path / "flight.frames/config.csv").read_text()
    assert '"\'=1+1,""x"' in cells
    assert "\x1b" not in (tmp_path / "flight.frames/identity.csv").read_text()


def test_shown_is_one_harmless_line() -> None:
    assert shown("alpha 0.5 rad, µ") == "alpha 0.5 rad, µ"
    assert (
        shown("\x1b]0;x\x07\u202e\u2028\r\n\udcff") == "\\x1b]0;x\\x07\\u202e\\u2028\\x0d\\x0a\\xff"
    )
    assert all(shown(chr(code)).isprintable() for code in range(0x3000))


def test_windows_of_any_byte_are_checked_as_zlib_does() -> None:
    rng = np.random.default_rng(6)
    buffer = bytearray(rng.bytes(20_000))
    for at in (0, 512, 700, 3000, 3512, 9999, len(buffer) - BLOCK):
        end = at + BLOCK - 4
        buffer[end : end + 4] = struct.pack("<I", zlib.crc32(buffer[at:end]))
    starts = np.arange(len(buffer) - BLOCK + 1)
    wanted = [zlib.crc32(buffer[at : at + BLOCK]) == RESIDUE for at in starts.tolist()]
    assert sum(wanted) >= 5
    assert sealed(bytes(buffer), starts).tolist() == wanted
    assert sealed(bytes(buffer), starts[1::7]).tolist() == wanted[1::7]


def test_a_megabyte_of_beginnings_of_blocks_costs_no_crc_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Counted work: bytes under a CRC, of the worst file against a clean one of its size."""
    plain = zlib.crc32
    work = [0]

    def counted(data: bytes, start: int = 0) -> int:
        work[0] += len(data)
        return plain(data, start)

    path = tmp_path / "flight.bin"
    path.write_bytes((DATA * 80)[: 1 << 20])
    sealed(bytes(BLOCK), np.zeros(1, np.int64))  # its tables are made once

    def one_pass(buffer: bytes, starts: NDArray[np.int64]) -> NDArray[np.bool_]:
        work[0] += len(buffer)
        return sealed(buffer, starts)

    monkeypatch.setattr(zlib, "crc32", counted)
    monkeypatch.setattr("host.wire.blocks.sealed", one_pass)
    scan(path)
    clean, work[0] = work[0], 0
    assert clean >= 1 << 20
    path.write_bytes((b"FLT1\0\0\0" * 150_000)[: 1 << 20])  # `used` and `kind` are right in each
    scan(path)
    assert work[0] <= 20 * clean


def test_a_session_in_every_block_is_refused_and_each_can_be_read(tmp_path: Path) -> None:
    rows, _ = FLIGHT.truth("ident")
    payload = rows[:1].tobytes()
    path = tmp_path / "flight.bin"
    path.write_bytes(
        DATA
        + b"".join(of_flight(FLIGHT.sequence + at, payload, session=at) for at in range(2, 400))
    )
    with pytest.raises(LogError, match="--session N"):
        read_log(path)
    assert len(read_log(path, session=77).frames["ident"]) == 1


def test_million_holes_are_listed_ten_thousand_times(tmp_path: Path) -> None:
    rows, _ = FLIGHT.truth("ident")
    made = np.resize(rows, 7 * 3000).copy()
    made["count"] = np.arange(len(made)) * 3 & 0xFFFF
    made["t_us"] = np.arange(len(made)) * 10_000
    body, size = made.tobytes(), 7 * made.dtype.itemsize
    blocks = [of_flight(FLIGHT.sequence + at, body[at * size :][:size]) for at in range(3000)]
    path = tmp_path / "flight.bin"
    path.write_bytes(DATA + b"".join(blocks))
    losses = read_log(path).loss.losses
    assert len(losses) < 10_010
    assert sum(loss.ranges for loss in losses) > 20_000


CARD_BYTES = 32_000_000_000


@pytest.mark.parametrize("metadata", ["zeros", "garbage"])
def test_newest_flight_of_a_cards_image(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], metadata: str
) -> None:
    newest = simple_log(2.0, session=9, seed=4, preallocated=1 << 20)
    path = tmp_path / "card.img"
    with path.open("wb") as file:
        file.truncate(CARD_BYTES)
        file.write(bytes(510) + b"\x55\xaa")
        file.write(np.random.default_rng(1).bytes(1 << 20) if metadata == "garbage" else b"")
        file.seek(64 << 20)
        file.write(DATA)
        file.seek(20_000_000_512)
        file.write(newest.data()[: -4 * BLOCK])  # never closed
    log = read_log(path)
    wanted, blocks = newest.truth("ident")
    kept = wanted[blocks < newest.sequence - 4]
    assert log.frames["ident"].tobytes() == kept.tobytes()
    assert (log.complete, log.loss.losses) == ("truncated", ())
    assert log.selection.base == 20_000_000_512
    assert log.loss.unproven_bytes == (1 << 20) - (newest.sequence - 4) * BLOCK
    (older,) = log.selection.foreign
    assert read_log(path, file_id=older.file_id).complete == "complete"
    assert main(["info", str(path)]) == 0
    assert main(["decode", str(path), "-o", str(tmp_path / "flight.csv")]) == 0
    assert "begins at byte 20000000512" in capsys.readouterr().out


@pytest.mark.parametrize("kind", fuzz_log.KINDS)
def test_two_hundred_mutations(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert fuzz_log.main([kind, "--seed", "5000", "--count", "200", "--no-limit"]) == 0, (
        capsys.readouterr().out
    )


@pytest.mark.parametrize("kind", ["csv", "npz", "mat", "parquet"])
def test_fields_called_as_parts_of_a_format_are_columns_like_others(
    tmp_path: Path, kind: str
) -> None:
    names = ["file", "units", "notes", "meaning", "allow_pickle", "a" * 31 + "b", "a" * 31 + "c"]

    def more(schema: dict[str, Any]) -> None:
        schema["frames"].append(
            {"id": 99, "name": "more", "rate_hz": 0,
             "fields": [["t_us", "u32"], *([name, "f32"] for name in names)]}
        )  # fmt: skip

    text = altered(more)
    value = int.from_bytes(text[16:20], "little")
    nan = bytes([99]) + bytes(4) + struct.pack("<f", float("nan")) * len(names)
    behind = of_flight(len(text) // BLOCK, nan, schema_hash=value)
    path = tmp_path / "flight.bin"
    path.write_bytes(text + behind)
    target = tmp_path / f"flight.{kind}"
    assert main(["decode", str(path), "--frames", "-o", str(target)]) in (0, 3)
    assert (tmp_path / f"flight.frames/more.{kind}").stat().st_size > 100
    assert main(["info", str(path)]) == 0


@pytest.mark.parametrize("seed", [9274, 12412])
def test_what_cannot_be_rounded_is_written_as_it_is(seed: int) -> None:
    """A signalling NaN; a scale that makes values of 1e305."""
    assert fuzz_log.main(["forged", "--seed", str(seed), "--count", "1", "--no-limit"]) == 0
