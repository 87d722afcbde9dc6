"""A card of 16 or 32 GB, 95 % full with clusters of 4 kB: ready in time, saying what it does."""

from __future__ import annotations

import re

import numpy as np
import pytest
from host.twin.recorder.sitl_library import TICKS_PER_S, Port, Recorder, Sitl

from tests.cards.judge import Stage, message_of
from tests.cards.nearly_full import LAST_FLIGHT, nearly_full
from tests.cards.sparse import SparseCard
from tests.cards.truth import look_at
from tests.sitl import still_aircraft
from tests.sitl.card_flight import MESSAGE_S, RECORDING_S, fly
from tests.sitl.card_image import CARD_ID

GIGABYTES = (16.0, 32.0)
QUARTER_HOUR = (
    10_000_000  # bytes of 15 minutes at 100 Hz, as the recorder reckons, and a little more
)
WHOLE_FILE = 64 << 20
SEARCHING = re.compile(r"searching (\d+) ?%")
LONGEST_SEARCH_S = 90.0  # of every cluster of 32 GB


@pytest.mark.parametrize("gigabytes", GIGABYTES)
@pytest.mark.parametrize(
    "share",
    [pytest.param(0.95, id="room at FSInfo's hint"), pytest.param(0.5, id="room in the middle")],
)
def test_room_at_the_hint_is_found_in_time(gigabytes: float, share: float) -> None:
    card = nearly_full(gigabytes, [(share, round(0.049 * gigabytes * 1e9))], hint=share)
    judgement = fly(Sitl(), card)
    assert (judgement.wrong, judgement.stage) == ([], Stage.RECORDING)
    assert judgement.message == f"ready {LAST_FLIGHT + 1}"


@pytest.mark.parametrize("gigabytes", GIGABYTES)
def test_room_behind_the_last_flight_is_found_without_a_hint(gigabytes: float) -> None:
    room = round(0.049 * gigabytes * 1e9)
    card = nearly_full(gigabytes, [(0.7, room)], hint=None, flight_at=0.699)
    judgement = fly(Sitl(), card)
    assert (judgement.wrong, judgement.stage) == ([], Stage.RECORDING)


@pytest.mark.parametrize("gigabytes", GIGABYTES)
def test_room_for_a_quarter_of_an_hour_is_taken_before_all_is_searched(gigabytes: float) -> None:
    """A small run near the hint, a whole one at the other end of the card."""
    card = nearly_full(gigabytes, [(0.501, QUARTER_HOUR), (0.45, WHOLE_FILE)], hint=0.5)
    judgement = fly(Sitl(), card)
    assert (judgement.wrong, judgement.stage) == ([], Stage.RECORDING)


def watch(card: SparseCard, seconds: float) -> list[str]:
    """Stay on the ground with a card; gives what each status line says of it."""
    sitl = Sitl()
    sitl.insert_card(card.image, CARD_ID)
    still_aircraft.give(sitl, seconds + 4.0, throttle_up_s=seconds)
    sitl.power_on()
    said = []
    for second in range(1, round(seconds) + 1):
        sitl.run_until(second * TICKS_PER_S)
        said.append(message_of(sitl.sent(Port.USB)))
    sitl.run_for(RECORDING_S - MESSAGE_S)
    if Recorder(sitl.state().recorder) is Recorder.RECORDING:
        said.append("recording")
    assert still_aircraft.pilot_noticed(sitl) == []
    sitl.power_cut(1)
    sitl.close()
    return said


@pytest.mark.parametrize("gigabytes", GIGABYTES)
def test_search_says_how_far_it_is_and_ends_in_a_file(gigabytes: float) -> None:
    """No hint, the only room before the last flight: nearly every cluster is looked at."""
    card = nearly_full(gigabytes, [(0.94, WHOLE_FILE)], hint=None, flight_at=0.96)
    said = watch(card, LONGEST_SEARCH_S)
    shares = [int(found[1]) for text in said if (found := SEARCHING.fullmatch(text))]
    assert len(shares) > 5
    assert shares == sorted(shares)
    assert said[-2:] == [f"ready {LAST_FLIGHT + 1}", "recording"]


@pytest.mark.parametrize("gigabytes", GIGABYTES)
def test_small_file_is_replaced_on_the_ground_by_a_larger_one(gigabytes: float) -> None:
    card = nearly_full(gigabytes, [(0.501, QUARTER_HOUR), (0.55, WHOLE_FILE)], hint=0.5)
    said = watch(card, 60.0)
    assert said[9].startswith("ready")
    assert said[-1] == "recording"
    _, newest = look_at(card).flights[-1]
    assert newest.size == WHOLE_FILE


def test_the_only_run_of_a_whole_file_becomes_a_whole_file() -> None:
    """The quarter hour is taken out of it first, then grows where it stands."""
    card = nearly_full(16.0, [(0.3, WHOLE_FILE)], hint=0.3)
    free = np.flatnonzero(look_at(card).fat == 0)
    said = watch(card, 20.0)
    assert said[-2:] == [f"ready {LAST_FLIGHT + 1}", "recording"]
    _, newest = look_at(card).flights[-1]
    assert (newest.size, newest.first) == (WHOLE_FILE, free[0])


def test_throttle_up_is_recorded_while_a_larger_room_is_searched() -> None:
    """The search is left within a block: it kept step with the asking, for seconds."""
    card = nearly_full(32.0, [(0.501, QUARTER_HOUR), (0.45, WHOLE_FILE)], hint=0.5)
    said = watch(card, 20.0)
    assert said[-2:] == [f"ready, small {LAST_FLIGHT + 1}", "recording"]


def test_card_without_room_says_so_at_the_end_of_the_search() -> None:
    card = nearly_full(16.0, [(0.3, 4_000_000), (0.6, 4_000_000)], hint=0.2)
    assert watch(card, LONGEST_SEARCH_S)[-1] in ("full", "fragmented")


def test_a_full_card_goes_on_saying_so_while_it_is_searched_again() -> None:
    said = watch(nearly_full(0.5, [], hint=None), 24.0)
    assert set(said[10:24]) == {"full"}
