"""The proof of a card's hold, as the recorder's own radio tells it while a pilot tilts it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from host.errors import UsageError
from host.live.live_stream import LiveStream
from host.preflight.check import Check
from host.preflight.check_list import CheckListInputs, check_list, good_card
from host.preflight.guided_list import Preflight
from host.preflight.hold_check import HoldCheck
from host.preflight.sample import SlowReading
from host.twin.recorder.sitl_library import TICKS_PER_S, Port
from host.wire.flight_card import read_card

from tests.host.preflight.walks import aircraft, healthy, lines
from tests.sitl import flight_cards as cards
from tests.sitl.bench import Bench
from tests.sitl.hold_flight import LAUNCH_S, PITCHED_S, hold_flight

BOTH = 3 << 4


def card(held: int = BOTH, turned: Sequence[int] = ()) -> bytes:
    """Return a card of one row; the gains of `turned` axes have the other sign."""
    hold = dict(cards.HOLD)
    for name in ("angle_gain", "integral_gain", "rate_gain"):
        hold[name] = tuple(-g if k in turned else g for k, g in enumerate(cards.HOLD[name]))
    row = cards.row(axes=4 | held, quiet_ms=200, duration_ms=500, amplitude_us=(0, 0, 80))
    return cards.card([row], hold=hold)


@cache
def sent(inside: bytes, until_s: float = LAUNCH_S) -> bytes:
    """Return the radio of a logger that is enabled, rolled and pitched on the ground."""
    bench = Bench()
    bench.sitl.set_eeprom(cards.eeprom_with(inside))
    hold_flight(LAUNCH_S + 1.0, np.random.default_rng(49_000)).give(bench.sitl)
    bench.sitl.power_on()
    bench.sitl.run_until(round(until_s * TICKS_PER_S))
    return bench.sitl.sent(Port.TELEMETRY)


def heard(data: bytes, file: bytes) -> Check:
    stream = LiveStream(lines())
    wanted = CheckListInputs(aircraft(), lines(), flight_card=read_card(file))
    preflight = Preflight(wanted, stream)
    stream.feed(data, 0.0)
    return next(check for check in preflight.checks if check.key == "hold")


def test_it_asks_for_each_tilt_until_the_logger_told_its_proof() -> None:
    waits = heard(b"", card())
    assert waits.state == "waiting"
    assert "right wing down by 15 deg, full aileron against it for 3 s" in waits.step
    assert waits.missing().startswith("no card was enabled; then right wing down")
    rolled = heard(sent(card(), PITCHED_S), card())
    assert rolled.state == "waiting"
    assert rolled.missing() == "nose up by 15 deg, full elevator against it for 3 s"
    both = heard(sent(card()), card())
    assert (both.state, both.reason) == ("seen", "")
    assert both.title.startswith("hold proven: aileron + at ")
    assert (both.values["aileron_sense"], both.values["elevator_sense"]) == (1.0, -1.0)
    assert PITCHED_S < both.values["elevator_s"] < LAUNCH_S


def test_what_no_row_holds_need_not_be_shown() -> None:
    inside = card(held=1 << 4)
    assert heard(sent(inside, PITCHED_S), inside).state == "seen"


@pytest.mark.parametrize(("axis", "surface"), [(0, "aileron"), (1, "elevator")])
def test_a_proof_against_the_cards_gain_is_red(axis: int, surface: str) -> None:
    inside = card(turned=[axis])
    check = heard(sent(inside), inside)
    assert check.state == "failed"
    assert check.reason.startswith(f"{surface}: shown was that a longer pulse ")


def test_another_card_in_the_logger_is_red() -> None:
    check = heard(sent(card()), card(held=1 << 4))
    assert "the logger has card" in check.reason


def test_a_reset_forgets_and_the_list_asks_anew() -> None:
    check = heard(sent(card()), card())
    check.begin()
    assert check.state == "seen"
    check.take_reading(SlowReading("system", 1.0, {"uptime_s": 1}))
    assert check.state == "waiting"
    assert check.missing().startswith("no card was enabled")


def test_over_usb_it_says_where_to_look() -> None:
    check = HoldCheck(read_card(card()), by_wire=True)
    check.begin()
    assert "the radio's port" in check.reason
    check.take_reading(SlowReading("system", 1.0, {"uptime_s": None}))
    assert check.state == "failed"
    replayed = HoldCheck(read_card(card()), by_wire=False)
    replayed.take_reading(SlowReading("system", 1.0, {"uptime_s": None}))
    assert replayed.state == "waiting"


def test_a_card_that_holds_nothing_has_no_such_item(tmp_path: Path) -> None:
    plain = tmp_path / "plain.card"
    plain.write_bytes(card(held=0))
    for inside in (None, good_card(plain)):
        wanted = CheckListInputs(aircraft(), lines(), flight_card=inside)
        assert "hold" not in {check.key for check in check_list(wanted)}
    plain.write_bytes(b"no card")
    with pytest.raises(UsageError, match=r"plain\.card: "):
        good_card(plain)


def test_a_whole_walk_without_the_proof_is_no_go_for_it_alone() -> None:
    found = healthy(9455, flight_card=read_card(card()))
    assert list(found.reasons) == ["hold"]
    assert found.reasons["hold"].startswith("no card was enabled; then right wing down")
