"""The recorder's own program: at rest before a virtual flight, and on a whole walk round it."""

from pathlib import Path

import pytest
from host.live.live_stream import LiveStream
from host.physical.calibration import calibration_of_text
from host.preflight.check_list import CheckListInputs
from host.preflight.guided_list import Preflight
from host.twin.flight.fly import fly
from host.twin.ground.ground_faults import GROUND_FAULTS
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import sitl
from host.twin.recorder.sitl_library import Sitl
from host.twin.recorder.sitl_radio import radio
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard import cards

from tests.host.preflight.walks import by_recorder

SECONDS = 8.0  # settings come every five; the card's aircraft is let go after five


def test_the_recorders_own_radio_turns_green_what_needs_no_hand() -> None:
    card = cards.load("demo")
    record = fly(card, seed=9460)
    lines = calibration_of_text(calibration(record.aircraft), Path("virtual"))
    stream = LiveStream(lines)
    preflight = Preflight(CheckListInputs(record.aircraft, lines), stream)
    given = stimuli(record, air_data(record))
    rate_hz = sitl.recorder_rate_hz(card.flight.rate_hz)
    for sent in radio(given, rate_hz=rate_hz, aircraft=record.aircraft.name):
        stream.feed(sent.data, 0.0)
        if sent.t_s > SECONDS:
            break
    states = {check.key: (check.state.value, check.reason) for check in preflight.checks}
    for item in ("logger", "receiver", "imu", "gyros", "airspeed_rest", "baro", "card"):
        assert states[item] == ("seen", ""), states
    assert "while the aircraft stands" in states["gps"][1]  # it flies by then


def test_its_own_radio_turns_every_motion_of_a_healthy_walk_green() -> None:
    walked = by_recorder("", 9880, last="radio")
    assert walked.reasons == {}
    assert walked.preflight.go


# One of each way to its pins: a voltage, a pot, a packet, a pulse.
@pytest.mark.parametrize("fault", ["pitot_leaks", "surface_reversed", "gyro_reversed", "dual_rate"])
def test_a_fault_at_its_pins_is_found_and_named(fault: str) -> None:
    found = by_recorder(fault, 9881)
    assert GROUND_FAULTS[fault].cause in found.reasons[found.item]


def test_its_relay_that_does_not_pull_in_is_named() -> None:
    found = by_recorder("", 9882, last="relay", prepare=Sitl.cut_relay)
    assert "stuck at direct" in found.reasons["relay"]
