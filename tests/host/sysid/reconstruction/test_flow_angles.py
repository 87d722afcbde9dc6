"""Angles without vanes: the smoother against least squares, a flight's angles against the air."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.errors import IdentificationError
from host.sysid.pipeline import ReadingOptions, aircraft_data, prepare, read_flight
from host.sysid.pipeline.flight_preparation import PreparedFlight
from host.sysid.reconstruction import Compatibility
from host.sysid.reconstruction.flow_angles import FlowAngles, flying, reconstruct_flow_angles
from host.twin.flight.fly import fly
from host.twin.outcome.autopilot_logs import write_autopilot_log
from host.twin.sensors.local_flow import air_data
from host.twin.testcard.cards import load
from studies.no_vanes import of_an_autopilot

from tests.host.readers.autopilot_flights import truth, write

AIRCRAFT = "ultrastick25e"


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> PreparedFlight:
    path = write("ulog", tmp_path_factory.mktemp("angles"))
    return prepare(read_flight(path, ReadingOptions(), aircraft_data(AIRCRAFT)))


def _errors_deg(found: FlowAngles, t: np.ndarray) -> dict[str, np.ndarray]:
    true = truth()
    aloft = (t > 8.0) & (t < true["t_s"].iloc[-1] - 1.0)
    return {
        name: np.degrees(
            getattr(found, f"{name}_rad") - np.interp(t, true["t_s"], true[f"{name}_rad"])
        )[aloft]
        for name in ("alpha", "beta")
    }


def test_angles_are_those_of_the_air(prepared: PreparedFlight) -> None:
    """In gusts of 0.2 m/s (0.7 deg): within the figure of the study, and within what is told."""
    found = prepared.flight.angles
    assert found is not None
    agreement = prepared.agreement
    assert agreement is not None
    assert not agreement.vanes
    errors = _errors_deg(found, prepared.flight.corrected["t_s"])
    for name, error in errors.items():
        told = np.degrees(getattr(found, f"{name}_sd_rad"))
        assert float(error.std()) < 0.6, name
        assert float(np.sqrt(np.mean(error**2))) < min(1.5, 3.0 * told), name
    assert any("angles of attack and sideslip are reconstructed" in n for n in prepared.notes)
    assert agreement["wind_north_mps"].data_informed


def test_the_path_of_a_short_flight_is_found(tmp_path: Path) -> None:
    """At 50 Hz and without turns full steps go round about the bank and never end."""
    found = prepare(
        read_flight(write("dataflash", tmp_path), ReadingOptions(), aircraft_data(AIRCRAFT))
    )
    assert found.agreement is not None
    assert found.flight.angles is not None
    errors = _errors_deg(found.flight.angles, found.flight.corrected["t_s"])
    assert float(errors["alpha"].std()) < 0.6


def test_a_tilted_imu_costs_no_path(tmp_path: Path) -> None:
    """Lift and side force lean into ax by 1.5 deg: speed moved 1.51 times as fast as it said."""
    card = load("demo")
    card = replace(card, air=replace(card.air, turbulence_mps=0.0),
                   sensors=replace(card.sensors, servo_tolerance=True))  # fmt: skip
    record = fly(card, seed=11789, errors=of_an_autopilot())
    stem = tmp_path / "flight"
    path = write_autopilot_log("ulog", record, air_data(record), stem, airframe="conventional")
    found = prepare(read_flight(path, ReadingOptions(), aircraft_data(AIRCRAFT)))
    assert [f.check for f in found.findings] == ["flow-angles"]
    assert found.flight.angles is not None


def test_a_wrong_sign_of_lift_is_seen(prepared: PreparedFlight) -> None:
    """With a_z turned round the angles are lost: the force across is what tells gusts."""
    columns = dict(prepared.flight.corrected)
    columns["az_mps2"] = -columns["az_mps2"] - 2.0 * 9.81
    agreement = prepared.agreement
    assert isinstance(agreement, Compatibility)
    found = reconstruct_flow_angles(columns, agreement, aircraft_data(AIRCRAFT).airframe)
    assert float(_errors_deg(found, columns["t_s"])["alpha"].std()) > 1.0


def test_what_is_missing_is_said(prepared: PreparedFlight) -> None:
    columns, agreement = prepared.flight.corrected, prepared.agreement
    assert isinstance(agreement, Compatibility)
    airframe = aircraft_data(AIRCRAFT).airframe
    without = {k: v for k, v in columns.items() if k != "phi_rad"}
    with pytest.raises(IdentificationError, match="not reconstructed: no phi_rad"):
        reconstruct_flow_angles(without, agreement, airframe)
    with pytest.raises(IdentificationError, match="no GPS"):
        reconstruct_flow_angles(columns, replace(agreement, gps=False), airframe)
    with pytest.raises(IdentificationError, match="nothing flew"):
        flying({"airspeed_mps": np.zeros(100)})
    speed = np.r_[np.zeros(50), np.full(80, 17.0), np.zeros(20), np.full(300, 17.0)]
    assert flying({"airspeed_mps": speed}) == slice(150, 450)
