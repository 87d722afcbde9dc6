"""A card that holds axes in the digital twin: the recorder in one loop with the aircraft."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from host.aircraft.air import Air
from host.aircraft.airframe import Q0, Q3, STATE_COUNT, P, Q
from host.aircraft.attitude import euler
from host.aircraft.linear_aircraft import load
from host.log import read_log
from host.log.flown_inputs import flown_inputs
from host.physical.calibration import calibration_of_text
from host.planning.hold_card import HoldGains
from host.planning.logger_card import logger_card
from host.twin.flight.fly import STEP_S, FlightRecord
from host.twin.flight.ground_tilts import END_S, TILT_RAD, tilted
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import closed_loop, sitl
from host.twin.recorder.logger_flight import logger_flight
from host.twin.recorder.stimuli import Stimuli
from host.twin.testcard.cards import Card, Segment
from host.wire.schema_text import packed_schema

from tests.host.planning.test_hold_card import GAINS

SEED = 30_490
CARD = Card(
    "rudder",
    "A 3-2-1-1 of the rudder",
    "ultrastick25e",
    (
        Segment("3211", axes=("rudder",), amplitudes=(6.0,), width_s=0.4, before_s=1.0),
        Segment("trim", duration_s=1.0),
    ),
    air=Air(turbulence_mps=0.5),
)


def flight_card(hold: HoldGains | None) -> bytes:
    plane = load(CARD.aircraft)
    servos = calibration_of_text(calibration(plane), Path("calibration.toml"))
    return logger_card(CARD, plane, servos, hold=hold)


def recorder_with(data: bytes, given: Stimuli) -> sitl.Recording:
    return sitl.record(given, rate_hz=100, aircraft=CARD.aircraft, flight_card=data, seed=SEED)


def bank_deg(record: FlightRecord) -> float:
    """Return the rms of bank in the row."""
    window = record.schedule.windows[0]
    inside = (record.t_s > window.start_s) & (record.t_s < window.input_end_s)
    phi = euler(record.states[inside, Q0 : Q3 + 1])[0]
    return float(np.degrees(np.sqrt(np.mean(phi**2))))


@pytest.mark.costs(40, "three flights with the recorder in their loop")
def test_a_card_that_holds_is_flown_in_one_loop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, loops = flight_card(GAINS), []

    class Kept(closed_loop.ClosedLoop):
        def __init__(self, *args: object, **more: object) -> None:
            super().__init__(*args, **more)  # type: ignore[arg-type]
            loops.append(self)

    monkeypatch.setattr("host.twin.recorder.logger_flight.ClosedLoop", Kept)
    record, given, recording = logger_flight(
        data, CARD, seed=SEED, recorder=lambda *_: pytest.fail("the recorder was run alone")
    )
    path = tmp_path / "flight.bin"
    path.write_bytes(recording.log)
    log = read_log(path)
    events = log.frames["event"]
    proven = events["arg"][events["code"] == packed_schema().enums["event"]["hold_sense"]]
    # A longer pulse raises the bank angle and lowers the nose.
    assert proven.tolist() == [0 | 1 << 8, 1]
    (row,) = flown_inputs(log)
    assert (row.axes, row.held, row.reason) == (("rudder",), ("aileron", "elevator"), "done")

    # The IMU's packets in the loop are those of the whole flight, to the bit.
    assert loops[-1].packets == given.packets
    # Through the signals of that flight the recorder moves the servos as they were flown: turns
    # of its main loop may begin elsewhere, so a pulse may know a sample of the IMU more or less.
    again = recorder_with(data, given)
    assert len(again.servos) == len(recording.servos)
    apart_ticks = np.abs(again.servos["width"] - recording.servos["width"])
    assert apart_ticks.max() <= 16
    assert np.mean(apart_ticks == 0) > 0.98

    plain = flight_card(None)
    alone, _, _ = logger_flight(
        plain, CARD, seed=SEED, recorder=lambda _, given: recorder_with(plain, given)
    )
    assert bank_deg(record) < 0.5 * bank_deg(alone)


def test_the_pilots_tilts_are_turns_of_the_body_and_the_gyro_sees_them() -> None:
    rest = np.zeros(STATE_COUNT)
    rest[Q0] = 1.0
    count = round(END_S / STEP_S)
    states = tilted(rest, count, STEP_S)
    phi, theta, psi = euler(states[:, Q0 : Q3 + 1])
    assert phi.max() == pytest.approx(TILT_RAD)
    assert theta.max() == pytest.approx(TILT_RAD)
    assert np.abs(psi).max() < 1e-9
    assert abs(phi[-1]) + abs(theta[-1]) < 1e-9
    for angle, rate in ((phi, states[:, P]), (theta, states[:, Q])):
        assert np.cumsum(rate) * STEP_S == pytest.approx(angle, abs=2e-3)
