"""Shipped maps: a flight written in each layout as its documents say reads back as itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.errors import IdentificationError
from host.readers.shipped_maps import shipped_maps
from host.sysid.flight import read_flight_columns
from scipy import io

THOR = Path(__file__).parents[2] / "data/thor75/flight75_240_270.csv"
FOOT, GRAVITY = 0.3048, 9.80665
# What the layouts have in common, and is compared.
NAMES = (
    "airspeed_mps", "alpha_rad", "beta_rad", "p_radps", "q_radps", "r_radps", "ax_mps2", "ay_mps2",
    "az_mps2", "theta_rad", "elevator_rad", "aileron_rad", "rudder_rad",
)  # fmt: skip


@pytest.fixture(scope="module")
def flown() -> tuple[dict[str, np.ndarray], pd.DataFrame]:
    """The real flight by its own map, and as published."""
    return read_flight_columns(THOR, Path("umn-insgnss")).columns, pd.read_csv(THOR)


def _sidpac(f: pd.DataFrame, path: Path) -> None:
    """fdata of SIDPAC: feet, degrees, g; aileron is (right - left) / 2."""
    table = np.zeros((len(f), 90))
    table[:, 0], table[:, 1] = f["time"], f["ias"] / FOOT
    for column, name in zip((2, 3, 4, 5, 6, 7, 8, 9), ("aos", "aoa", *"pqr", "phi", "theta", "psi"),
                            strict=True):  # fmt: skip
        table[:, column] = np.rad2deg(f[name])
    for column, name in zip((10, 11, 12), ("ax", "ay", "az"), strict=True):
        table[:, column] = f[name] / GRAVITY
    table[:, 13] = np.rad2deg(f["de"])
    table[:, 14] = np.rad2deg(f["da_r"] - f["da_l"]) / 2.0
    table[:, 15] = np.rad2deg(f["dr"])
    table[:, 26] = f["Pd"] * 1e3 / 47.88026
    io.savemat(path, {"fdata": table, "t": f["time"].to_numpy()})


def _attas(f: pd.DataFrame, path: Path) -> None:
    """ATTAS of FVSysID: m/s2, deg/s, deg; left aileron 28, right 29."""
    table = np.zeros((len(f), 48))
    for column, name in ((1, "time"), (2, "ax"), (3, "ay"), (4, "az"), (15, "ias")):
        table[:, column - 1] = f[name]
    for column, name in ((7, "p"), (8, "q"), (9, "r"), (10, "phi"), (11, "theta"), (12, "psi"),
                         (13, "aoa"), (14, "aos"), (22, "de"), (28, "da_l"), (29, "da_r"),
                         (30, "dr")):  # fmt: skip
        table[:, column - 1] = np.rad2deg(f[name])
    table[:, 15] = f["alt"] / FOOT
    np.savetxt(path, table, fmt="%.9e")


def _hfb(f: pd.DataFrame, path: Path) -> None:
    """HFB 320 of FVSysID: SI; aileron as in SIDPAC."""
    table = np.zeros((len(f), 20))
    for column, name in ((1, "time"), (2, "de"), (5, "ias"), (6, "aoa"), (7, "theta"), (8, "q"),
                         (10, "ax"), (11, "az"), (12, "ay"), (13, "p"), (14, "r"), (17, "aos"),
                         (20, "dr")):  # fmt: skip
        table[:, column - 1] = f[name]
    table[:, 2], table[:, 18] = 1e3 * f["Pd"], (f["da_r"] - f["da_l"]) / 2.0
    np.savetxt(path, table, fmt="%.9e")


def _inav(f: pd.DataFrame, path: Path) -> None:
    """iNav: body axes forward, left, up; pitch in tenths of a degree, nose down positive."""
    rows = pd.DataFrame({"time (us)": np.round(1e6 * f["time"])})
    for k, (sign, rate, force) in enumerate(((1, "p", "ax"), (-1, "q", "ay"), (-1, "r", "az"))):
        rows[f"gyroADC[{k}] (deg/s)"] = sign * np.rad2deg(f[rate])
        rows[f"accSmooth[{k}] (g)"] = sign * f[force] / GRAVITY
    for k, (sign, name) in enumerate(((1, "phi"), (-1, "theta"), (1, "psi"))):
        rows[f"attitude[{k}]"] = sign * 10.0 * np.rad2deg(f[name])
    rows["AirSpeed"] = 100.0 * f["ias"]
    rows["servo[3]"] = 1500.0 + 1000.0 * f["de"]
    rows.to_csv(path, index=False)


@pytest.mark.parametrize(
    ("name", "write", "ending"),
    [("sidpac", _sidpac, "mat"), ("fvsysid-attas", _attas, "asc"),
     ("fvsysid-hfb320", _hfb, "asc"), ("inav", _inav, "csv")],
)  # fmt: skip
def test_a_layout_reads_back_as_the_flight(name, write, ending, flown, tmp_path) -> None:  # type: ignore[no-untyped-def]
    own, table = flown
    path = tmp_path / f"flight.{ending}"
    write(table, path)
    read = read_flight_columns(path, Path(name))
    present = [n for n in NAMES if name != "inav" or not n.endswith(
        ("alpha_rad", "beta_rad", "elevator_rad", "aileron_rad", "rudder_rad"))]  # fmt: skip
    for column in present:
        np.testing.assert_allclose(read.columns[column], own[column], atol=2e-5, err_msg=column)


def test_a_map_of_mine_begins_with_a_shipped_one(flown, tmp_path) -> None:  # type: ignore[no-untyped-def]
    """Own lines next to the base's; what the base names and the data lack is said, not refused."""
    own, table = flown
    path, mine = tmp_path / "log.csv", tmp_path / "mine.toml"
    _inav(table, path)
    mine.write_text(
        'base = "inav"\n[columns]\n'
        'elevator_rad = { from = "servo[3]", scale = 0.001, offset = -1.5, commanded = true }\n'
    )
    read = read_flight_columns(path, mine)
    np.testing.assert_allclose(read.columns["elevator_rad"], own["elevator_rad"], atol=1e-6)
    assert "q_radps" in read.columns
    assert read.recording.commanded == ("elevator",)
    assert any("the map names altitude_m, which the data do not have" in n for n in read.notes)
    mine.write_text('base = "nobody"\n[columns]\nq_radps = "q"\n')
    with pytest.raises(IdentificationError, match="expected a shipped map"):
        read_flight_columns(path, mine)
    with pytest.raises(IdentificationError, match="no such map; a file, or of fvsysid-attas"):
        read_flight_columns(path, Path("ardupilot"))


def test_a_table_of_a_known_layout_is_told_its_map(flown, tmp_path) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path / "log.csv"
    _inav(flown[1], path)
    with pytest.raises(IdentificationError, match="argument mapping inav has these columns"):
        read_flight_columns(path)
    path.write_text("seconds,roll\n" + "1,2\n" * 50)
    with pytest.raises(IdentificationError, match="no column t_s; name it in a map"):
        read_flight_columns(path)


def test_map_list_says_what_was_tried(capsys: pytest.CaptureFixture[str]) -> None:
    for verb in ("identify", "maneuvers", "predict"):
        assert main([verb, "--map", "list"]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert [line.split()[0] for line in lines[::2]] == list(shipped_maps())
        untried = [line for line in lines[1::2] if "made from documents alone, not tried" in line]
        assert len(untried) == len(shipped_maps()) - 1
