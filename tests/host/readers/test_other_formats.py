"""What is not read is called by its name, with what makes a log or a table of it; gzip is read."""

from __future__ import annotations

import gzip
import io
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from host.cli import main
from host.readers.autopilot_flight import read_autopilot
from host.readers.readable_file import readable_file
from host.sysid.flight import read_flight_columns

from tests.host.readers import changed_logs as logs
from tests.host.readers.test_clocks import assert_same

pytestmark = pytest.mark.costs(30, "the first of them flies the virtual flight, which is kept")


def workbook() -> bytes:
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w") as file:
        file.writestr("[Content_Types].xml", "<Types/>")
        file.writestr("xl/workbook.xml", "<workbook/>")
    return whole.getvalue()


def sdlog2() -> bytes:
    one = struct.pack("<BBBBB4s16s64s", 0xA3, 0x95, 0x80, 129, 11, b"TIME", b"Q", b"StartTime")
    return one * 3 + bytes(500)


BLACKBOX = b"H Product:Blackbox flight data recorder by Nicholas Sherlock\nH Data version:2\n"
OTHERS: dict[str, tuple[bytes, str, str]] = {
    "LOG00001.TXT": (BLACKBOX, "a Blackbox log", "`blackbox_decode --unit-rotation deg/s"),
    "LOG00002.BBL": (BLACKBOX, "a Blackbox log", "LOG00002.01.csv --map"),
    "a.bfl": (b"\0" * 40 + BLACKBOX, "a Blackbox log", "blackbox_decode"),
    "a.mcap": (b"\x89MCAP0\r\n" + bytes(99), "an MCAP recording", "`mcap cat a.mcap"),
    "a.bag": (b"#ROSBAG V2.0\n" + bytes(99), "a ROS bag", "`rostopic echo -b a.bag"),
    "a.db3": (b"SQLite format 3\0" + bytes(99), "SQLite", "ros2 topic echo --csv"),
    "a.ulge": (b"ULogEnc" + bytes(99), "an encrypted ULog", "decrypt_ulog.py a.ulge"),
    "a.px4log": (sdlog2(), "before ULog (sdlog2)", "sdlog2_dump.py a.px4log > a.csv"),
    "b.bin": (sdlog2(), "before ULog (sdlog2)", "sdlog2_dump.py b.bin"),
    "a.xlsx": (workbook(), "an Excel workbook", "--convert-to csv a.xlsx"),
    "a.zip": (b"PK\x03\x04" + bytes(99), "an archive", "`unzip a.zip`"),
    "a.xls": (b"\xd0\xcf\x11\xe0" + bytes(99), "an Excel workbook", "--convert-to csv a.xls"),
    "a.mat": (b"MATLAB 7.3 MAT-file" + bytes(99), "version 7.3", "save('as7.mat'"),
    "a.csv": (b"\x89HDF\r\n\x1a\n" + bytes(99), "HDF5", "pandas.read_hdf('a.csv')"),
    "a.ulg.xz": (b"\xfd7zXZ\0" + bytes(99), "packed by xz", "`unxz a.ulg.xz`"),
}


@pytest.mark.parametrize("name", sorted(OTHERS))
@pytest.mark.parametrize("verb", ["info", "decode", "maneuvers", "identify", "report"])
def test_a_format_of_others_is_called_by_its_name(
    verb: str, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content, called, command = OTHERS[name]
    path = tmp_path / name
    path.write_bytes(content)
    assert main([verb, str(path)]) == 4
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert called in line
    assert command in line


def packed(source: Path) -> Path:
    target = source.with_name(f"{source.name}.gz")
    target.write_bytes(gzip.compress(source.read_bytes(), 1))
    return target


WRITERS: dict[str, Callable[[Path], Path]] = {
    "a.ulg": logs.px4,
    "a.bin": logs.ardupilot,
    "a.tlog": lambda path: logs.telemetry(path, logs.frames()),
}


@pytest.mark.parametrize("name", sorted(WRITERS))
def test_a_packed_log_is_read(
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    control = WRITERS[name](tmp_path / name)
    path = packed(control)
    assert_same(read_autopilot(readable_file(path)), read_autopilot(control))
    assert main(["decode", str(path), "-o", "table.csv"]) in (0, 3)
    assert f"host maneuvers {path}" in capsys.readouterr().out
    assert len((tmp_path / "table.csv").read_text().splitlines()) > 1000
    assert main(["info", str(path)]) == 0
    assert str(path) in capsys.readouterr().out


def test_a_packed_table_is_read(tmp_path: Path) -> None:
    control = logs.text(tmp_path / "a.csv", logs.lines(logs.table()))
    found, same = (read_flight_columns(path).columns for path in (packed(control), control))
    assert found.keys() == same.keys()
    for name, values in same.items():
        np.testing.assert_array_equal(found[name], values, err_msg=name)


@pytest.mark.parametrize("verb", ["maneuvers", "identify", "decode", "info"])
def test_an_error_line_names_the_gzip(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], verb: str
) -> None:
    """It named what was made of it, in a folder that is gone."""
    packed = tmp_path / "mine.csv.gz"
    packed.write_bytes(gzip.compress(b"seconds,roll\n" + b"1,2\n" * 9))
    assert main([verb, str(packed)]) != 0
    said = capsys.readouterr().err
    assert str(packed) in said and "host-" not in said


def test_a_gzip_is_expanded_no_further_than_it_may(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    once = gzip.compress(bytes(400_000_000), 9)
    bomb, lying, cut = (tmp_path / name for name in ("bomb.csv.gz", "lie.csv.gz", "cut.csv.gz"))
    bomb.write_bytes(once)
    lying.write_bytes(once + gzip.compress(b"t_s\n"))  # the last member says four bytes
    cut.write_bytes(once[:1000])
    for path, code, said in (
        (bomb, 2, "a gzip that says how much it holds, 400 MB"),
        (lying, 2, "a gzip that goes on"),
        (cut, 4, "a gzip that is cut or damaged"),
    ):
        assert main(["maneuvers", str(path)]) == code
        assert said in capsys.readouterr().err
