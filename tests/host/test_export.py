"""Every format gives back the table, with units where it has a place for them."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.physical.columns import COLUMNS, UNITS
from pyarrow import parquet
from scipy.io import loadmat

from tests.host.logs import flight, read, written

DATA = written(*flight(20.0, rate_hz=200), rate_hz=200)
NAMES = [column.name for column in COLUMNS]


@pytest.fixture
def truth(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> pd.DataFrame:
    """Return the table of a log that stands in the working folder."""
    monkeypatch.chdir(tmp_path)
    return read(tmp_path, DATA).table()


def same(found: pd.DataFrame, truth: pd.DataFrame, rtol: float = 0.0) -> None:
    assert list(found.columns) == NAMES
    for name in NAMES:
        np.testing.assert_allclose(found[name], truth[name], rtol=rtol, err_msg=name)


def test_csv(truth: pd.DataFrame, monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["decode", "flight.bin", "-o", "arrow.csv"]) == 0
    same(pd.read_csv("arrow.csv"), truth, rtol=1e-15)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert main(["decode", "flight.bin", "-o", "pandas.csv"]) == 0
    same(pd.read_csv("pandas.csv"), truth, rtol=1e-15)


def test_parquet(truth: pd.DataFrame, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("host.export.parquet._GROUP_ROWS", 1000)
    assert main(["decode", "flight.bin", "--to", "parquet"]) == 0
    table = parquet.read_table("flight.parquet")
    same(table.to_pandas(), truth)
    for name in NAMES:
        meta = table.schema.field(name).metadata
        assert meta[b"unit"].decode() == UNITS[name]
        assert meta[b"description"]
    notes = table.schema.metadata
    assert b"alpha_rad" in notes[b"default_columns"]
    assert b"[channel.alpha_a]" in notes[b"calibration"]
    assert notes[b"complete"] == b"complete"


def test_mat(truth: pd.DataFrame) -> None:
    assert main(["decode", "flight.bin", "--to", "mat"]) == 0
    content = loadmat("flight.mat", squeeze_me=True)
    same(pd.DataFrame({name: content[name] for name in NAMES}), truth)
    units = content["units"]
    assert str(units["qbar_pa"]) == "Pa"
    assert "default_columns" in content["notes"].dtype.names


def test_npz(truth: pd.DataFrame) -> None:
    assert main(["decode", "flight.bin", "--to", "npz"]) == 0
    with np.load("flight.npz") as content:
        same(pd.DataFrame({name: content[name] for name in NAMES}), truth)
        assert dict(content["units"])["alpha_rad"] == "rad"


@pytest.mark.parametrize("kind", ["csv", "parquet", "mat", "npz"])
def test_raw_frames_one_file_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    monkeypatch.chdir(tmp_path)
    log = read(tmp_path, DATA)
    assert main(["decode", "flight.bin", "--to", kind, "--frames"]) == 0
    made = sorted(path.name for path in Path("flight.frames").iterdir())
    assert made == sorted(f"{name}.{kind}" for name, rows in log.frames.items() if len(rows))
    if kind == "csv":
        ident = pd.read_csv("flight.frames/ident.csv")
        for name in ident.columns:
            np.testing.assert_array_equal(ident[name], log.frames["ident"][name])
        config = pd.read_csv("flight.frames/config.csv")
        assert config["aircraft"].tolist() == ["ultrastick25e"]
    if kind == "parquet":
        field = parquet.read_schema("flight.frames/baro.parquet").field("static_pressure")
        assert field.metadata[b"unit"] == b"0.0625 Pa"
