"""Logs and files that are not what they should be: every loss is told, every refusal helps."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from host.cli import main
from host.errors import ExitCode, HostError
from host.sysid.flight import read_columns

from tests.host.logs import ROOT

LOG = ROOT / "tests/data/format-1-sitl.bin"


@pytest.fixture(scope="module")
def whole() -> bytes:
    return LOG.read_bytes()


def test_a_whole_log_says_nothing_of_losses() -> None:
    assert not any("the log is" in note for note in read_columns(LOG)[1])


def test_a_cut_log_is_told(tmp_path: Path, whole: bytes) -> None:
    path = tmp_path / "flight.bin"
    path.write_bytes(whole[: len(whole) * 2 // 3])
    assert any(n.startswith("the log is damaged: ") for n in read_columns(path)[1])


def test_a_hole_in_a_log_is_told(tmp_path: Path, whole: bytes) -> None:
    path, middle = tmp_path / "flight.bin", len(whole) // 2
    path.write_bytes(whole[:middle] + bytes(4096) + whole[middle + 4096 :])
    assert any(n.startswith("the log is damaged: ") for n in read_columns(path)[1])


def test_a_folder_is_its_newest_log(tmp_path: Path) -> None:
    shutil.copy(LOG, tmp_path / "FLT00001.BIN")
    shutil.copy(LOG, tmp_path / "FLT00002.BIN")
    columns, notes = read_columns(tmp_path)
    np.testing.assert_array_equal(columns["t_s"], read_columns(LOG)[0]["t_s"])
    assert "FLT00002.BIN is the newest of 2 logs in the folder" in notes


def test_an_empty_folder_is_no_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["maneuvers", str(tmp_path)]) == ExitCode.NOT_A_LOG
    assert "no flight log in this folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("00000012.BIN", b"\xa3\x95\x80" + bytes(600), "DataFlash log but holds no whole record"),
        ("log.ulg", b"ULog\x01\x12\x35" + bytes(600), "ULog but holds no message"),
        ("table.xlsx", b"PK\x03\x04" + bytes(600), "libreoffice --headless"),
        ("flight.bin", b"", "not one intact block"),
        ("flight.bin", b"\0" * 600, "not one intact block"),
        ("flight.csv", b"", "the file is empty"),
    ],
)
def test_what_is_no_log_says_what_it_is(
    name: str, content: bytes, words: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(HostError, match=words):
        read_columns(tmp_path / name)


def test_a_head_without_rows_says_so(tmp_path: Path, whole: bytes) -> None:
    (tmp_path / "flight.bin").write_bytes(whole[:600])
    with pytest.raises(HostError, match="nothing was recorded in it; `host info"):
        read_columns(tmp_path / "flight.bin")


@pytest.mark.parametrize("name", ["table", "table.log", "table.txt"])
def test_a_table_with_any_ending_is_read(name: str, tmp_path: Path) -> None:
    rows = [f"{0.02 * k:.2f},17.0,0.1" for k in range(60)]
    text = "\n".join(["t_s,airspeed_mps,alpha_rad", *rows])
    (tmp_path / name).write_text(text)
    assert set(read_columns(tmp_path / name)[0]) == {"t_s", "airspeed_mps", "alpha_rad"}


def test_a_calibration_is_no_good_for_a_table(tmp_path: Path) -> None:
    rows = [f"{0.02 * k:.2f},17.0" for k in range(60)]
    (tmp_path / "x.csv").write_text("\n".join(["t_s,airspeed_mps", *rows]))
    _, notes = read_columns(tmp_path / "x.csv", calibration=tmp_path / "c.toml")
    of_calibration, of_air = notes
    assert of_calibration == "a calibration is for logs: here only its standard deviations count"
    assert of_air.startswith("density is not known")
