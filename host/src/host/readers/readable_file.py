"""The file that is read: of a gzip what it holds; what nobody here reads is called by its name."""

from __future__ import annotations

from pathlib import Path

from host.errors import NotALogError
from host.original.rows import looks_like_rows
from host.readers.gzip_file import expanded, is_gzip
from host.terminal import command_line
from host.wire.blocks import MAGIC
from host.wire.stream import looks_like_stream

HEAD_BYTES = 4096
BLACKBOX = (
    "a Blackbox log of iNav or Betaflight. Its maker's decoder makes a table of it:"
    " `blackbox_decode --unit-rotation deg/s --unit-acceleration g {name}`, then `host maneuvers"
    " {stem}.01.csv --map mine.toml`; what a map says of the outputs: host/LOGS.md"
)
EXCEL = "an Excel workbook; `libreoffice --headless --convert-to csv {name}`"
# How a file begins, or what its head holds, and what turns it into one that is read.
KINDS: tuple[tuple[bytes, bool, str], ...] = (
    (b"H Product:Blackbox", False, BLACKBOX),
    (b"\x89MCAP0\r\n", True, "an MCAP recording; `mcap cat {name} --topics /TOPIC --format=ndjson >"
     " {stem}.ndjson`, and its numbers as CSV"),
    (b"#ROSBAG V", True, "a ROS bag; `rostopic echo -b {name} -p /TOPIC > {stem}.csv`"),
    (b"SQLite format 3\0", True, "an SQLite file, as a ROS 2 bag is one; `ros2 bag play` it and"
     " `ros2 topic echo --csv /TOPIC > {stem}.csv`"),
    (b"ULogEnc", True, "an encrypted ULog of PX4; `python3 Tools/decrypt_ulog.py {name} ''"
     " private_key.pem` of PX4's sources makes the .ulg"),
    (b"MATLAB 7.3", True, "a MAT file of version 7.3 (HDF5); in MATLAB: s = load('{name}');"
     " save('as7.mat', '-struct', 's', '-v7')"),
    (b"\x89HDF", True, "HDF5; `python3 -c \"import pandas; pandas.read_hdf('{name}')"
     ".to_csv('{stem}.csv')\"` where pandas wrote it, else its numbers as CSV, Parquet or MAT"),
    (b"\xd0\xcf\x11\xe0", True, EXCEL),
    (b"%PDF", True, "a PDF; the numbers are needed as CSV"),
    (b"BZh", True, "packed by bzip2; `bunzip2 {name}`"),
    (b"\xfd7zXZ", True, "packed by xz; `unxz {name}`"),
    (b"\x28\xb5\x2f\xfd", True, "packed by zstd; `unzstd {name}`"),
)  # fmt: skip
TABLES = (".csv", ".tsv", ".parquet", ".mat")
ZIP, EXCEL_PART = b"PK\x03\x04", (b"[Content_Types].xml", b"xl/")
DATAFLASH, SDLOG2 = b"\xa3\x95", b"StartTime"


def readable_file(source: Path) -> Path:
    """Return the file to read in place of a source: of a gzip what it holds.

    Raises
    ------
    NotALogError
        If it is of a kind that is not read, with its name and how it becomes one that is.
    """
    if is_gzip(source):
        source = expanded(source)
    if source.is_file():
        with source.open("rb") as file:
            kind = _other_kind(file.read(HEAD_BYTES), source)
        if kind:
            words = kind.format(name=source.name, stem=source.stem)
            raise NotALogError(f"{source}: {words}")
    return source


def refuse_table(source: Path) -> None:
    """Refuse a table where a log is decoded, and say which verbs read it.

    Raises
    ------
    NotALogError
        If the file has the ending of a table, and does not begin as a log does.
    """
    if source.suffix.lower() in TABLES and source.is_file():
        with source.open("rb") as file:
            head = file.read(HEAD_BYTES)
        if MAGIC in head or looks_like_stream(head) or looks_like_rows(head):
            return
        look = command_line("host", "maneuvers", source)
        raise NotALogError(
            f"{source}: a table, not a log; `{look}` reads it, with --map where its names are"
            " others"
        )


def _other_kind(head: bytes, source: Path) -> str:
    """Return what a file is that is not read; empty of all others."""
    for begin, first, words in KINDS:
        if head.startswith(begin) or (not first and begin in head):
            return words
    if b"\x89HDF\r\n" in head[:1024]:  # a MAT file of version 7.3 with another text before it
        return KINDS[5][2]
    if head.startswith(ZIP):
        excel = source.suffix.lower().startswith(".xls") or any(p in head for p in EXCEL_PART)
        return EXCEL if excel else "an archive; `unzip {name}`"
    if head.startswith(DATAFLASH) and SDLOG2 in head:
        return (
            "a log of PX4 before ULog (sdlog2); `python sdlog2_dump.py {name} > {stem}.csv`"
            " (Tools/sdlog2 of PX4's sources to v1.8), and a map of its columns"
        )
    return ""
