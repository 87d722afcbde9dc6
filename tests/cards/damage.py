"""The faults of a card that were seen: a newest file that is not one run of clusters."""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np

from tests.cards.flights import FlightFile, State, add_flight
from tests.cards.sparse import BLOCK, END, SparseCard

FIRST = 10
NUMBER = 7

Damage = Callable[[SparseCard, FlightFile], None]


def card_with(
    kilobytes: int, state: State, *, freed_clusters: int | None = None
) -> tuple[SparseCard, FlightFile]:
    """A card with an older flight and a newest one."""
    card = SparseCard(kilobytes * 1024 // BLOCK)
    older = add_flight(card, NUMBER - 1, FIRST, State.CLOSED, used=60)
    flight = add_flight(
        card, NUMBER, FIRST + older.clusters, state, used=400, freed_clusters=freed_clusters
    )
    return card, flight


def cut_short(card: SparseCard, flight: FlightFile) -> None:
    """The chain ends within the flight."""
    card.set_fat(flight.first + flight.clusters // 2, [END])


def leads_out_of_the_card(card: SparseCard, flight: FlightFile) -> None:
    """A link of the chain is no cluster."""
    card.set_fat(flight.first + 2, [card.clusters + 700])


def cyclic(card: SparseCard, flight: FlightFile) -> None:
    """The chain comes back to its begin."""
    card.set_fat(flight.first + flight.clusters - 1, [flight.first])


def cyclic_at_once(card: SparseCard, flight: FlightFile) -> None:
    """The first cluster leads to itself."""
    card.set_fat(flight.first, [flight.first])


def garbage_fat(card: SparseCard, flight: FlightFile) -> None:
    """The block of the first FAT that holds the chain's begin is noise."""
    card.write(card.fat_lba + flight.first // 128, np.random.default_rng(3).bytes(BLOCK))


def first_cluster(value: int) -> Damage:
    """An entry whose first cluster is none."""

    def damage(card: SparseCard, flight: FlightFile) -> None:
        at = flight.entry
        card.image[at + 20 : at + 22] = struct.pack("<H", value >> 16)
        card.image[at + 26 : at + 28] = struct.pack("<H", value & 0xFFFF)

    return damage
