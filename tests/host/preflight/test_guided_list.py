"""What a pilot and his crew may do to the list, from the terminal and the page."""

import pytest
from host.link.status_line import parse_status
from host.live.live_sample import LIVE_UNITS
from host.live.live_stream import LiveStream
from host.live.page_server import _is_preflight
from host.preflight.check_list import CheckListInputs, check_list
from host.preflight.guided_list import Preflight
from host.preflight.outside_checks import NO_PROOF
from host.preflight.pilot_settings import PilotSettings
from host.preflight.preflight_screen import list_lines
from host.preflight.sample import Sample
from host.preflight.usb_status import status_readings
from host.twin.ground.ground_faults import GROUND_FAULTS, broken_walk
from host.twin.ground.ground_instrument import ground_frames
from host.twin.ground.ground_walk import ground_walk

from tests.host.preflight.walks import aircraft, broken, healthy, lines

STATUS = (
    "mega2560 1.0.0 image 6d5807df | imu ok roll 0 pitch 1 deg az -1000 mg | alpha 512 511"
    " | beta 512 512 | pitot 512 512 | pots 512 512 512 512 | baro 98000 Pa | gps fix 3 sat 9"
    " | rc us 1500 1500 1500 1100 1100 | drive direct (switch) | relay released | card {card}"
    " | rail 5200 mV | avcc 5010 mV"
)


def test_a_motion_is_asked_for_again_and_turns_green_then() -> None:
    """A slipped vane is put right, and lifted once more."""
    stream = LiveStream(lines())
    preflight = Preflight(CheckListInputs(aircraft(), lines()), stream)
    walk = ground_walk(aircraft(), 9450)
    item, frames = broken_walk(GROUND_FAULTS["vane_slipped"], walk, ground_frames)
    for window, data in frames.stream(walk.windows):
        stream.feed(data, 0.0)
        if window == item:
            break
    check = next(one for one in preflight.checks if one.key == item)
    assert check.state == "failed"
    whole = ground_walk(aircraft(), 9450)
    for window, data in ground_frames(whole).stream(whole.windows):
        if window == item:
            assert preflight.again(item)
            assert preflight.asked is check
            stream.feed(data, 0.0)
    assert check.state == "seen"
    assert not preflight.again("nothing of that name")


def test_what_nobody_does_is_red_with_what_was_seen() -> None:
    stream = LiveStream(lines())
    preflight = Preflight(CheckListInputs(aircraft(), lines()), stream)
    preflight.end()
    assert not preflight.go
    assert {check.state for check in preflight.checks} == {"failed"}
    assert all(check.reason for check in preflight.checks)


@pytest.mark.parametrize(("gps", "without"), [(False, "pitots"), (False, ""), (True, "pitots")])
def test_with_neither_gps_nor_pitot_it_says_that_no_row_starts(gps: bool, without: str) -> None:
    settings = PilotSettings()
    settings.gps = gps
    out = {without: "none fitted"} if without else {}
    checks = check_list(CheckListInputs(aircraft(), lines(), settings, without=out))
    check = next(one for one in checks if one.key == "gps")
    check.take(Sample(0.0, (0.0,) * len(LIVE_UNITS), mega_drives=False))
    assert (check.title == NO_PROOF) == (not gps and bool(without))
    assert (check.state == "seen") == (not gps)


def test_by_wire_nothing_is_said_of_the_radio() -> None:
    found = healthy(9451, by_wire=True)
    assert list(found.reasons) == ["radio"]
    assert "USB" in found.reasons["radio"]


def test_without_a_relay_and_vanes_the_rest_is_go() -> None:
    found = healthy(9452, without={"relay": "listen only", "vanes": "none"})
    assert found.preflight.go
    assert "alpha_a" not in {check.key for check in found.preflight.checks}


@pytest.mark.parametrize(
    ("card", "ready", "said"),
    [
        ("ready 12", True, "ready 12"),
        ("full", False, "no room for 15 minutes"),
        ("missing", False, "put a card in"),
        ("preparing 40 %", False, "a file is being made"),
        ("not FAT32", False, "format it to FAT32"),
    ],
)
def test_usb_says_why_a_card_is_not_ready(card: str, ready: bool, said: str) -> None:
    line = parse_status(STATUS.format(card=card))
    assert line is not None
    found = status_readings(line, 3.0)
    assert ("card" in found["system"]["sensors"]) is ready
    assert said in found["status"]["card"]
    assert found["gps"]["satellites"] == 9
    assert found["system"]["rail_v"] == pytest.approx(5.2)
    assert found["baro"]["static_pressure"] == 98000.0


def test_over_usb_the_status_line_stands_for_the_slower_frames() -> None:
    """Channels in envelopes and a line a second between them, as USB brings them."""
    walk = ground_walk(aircraft(), 9454)
    frames = ground_frames(walk)
    frames.slow = {name: rows[:0] for name, rows in frames.slow.items()}
    frames.kept[:] = True
    line = (STATUS.format(card="full") + "\r\n").encode()
    stream = LiveStream(lines())
    preflight = Preflight(CheckListInputs(aircraft(), lines(), by_wire=True), stream)
    rest = walk.windows[0][2]
    for at, (_, data) in enumerate(frames.timed()):
        stream.feed(data + (line if at % 20 == 19 else b""), 0.0)
        if at > rest:
            break
    checks = {check.key: check for check in preflight.checks if not check.asked}
    states = {key: check.state.value for key, check in checks.items()}
    assert states.pop("card") == "failed"
    assert set(states.values()) == {"seen"}, states
    assert "no room for 15 minutes" in checks["card"].reason
    assert preflight.logger["board"] == "mega2560"


def test_only_three_things_can_be_asked_of_it() -> None:
    assert _is_preflight({"type": "preflight", "do": "next"})
    assert _is_preflight({"type": "preflight", "do": "again", "item": "rudder"})
    for asked in (
        {"type": "preflight", "do": "go"},
        {"type": "preflight", "do": "again", "item": ["rudder"]},
        {"type": "preflight", "do": "next", "go": True},
        ["preflight"],
        "preflight",
    ):
        assert not _is_preflight(asked)


def test_the_list_fits_a_low_terminal() -> None:
    said = broken("half_travel", 9453).preflight.as_json()
    low = list_lines(said, width=60, rows=20)
    assert len(low) < 20
    assert max(map(len, low)) <= 60
    assert low[0].endswith("of 22")
    assert low[-1] == "NO-GO"
