"""From another autopilot's log to derivatives: the truth held, nothing claimed that no vane saw."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from host.cli import main
from host.export.dataflash_writer import Records
from host.readers.autopilot_flight import read_autopilot
from host.sysid.flight import read_flight_columns
from host.sysid.pipeline import aircraft_data
from host.sysid.pipeline.surface_travel import with_surface_angles
from host.twin.outcome import ardupilot_log
from host.twin.sensors.autopilot_sensors import DLPF
from host.twin.sensors.sensor_delays import FILTERS

import host
from tests.host.readers.autopilot_flights import FORMATS, write

AIRCRAFT = "ultrastick25e"


def test_without_gps_no_angle_is_trusted(tmp_path: Path) -> None:
    """No path, and so no error of an instrument in the intervals of what leans on the angle."""
    read = read_flight_columns(write("ulog", tmp_path))
    travel = {f"{name}_rad": 0.4363 for name in read.shares}
    table = pd.DataFrame(
        {k: v * travel.get(k, 1.0) for k, v in read.columns.items() if not k.startswith("v_")}
    )
    found = host.identify(table, aircraft=AIRCRAFT, models="short-period")
    for name in ("Z_alpha", "Z_de", "M_alpha"):
        mark = found.table.loc[("short-period", name), "verdict"]
        assert mark in ("do not rely on", "do not use")
    assert "are reconstructed" not in found.to_text()


def test_coefficients_are_refused_without_vanes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write("dataflash", tmp_path)
    code = main(["identify", str(path), "--aircraft", AIRCRAFT, "--model", "coefficients"])
    err = capsys.readouterr().err
    assert code == 2
    assert "no vane measured the angle of attack" in err


def test_longitudinal_without_vanes_is_fitted_and_not_trusted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was refused, though az tells the angle."""
    path = write("dataflash", tmp_path)
    assert main(["identify", str(path), "--model", "longitudinal", "--full"]) == 0
    out = capsys.readouterr().out
    assert "pitch not" in out
    assert "it comes from az_mps2 and rates" in out


def test_surfaces_are_scaled_by_the_aircraft_file_only(tmp_path: Path) -> None:
    read = read_flight_columns(write("dataflash", tmp_path))
    assert read.shares == ("elevator", "aileron", "rudder")
    assert read.recording.commanded == read.shares
    assert read.recording.maker == "autopilot"
    # INS_GYRO_FILTER and INS_ACCEL_FILTER of the log: two Butterworth filters, their mean.
    instrument = aircraft_data(AIRCRAFT).flown(read)
    lag_s = np.mean([np.sqrt(2.0) / (2.0 * np.pi * hertz[0]) for hertz in FILTERS[DLPF]])
    assert instrument.imu_bandwidth_hz == pytest.approx(1.0 / (2.0 * np.pi * lag_s), rel=1e-3)
    assert instrument.errors["accel_bias_mps2"].sigma("z") == pytest.approx(0.4 / np.sqrt(3.0))
    columns, notes = with_surface_angles(read.columns, read.shares, None)
    np.testing.assert_array_equal(columns["elevator_rad"], read.columns["elevator_rad"])
    assert "per full deflection" in notes[0]
    (slow,) = [f for f in read.findings if f.check == "surface-rate"]
    assert slow.channels == ("elevator_rad", "aileron_rad", "rudder_rad")


def test_a_map_may_say_the_travel(tmp_path: Path) -> None:
    """A line of a map gives a surface its angle; the other columns of the log stay."""
    path, mapping = write("ulog", tmp_path), tmp_path / "map.toml"
    mapping.write_text('[columns]\nelevator_rad = { from = "elevator_share", scale = 0.4363 }\n')
    read = read_flight_columns(path, mapping)
    assert read.shares == ("aileron", "rudder")
    plain = read_flight_columns(path).columns["elevator_rad"]
    np.testing.assert_allclose(read.columns["elevator_rad"], 0.4363 * plain, atol=1e-9)
    assert "q_radps" in read.columns


@pytest.mark.parametrize("kind", FORMATS)
def test_every_verb_takes_it(
    kind: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    path = str(write(kind, tmp_path))
    assert main(["info", path]) == 0
    assert "roll: L_p, L_da" in capsys.readouterr().out
    assert main(["decode", path, "-o", "table.csv"]) == 0
    assert "wrote        table.csv" in capsys.readouterr().out
    assert main(["maneuvers", path, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert "here 57.3 deg stand for full travel" in told["notes"][-1]
    found = told["maneuvers"]
    axes = [m["axis"] for m in found]
    assert axes.count("elevator_rad") == 3
    assert axes.count("aileron_rad") == 2
    model = tmp_path / "roll.toml"
    assert main(["identify", path, "--model", "roll", "--save-model", str(model)]) == 0
    capsys.readouterr()
    assert main(["predict", str(model), path]) == 0
    assert "windows" in capsys.readouterr().out


def test_maneuvers_names_what_the_autopilot_flew(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The flight has a chirp, an autotune and a doublet by script, as the log names them."""
    usual, at_us = ardupilot_log._records, np.arange(8e6, 12e6, 1e5)
    more = [
        Records("SIDD", "Qff", {"TimeUS": at_us, "Time": at_us * 1e-6 - 8.0, "Targ": 0.0 * at_us}),
        Records("ATRP", "QBf", {"TimeUS": at_us + 10e6, "Axis": 0 * at_us, "P": 0.1 + 0.0 * at_us}),
        Records("MSG", "QZ", {"TimeUS": np.array([0.0, 30e6]),
                              "Message": [ardupilot_log.FIRMWARE, "Starting doublet"]}),
        Records("MODE", "QMBB", {"TimeUS": np.array([0.0, 17e6, 23e6]), "Mode": [0, 8, 0],
                                 "ModeNum": [0, 8, 0], "Rsn": [1, 1, 1]}),
    ]  # fmt: skip

    def records(*args: Any) -> list[Records]:
        return more + [one for one in usual(*args) if one.name not in ("MODE", "MSG")]

    monkeypatch.setattr(ardupilot_log, "_records", records)
    assert main(["maneuvers", str(write("dataflash", tmp_path))]) == 0
    said = capsys.readouterr().out
    for words in (
        "system-identification chirp from 8.0 to 11.9 s (SIDD)",
        "autotune from 18.0 to 21.9 s (ATRP)", "mode AUTOTUNE from 17.0 to 23.0 s (MODE)",
        "doublet of a script from 30.0 to 35.0 s (MSG 'Starting doublet')",
    ):  # fmt: skip
        assert f"the autopilot's own test: {words}" in said


def test_a_missing_library_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import builtins

    whole = builtins.__import__

    def without(name: str, *args: object, **more: object) -> object:
        if name.split(".")[0] in ("pyulog", "pymavlink"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name.split(".")[0])
        return whole(name, *args, **more)  # type: ignore[arg-type]

    path = write("tlog", tmp_path)
    monkeypatch.setattr(builtins, "__import__", without)
    assert main(["info", str(path)]) == 2
    err = capsys.readouterr().err
    assert len(err.strip().splitlines()) == 1
    assert "needs pymavlink: " in err
    for kind in ("dataflash", "ulog"):  # need none
        assert read_autopilot(write(kind, tmp_path)).log.format == kind
