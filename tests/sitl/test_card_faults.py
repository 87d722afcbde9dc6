"""Cards that once kept the recorder from recording: each records in time, and logs its event."""

from __future__ import annotations

import pytest
from host.twin.recorder.sitl_library import Sitl

from tests.cards.damage import (
    NUMBER,
    Damage,
    card_with,
    cut_short,
    cyclic,
    first_cluster,
    garbage_fat,
    leads_out_of_the_card,
)
from tests.cards.flights import State, flight_blocks
from tests.cards.judge import Stage
from tests.cards.sparse import BLOCK, DIRECTORY, SparseCard
from tests.cards.truth import look_at
from tests.sitl.card_flight import fly

KILOBYTES = (4, 32)


def records(card: SparseCard, number: int = NUMBER + 1) -> None:
    """Judge a flight with the card: it is recorded, under the next number."""
    judgement = fly(Sitl(), card)
    assert (judgement.wrong, judgement.stage) == ([], Stage.RECORDING)
    assert look_at(card).flights[-1][0] == number


@pytest.mark.parametrize("kilobytes", [4, 32, 64])
@pytest.mark.parametrize("freed_clusters", [0, 1, 130, None])
@pytest.mark.parametrize("state", [State.CUT_CHAIN_FIRST, State.CUT_SIZE_FIRST])
def test_cut_while_the_last_flight_was_closed(
    kilobytes: int, state: State, freed_clusters: int | None
) -> None:
    card, flight = card_with(kilobytes, state, freed_clusters=freed_clusters)
    records(card)
    kept = card.read(card.lba(flight.first), flight.used)
    assert kept == flight_blocks(NUMBER, flight.used, ended=True)


@pytest.mark.parametrize("kilobytes", KILOBYTES)
@pytest.mark.parametrize("state", [State.OPEN, State.BLANK, State.CLOSED])
@pytest.mark.parametrize(
    "damage",
    [
        cut_short, leads_out_of_the_card, cyclic, garbage_fat,
        pytest.param(first_cluster(0), id="first cluster 0"),
        pytest.param(first_cluster(1), id="first cluster 1"),
        pytest.param(first_cluster(0x0FFFFFF0), id="first cluster out of range"),
    ],
)  # fmt: skip
def test_newest_file_that_is_not_one_run_of_clusters(
    kilobytes: int, state: State, damage: Damage
) -> None:
    card, flight = card_with(kilobytes, state)
    damage(card, flight)
    records(card)


@pytest.mark.parametrize("kilobytes", KILOBYTES)
def test_folder_named_as_a_flight(kilobytes: int) -> None:
    card, flight = card_with(kilobytes, State.OPEN)
    card.add_entry(
        f"FLT{NUMBER + 1:05d}.BIN", flight.first + flight.clusters + 5, 0, attributes=DIRECTORY
    )
    records(card, NUMBER + 2)


@pytest.mark.parametrize("kilobytes", KILOBYTES)
def test_root_folder_whose_chain_comes_back_to_itself(kilobytes: int) -> None:
    """With no end mark in it: a reader that follows it never ends."""
    card = SparseCard(kilobytes * 1024 // BLOCK)
    entries = kilobytes * 1024 // 32
    for number in range(1, entries + 1):
        card.image[(at := card.lba(2) * BLOCK + 32 * (number - 1)) : at + 11] = (
            b"KEEP%04dDAT" % number
        )
    card.set_fat(2, [2])
    judgement = fly(Sitl(), card)
    assert judgement.message != ""
    assert [text for text in judgement.wrong if not text.startswith("does not record")] == []
