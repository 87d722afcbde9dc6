"""Every format gives back the table, with units where it has a place for them."""

import importlib.util
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.export.csv import DECIMALS, rounded
from host.physical.calibration import load_calibration
from host.physical.columns import COLUMNS, UNITS
from numpy.typing import NDArray
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
    """Each number with the decimals of its sensor: no more, and none that a count needs missing."""
    has_spec = importlib.util.find_spec
    for name in ("arrow", "pandas"):
        if name == "pandas":
            monkeypatch.setattr(
                "importlib.util.find_spec",
                lambda name, *more: None if name == "pyarrow" else has_spec(name, *more),
            )
        assert main(["decode", "flight.bin", "-o", f"{name}.csv"]) == 0
        found = pd.read_csv(f"{name}.csv")
        text = pd.read_csv(f"{name}.csv", dtype=str)
        assert list(found.columns) == NAMES
        for column in NAMES:
            decimals = DECIMALS.get(UNITS[column], 17)
            near = 0.5001 * 10.0**-decimals
            np.testing.assert_allclose(found[column], truth[column], rtol=1e-15, atol=near)
            digits = text[column].dropna().str.partition(".")[2].str.len()
            assert digits.empty or digits.max() <= decimals
    lines = load_calibration().lines
    assert 0.5 * 10.0 ** -DECIMALS["rad"] < 0.01 * lines["channel.alpha_a"].slope[0]
    for line, unit in (("gyro", "rad/s"), ("accel", "m/s2")):
        assert 0.5 * 10.0 ** -DECIMALS[unit] < 0.01 * min(
            map(abs, lines[f"imu_original.{line}"].slope)
        )


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


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_the_largest_numbers_have_no_decimals_and_stay_what_they_are(kind: type) -> None:
    unit, decimals = max(DECIMALS.items(), key=lambda item: item[1])
    most = np.finfo(kind).max
    values: NDArray[Any] = np.array([most, -most, most / 10, np.nan, np.inf, 1.23456789], kind)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        told = rounded({"x": values}, {"x": unit})["x"]
    expected = values.copy()
    expected[-1] = np.round(values[-1], decimals)
    np.testing.assert_array_equal(told, expected)
    assert told.dtype == kind


def test_a_signalling_nan_is_a_missing_value() -> None:
    values = np.array([0x7FA00000], np.uint32).view(np.float32)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isnan(rounded({"x": values}, {"x": "deg"})["x"]).all()
