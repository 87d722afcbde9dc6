"""The recorder's own program, at rest before a virtual flight: what is watched turns green."""

from pathlib import Path

from host.live.live_stream import LiveStream
from host.physical.calibration import calibration_of_text
from host.preflight.check_list import Wanted
from host.preflight.guided_list import Preflight
from host.twin.flight.fly import fly
from host.twin.outcome.instrument import calibration
from host.twin.recorder import sitl
from host.twin.recorder.sitl_radio import radio
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard import cards

SECONDS = 8.0  # settings come every five; the card's aircraft is let go after five


def test_the_recorders_own_radio_turns_green_what_needs_no_hand() -> None:
    card = cards.load("demo")
    record = fly(card, seed=9460)
    lines = calibration_of_text(calibration(record.aircraft), Path("virtual"))
    stream = LiveStream(lines)
    preflight = Preflight(Wanted(record.aircraft, lines), stream)
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
