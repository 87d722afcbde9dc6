"""A short selection of `make power-cuts`, and that it notices when an order is wrong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

import host

if TYPE_CHECKING:
    from flight.cut_flight import Flight
    from flight.cut_ground import GroundRun
    from simavr_bench.card_journal import Journal


@dataclass(frozen=True, slots=True)
class Cuttable:
    """A flight and what the next power-on wrote on the ground."""

    flight: Flight
    closing: GroundRun
    preparing: GroundRun


@pytest.fixture(scope="module")
def cuttable(flight_elf: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cuttable]:
    """One flight on a card of 300 MiB, its file closed at the next power-on."""
    from flight.cut_flight import Plan, fly, make_base
    from flight.cut_ground import close_and_prepare
    from simavr_bench import CardKind
    from simavr_bench.card_journal import CutCard

    folder = tmp_path_factory.mktemp("cuts")
    plan = Plan("short", CardKind.SDSC, 300, 8, flight_s=6.0, stall_s=0.5)
    flight = fly(flight_elf, plan, make_base(plan, folder / "base.img", 5), seed=5)
    left = CutCard(flight.base, folder / "open.img", flight.journal)
    left.cut(flight.end)
    closing, preparing = close_and_prepare(flight_elf, left.path, plan.kind, folder)
    yield Cuttable(flight, closing, preparing)


def test_flight_loses_nothing_that_was_written(cuttable: Cuttable, tmp_path: Path) -> None:
    from flight.cut_flight import FlightCuts

    cuts = FlightCuts(cuttable.flight, tmp_path, seed=6)
    flight = cuttable.flight
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


def test_next_power_on_writes_nothing_beside_the_file_in_flight(cuttable: Cuttable) -> None:
    flight = cuttable.flight
    later = flight.journal["begun"] > flight.begin
    assert np.all(flight.in_file()[later])
    assert np.count_nonzero(~flight.in_file()) > 100  # on the ground it did


@pytest.mark.parametrize("phase", ["closing", "preparing"])
def test_metadata_can_be_cut_anywhere(cuttable: Cuttable, tmp_path: Path, phase: str) -> None:
    from flight.cut_ground import judge_ground_cut
    from simavr_bench.card_journal import CutCard

    run = {"closing": cuttable.closing, "preparing": cuttable.preparing}[phase]
    card = CutCard(run.base, tmp_path / "cut.img", run.journal, seed=7)
    every = run.every_block()
    # the last block is the directory's: garbage there is the worst that can happen
    instants = [*run.instants(4, np.random.default_rng(7)), every[0], every[-1]]
    results = [judge_ground_cut(run, card, int(cycle), tmp_path) for cycle in sorted(instants)]
    assert [result.wrong for result in results] == [[]] * len(results)
    assert any(result.spoilt is not None for result in results)


@pytest.mark.parametrize("boot", [0, 1])
def test_true_cut_and_the_next_boot(
    flight_elf: Path, cuttable: Cuttable, tmp_path: Path, boot: int
) -> None:
    from flight.cut_reboot import BOOTS, RebootBench, compare_with

    flight = cuttable.flight
    bench = RebootBench.take_off(flight_elf, flight.plan, flight.base, tmp_path, seed=5)
    assert compare_with(flight, bench) == ""
    assert bench.cut(31_234_567, BOOTS[boot]).wrong == []


def altered(journal: Journal, rows: list[int]) -> Journal:
    """Put the records of a journal into another order, each at the time of its new place."""
    times = journal[["begun", "ended"]].copy()
    changed = journal[rows].copy()
    changed["begun"], changed["ended"] = times["begun"], times["ended"]
    return changed


def test_a_lost_block_is_noticed(cuttable: Cuttable, tmp_path: Path) -> None:
    """A card that says it is done with a block and was not: one row is written elsewhere."""
    from flight.cut_flight import FlightCuts
    from simavr_bench.card_journal import CutCard

    flight = cuttable.flight
    cuts = FlightCuts(flight, tmp_path, seed=6)
    rows = np.flatnonzero(flight.in_file() & (flight.journal["begun"] > flight.begin))
    lying = flight.journal.copy()
    lying["block"][rows[10]] = 200_000
    cuts.card = CutCard(flight.base, tmp_path / "lying.img", lying)
    assert any("is not in the file" in text for text in cuts.judge(flight.end).wrong)


def test_metadata_in_flight_is_noticed(cuttable: Cuttable, tmp_path: Path) -> None:
    """The FAT of the preparation written between blocks of the flight: a cut leaves lost chains."""
    from flight.cut_flight import FlightCuts

    flight = cuttable.flight
    metadata = np.flatnonzero(~flight.in_file())
    data = np.flatnonzero(flight.in_file())
    late, early = list(metadata[-60:]), list(metadata[:-60])
    order = [*early, *data[: len(data) // 2], *late, *data[len(data) // 2 :]]
    wrong = replace(flight, journal=altered(flight.journal, order))
    cuts = FlightCuts(wrong, tmp_path, seed=6)
    cycle = int(wrong.journal["ended"][len(early) + len(data) // 2 + 20]) + 1
    assert any("fsck.vfat found" in text for text in cuts.judge(cycle).wrong)


def test_a_file_closed_too_short_is_noticed(cuttable: Cuttable, tmp_path: Path) -> None:
    """The directory says a size one cluster short of what was recorded."""
    from flight.cut_ground import judge_ground_cut
    from simavr_bench.card_journal import CutCard

    run = cuttable.closing
    short = run.journal.copy()
    data = bytearray(short["data"][run.last].tobytes())
    entry = data.index(b"FLT00001BIN")
    size = int.from_bytes(data[entry + 28 : entry + 32], "little") - 4096
    data[entry + 28 : entry + 32] = size.to_bytes(4, "little")
    short["data"][run.last] = np.frombuffer(bytes(data), np.uint8)
    card = CutCard(run.base, tmp_path / "short.img", short)
    cut = judge_ground_cut(run, card, int(short["ended"][run.last]) + 1, tmp_path)
    assert any("blocks lost" in text for text in cut.wrong)


def test_what_fsck_salvaged_decodes_in_one_piece(cuttable: Cuttable, tmp_path: Path) -> None:
    """The FAT's sector with the flight's end spoilt: the file and the FSCK files put together."""
    from flight.card_files import list_files, read_file, repair, whole_blocks
    from simavr_bench.card_journal import CutCard

    run = cuttable.closing
    card = CutCard(run.base, tmp_path / "cut.img", run.journal, seed=8)
    rows = run.journal[run.first : run.last + 1]
    fat = next(k for k, row in enumerate(rows) if row["data"][:4].tobytes() != b"FLT1")
    card.cut(int(rows["begun"][fat]) + 1)
    repair(card.path)
    names = list_files(card.path)
    assert any(name.startswith("FSCK") for name in names)
    pieces = [read_file(card.path, name, tmp_path / "piece") for name in names]
    whole = tmp_path / "whole.bin"
    whole.write_bytes(b"".join(piece for piece in pieces if whole_blocks(piece)))
    log = host.read_log(whole)
    assert not log.loss.frames
    assert len(log.scan.blocks) == len(run.flights) + 1  # and the one that ends the session
