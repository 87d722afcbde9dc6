"""A short selection of `make power-cuts`, and that it notices when an order is wrong."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

if TYPE_CHECKING:
    from flight.cut_boots import GroundWrites
    from flight.cut_flight import Flight
    from flight.cut_reboot import RebootBench
    from simavr_bench.card_journal import Journal


@pytest.fixture(scope="module")
def flight(flight_elf: Path, tmp_path_factory: pytest.TempPathFactory) -> Flight:
    """One flight on a card of 300 MiB, in a row that holds."""
    from flight.cut_flight import Plan, fly, make_base
    from simavr_bench import CardKind

    folder = tmp_path_factory.mktemp("cuts")
    plan = Plan("short", CardKind.SDSC, 300, 8, flight_s=6.0, stall_s=0.5, holds=True)
    return fly(flight_elf, plan, make_base(plan, folder / "base.img", 5), seed=5)


@pytest.fixture(scope="module")
def ground(flight_elf: Path, tmp_path_factory: pytest.TempPathFactory) -> GroundWrites:
    """What is written on the ground with an open flight, clusters of 64 kB."""
    from flight.cut_boots import write_on_the_ground

    return write_on_the_ground(flight_elf, 64, tmp_path_factory.mktemp("ground"))


def test_flight_loses_nothing_that_was_written(flight: Flight, tmp_path: Path) -> None:
    from flight.cut_flight import FlightCuts

    cuts = FlightCuts(flight, tmp_path, seed=6)
    rows = flight.journal[flight.in_file()]
    inside = rows[(rows["begun"] > flight.begin) & (rows["ended"] < flight.end)]
    # a block of the schema, one in flight, one with a stall
    chosen = [
        inside[3],
        inside[len(inside) // 2],
        inside[np.argmax(inside["ended"] - inside["begun"])],
    ]
    instants = [int(row["begun"] // 2 + row["ended"] // 2) for row in chosen]
    rng = np.random.default_rng(6)
    instants += [int(c) for c in rng.integers(flight.begin, flight.end, 6)]
    results = [cuts.judge(cycle) for cycle in sorted(instants)]
    assert [result.wrong for result in results] == [[]] * len(results)
    assert {result.state for result in results} >= {"busy", "idle"}


def test_next_power_on_writes_nothing_beside_the_file_in_flight(flight: Flight) -> None:
    later = flight.journal["begun"] > flight.begin
    assert np.all(flight.in_file()[later])
    assert np.count_nonzero(~flight.in_file()) > 100  # on the ground it did


def test_heartbeat_of_the_flight(flight: Flight) -> None:
    assert flight.beats.wrong() == []


@pytest.mark.costs(20, "the image boots after a cut at each write")
def test_next_boot_records_whatever_write_was_cut(
    flight_elf: Path, ground: GroundWrites, tmp_path: Path
) -> None:
    """A few of the writes of closing and preparing, cut before and within."""
    from flight.cut_boots import cut_everywhere

    every = len(ground.writes) // 5
    cuts = list(cut_everywhere(flight_elf, ground, tmp_path, every=every, on_chip=2, seed=7))
    assert [cut.wrong for cut in cuts] == [[]] * len(cuts)
    assert sum(cut.beats is not None for cut in cuts) >= 4


@pytest.fixture(scope="module")
def reboots(
    flight_elf: Path, flight: Flight, tmp_path_factory: pytest.TempPathFactory
) -> RebootBench:
    """The same flight again, in the air."""
    from flight.cut_reboot import RebootBench

    folder = tmp_path_factory.mktemp("reboots")
    return RebootBench.take_off(flight_elf, flight.plan, flight.base, folder, seed=5)


@pytest.mark.parametrize("boot", range(4))
def test_true_cut_and_the_next_boot(flight: Flight, reboots: RebootBench, boot: int) -> None:
    from flight.cut_reboot import BOOTS, compare_with

    assert compare_with(flight, reboots) == ""
    assert reboots.cut(31_234_567, BOOTS[boot]).wrong == []


def test_a_row_that_begins_behind_a_cut_is_noticed(flight: Flight, reboots: RebootBench) -> None:
    """The row of before the cut, judged as if none had been flown."""
    from flight.cut_reboot import BOOTS

    none = replace(reboots, plan=replace(flight.plan, holds=False))
    assert none.cut(31_234_567, BOOTS[1]).wrong == ["1 rows began"]


def altered(journal: Journal, rows: list[int]) -> Journal:
    """Put the records of a journal into another order, each at the time of its new place."""
    times = journal[["begun", "ended"]].copy()
    changed = journal[rows].copy()
    changed["begun"], changed["ended"] = times["begun"], times["ended"]
    return changed


def test_a_lost_block_is_noticed(flight: Flight, tmp_path: Path) -> None:
    """A card that says it is done with a block and was not: one row is written elsewhere."""
    from flight.cut_flight import FlightCuts
    from simavr_bench.card_journal import CutCard

    cuts = FlightCuts(flight, tmp_path, seed=6)
    rows = np.flatnonzero(flight.in_file() & (flight.journal["begun"] > flight.begin))
    lying = flight.journal.copy()
    lying["block"][rows[10]] = 200_000
    cuts.card = CutCard(flight.base, tmp_path / "lying.img", lying)
    assert any("is not in the file" in text for text in cuts.judge(flight.end).wrong)


def test_metadata_in_flight_is_noticed(flight: Flight, tmp_path: Path) -> None:
    """The FAT of the preparation written between blocks of the flight: a cut leaves lost chains."""
    from flight.cut_flight import FlightCuts

    metadata = np.flatnonzero(~flight.in_file())
    data = np.flatnonzero(flight.in_file())
    late, early = list(metadata[-60:]), list(metadata[:-60])
    order = [*early, *data[: len(data) // 2], *late, *data[len(data) // 2 :]]
    wrong = replace(flight, journal=altered(flight.journal, order))
    cuts = FlightCuts(wrong, tmp_path, seed=6)
    cycle = int(wrong.journal["ended"][len(early) + len(data) // 2 + 20]) + 1
    assert any("fsck.vfat found" in text for text in cuts.judge(cycle).wrong)


def test_a_file_closed_too_short_is_noticed(ground: GroundWrites, tmp_path: Path) -> None:
    """The directory says a size one block short of what was recorded."""
    from flight.cut_boots import judge_card

    card = ground.card_after(len(ground.writes))
    assert judge_card(card, ground, tmp_path) == []
    root = card.lba(2) * 512
    entry = card.image.find(b"FLT00007BIN", root, root + 65536)
    size = int.from_bytes(card.image[entry + 28 : entry + 32], "little")
    card.image[entry + 28 : entry + 32] = (len(ground.flight) - 512).to_bytes(4, "little")
    wrong = judge_card(card, ground, tmp_path)
    assert size > len(ground.flight)
    assert [text.split()[0] for text in wrong] == ["mtools", "pyfatfs", "cut.bin:"]


def test_a_spoilt_block_of_the_flight_is_noticed(ground: GroundWrites, tmp_path: Path) -> None:
    from flight.cut_boots import judge_garbage

    from tests.cards.truth import look_at

    card = ground.card_after(10)
    assert judge_garbage(card, ground, tmp_path) == []
    (entry,) = (entry for number, entry in look_at(card).flights if number == 7)
    card.image[(card.lba(entry.first) + 100) * 512 + 40] ^= 1
    assert judge_garbage(card, ground, tmp_path) != []


def test_more_than_a_file_is_noticed() -> None:
    """What fsck.vfat may say behind a cut, and what it may not."""
    from flight.cut_boots import beyond_a_file

    allowed = (
        "fsck.fat 4.2 (2021-01-31)\nFATs differ but appear to be intact.\n  Using first FAT.\n"
        "/FLT00007.BIN\n  File size is 204800 bytes, cluster chain length is > 262144 bytes.\n"
        "  Truncating file to 204800 bytes.\nReclaimed 1024 unused clusters (67108864 bytes).\n"
        "Leaving filesystem unchanged.\n/x/cut.img: 2 files, 1028/66550 clusters\n"
    )
    assert beyond_a_file(allowed, 64) == []
    assert beyond_a_file("Reclaimed 1025 unused clusters (67174400 bytes).", 64) != []
    assert beyond_a_file("/FLT00006.BIN and\n/FLT00007.BIN\n  share clusters.", 64) != []
