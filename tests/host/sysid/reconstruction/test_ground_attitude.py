"""The IMU's tilt by the standstill: against least squares, and on a virtual flight."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.aircraft.file import FOLDER, AircraftError
from host.aircraft.mass_properties import AirframeData, airframe_data
from host.arrays import Array
from host.constants import GRAVITY_MPS2, NORMAL_95
from host.sysid.pipeline import ReadingOptions, aircraft_data, prepare, read_flight
from host.sysid.pipeline.flight_preparation import PreparedFlight
from host.sysid.reconstruction import Compatibility, SensorErrorEstimate
from host.sysid.reconstruction.ground_attitude import (
    BIAS,
    TILT,
    standstill,
    update_by_standstill,
)
from host.twin.flight.fly import fly
from host.twin.outcome.autopilot_logs import write_autopilot_log
from host.twin.outcome.ideal import true_table
from host.twin.sensors.local_flow import air_data
from host.twin.testcard import cards

from tests.host.readers.autopilot_flights import CARD
from tests.host.sysid import recorded

AIRCRAFT = "ultrastick25e"
STANDS_RAD, SEEN_RAD, SD_RAD = 0.20, 0.23, 0.005


def _columns(pitch_rad: float = SEEN_RAD, bank_rad: float = 0.0) -> dict[str, Array]:
    """Return 6 s on the ground, then flight, at 50 Hz."""
    t = np.arange(0.0, 20.0, 0.02)
    force = np.array([
        np.sin(pitch_rad), -np.cos(pitch_rad) * np.sin(bank_rad),
        -np.cos(pitch_rad) * np.cos(bank_rad),
    ]) * GRAVITY_MPS2  # fmt: skip
    columns = {"t_s": t, "airspeed_mps": np.where(t < 6.0, 1.0, 17.0)}
    rng = np.random.default_rng(3)
    for k, axis in enumerate("xyz"):
        columns[f"a{axis}_mps2"] = force[k] + 0.005 * rng.standard_normal(len(t))
        columns[f"{'pqr'[k]}_radps"] = 0.01 + 0.002 * rng.standard_normal(len(t))
    return columns


def _found(**more: float) -> Compatibility:
    known = {TILT: (0.0, 0.02, 0.02), BIAS: (0.08, 0.04, 0.25)}  # value, deviation, before
    return Compatibility(
        tuple(
            SensorErrorEstimate(
                name, value, NORMAL_95 * sd, NORMAL_95 * before, sd < before, "not told"
            )
            for name, (value, sd, before) in known.items()
        ),
        {}, (), gps=True,
    )  # fmt: skip


def _airframe(pitch_rad: float = STANDS_RAD, sd_rad: float = SD_RAD) -> AirframeData:
    return replace(airframe_data(AIRCRAFT), ground_pitch_rad=pitch_rad, ground_pitch_sd_rad=sd_rad)


def test_tilt_is_that_of_least_squares() -> None:
    """Tilt and bias with what the flight says of them, and their sum as the standstill shows it."""
    told, notes = update_by_standstill(_found(), _columns(), _airframe())
    rows = np.array(
        [[1.0 / 0.02, 0.0], [0.0, 1.0 / 0.04], [1.0, 1.0 / GRAVITY_MPS2] / np.array(SD_RAD)]
    )
    sides = np.array([0.0, 0.08 / 0.04, (SEEN_RAD - STANDS_RAD) / SD_RAD])
    covariance = np.linalg.inv(rows.T @ rows)
    expected = covariance @ rows.T @ sides
    for k, name in enumerate((TILT, BIAS)):
        assert told[name].value == pytest.approx(expected[k], abs=5e-4)
        sd = told[name].half_width / NORMAL_95
        assert sd == pytest.approx(float(np.sqrt(covariance[k, k])), rel=1e-3)
    assert told[TILT].data_informed
    assert "sees a pitch of 13.2 deg, the aircraft file says 11.5 +- 0.6: its tilt" in notes[0]


def test_without_a_measured_attitude_nothing_changes() -> None:
    found = _found()
    assert update_by_standstill(found, _columns(), airframe_data(AIRCRAFT)) == (found, ())


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (_columns(pitch_rad=0.4), "sees a pitch of 22.9 deg"),  # tail on a stand
        (_columns(bank_rad=0.4), "did not stand on its wheels"),
        (_columns() | {"v_north_mps": np.full(1000, 3.0), "v_east_mps": np.zeros(1000)},
         "no standstill"),  # taxiing
        (_columns() | {"q_radps": 0.2 * np.sin(np.arange(1000))}, "no standstill"),  # in a hand
        ({k: v[320:] for k, v in _columns().items()}, "no standstill"),  # switched on in flight
        ({k: v for k, v in _columns().items() if k != "ax_mps2"}, "no standstill"),
    ],
)  # fmt: skip
def test_what_is_no_standstill_on_wheels_is_not_used(columns: dict[str, Array], words: str) -> None:
    found = _found()
    told, notes = update_by_standstill(found, columns, _airframe())
    assert told is found
    assert words in notes[0]


def test_the_last_standstill_counts() -> None:
    """Carried to the runway and put down: what it showed before is not its attitude."""
    columns = _columns()
    carried = columns["t_s"] < 3.0
    columns["ax_mps2"] = np.where(carried, 0.0, columns["ax_mps2"])
    found = standstill(columns)
    assert found is not None
    assert columns["t_s"][found.start] > 3.0
    assert columns["t_s"][found.stop] < 6.0


def test_alpha_of_a_flight_loses_the_tilt(tmp_path: Path) -> None:
    """The tilt was nearly all that was left of the error: 0.74 deg."""
    record = fly(cards.parse(CARD, "autopilots"), seed=5)
    data = air_data(record)
    path = write_autopilot_log("ulog", record, data, tmp_path / "flight", airframe="conventional")
    true, known = true_table(record, data), aircraft_data(AIRCRAFT)
    tilt = float(record.draws.vector("misalignment_rad")[1])
    stands = float(true["theta_rad"].iloc[50])
    airframe = replace(known.airframe, ground_pitch_rad=stands, ground_pitch_sd_rad=0.004)
    before = _mean_error(prepare(read_flight(path, ReadingOptions(), known)), true)
    prepared = prepare(read_flight(path, ReadingOptions(), replace(known, airframe=airframe)))
    assert before > 0.6 * tilt
    assert abs(_mean_error(prepared, true)) < 0.5 * before
    assert prepared.flight.angles is not None
    assert prepared.flight.angles.alpha_sd_rad < 0.009
    assert any("its tilt is known to" in note for note in prepared.notes)


def _mean_error(prepared: PreparedFlight, true: pd.DataFrame) -> float:
    angles, t = prepared.flight.angles, prepared.flight.corrected["t_s"]
    assert angles is not None
    error = angles.alpha_rad - np.interp(t, true["t_s"], true["alpha_rad"])
    return float(error[(t > 8.0) & (t < true["t_s"].iloc[-1] - 1.0)].mean())


def test_the_file_says_how_well_it_was_measured(tmp_path: Path) -> None:
    text = (FOLDER / "ultrastick25e.toml").read_text()
    path = tmp_path / "mine.toml"

    def written(lines: str) -> str:
        path.write_text(text.replace("arm_tolerance = 0.10\n", f"arm_tolerance = 0.10\n{lines}", 1))
        return str(path)

    both = "ground_pitch_rad = 0.2\nground_pitch_tolerance_rad = 0.009\n"
    found = airframe_data(written(both))
    assert found.ground_pitch_rad == 0.2
    assert found.ground_pitch_sd_rad == pytest.approx(0.009 / np.sqrt(3.0))
    assert airframe_data(AIRCRAFT).ground_pitch_sd_rad == np.inf
    for lines, words in (
        ("ground_pitch_rad = 0.2\n", "without ground_pitch_tolerance_rad"),
        ("ground_pitch_rad = 11.5\nground_pitch_tolerance_rad = 0.5\n", "is 11.5 rad, expected"),
        ("ground_pitch_tolerance_rad = 0.0\n", "expected above 0 to 1.6 rad"),
    ):
        with pytest.raises(AircraftError, match=re.escape(words)):
            airframe_data(written(lines))


def test_our_own_log_tells_it_too() -> None:
    """Its columns begin when all sensors are there, a second before the launch."""
    record, columns, found = (
        *recorded.flown("demo", 3),
        recorded.reconstructed("demo", 3),
    )
    flight = record.record
    stands = float(true_table(flight, air_data(flight))["theta_rad"].iloc[50])
    told, notes = update_by_standstill(found, columns, _airframe(stands, 0.004))
    assert "its tilt is known to" in notes[0]
    true = float(flight.draws.vector("misalignment_rad")[1])
    assert abs(told[TILT].value - true) < told[TILT].half_width < 0.7 * found[TILT].half_width
