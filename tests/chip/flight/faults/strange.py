"""Cards with a strange content or a slow start: the recorder records, the pilot notices nothing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from flight.card_flight import CardFlight, fly_beside
from flight.rig import FlightRig
from simavr_bench import cycles, in_fork

from tests.cards.damage import (
    NUMBER,
    card_with,
    cut_short,
    cyclic,
    cyclic_at_once,
    first_cluster,
    garbage_fat,
)
from tests.cards.flights import State
from tests.cards.judge import Stage
from tests.cards.nearly_full import nearly_full
from tests.cards.sparse import DIRECTORY, SparseCard

STALL_S = 3.0


@dataclass(frozen=True, slots=True)
class StrangeCard:
    """One row: a card at power-on.

    Attributes
    ----------
    injected : str
        In words.
    make : callable
        Makes the card.
    message : str
        What the status line says of it ten seconds after power-on begins with this.
    prepare : callable
        Done to the rig before power-on.
    records : bool
        Whether it records with throttle up from then on.
    """

    injected: str
    make: Callable[[], SparseCard]
    message: str = f"ready {NUMBER + 1}"
    prepare: Callable[[FlightRig], object] = lambda rig: None
    records: bool = True


def closing_cut(kilobytes: int, state: State, freed_clusters: int | None) -> SparseCard:
    """Power went while the last flight's file was closed."""
    card, _ = card_with(kilobytes, state, freed_clusters=freed_clusters)
    return card


def damaged(kilobytes: int, damage: object) -> SparseCard:
    """An open flight whose chain is not one run of clusters."""
    assert callable(damage)
    card, flight = card_with(kilobytes, State.OPEN)
    damage(card, flight)
    return card


def folder_named_as_a_flight() -> SparseCard:
    """Its number is the largest."""
    card, flight = card_with(4, State.OPEN)
    behind = flight.first + flight.clusters
    card.add_entry(f"FLT{NUMBER + 1:05d}.BIN", behind, 0, attributes=DIRECTORY)
    return card


def good() -> SparseCard:
    """A closed flight."""
    return card_with(4, State.CLOSED)[0]


def slow_start(rig: FlightRig) -> None:
    """It is busy for the first 3 s."""
    rig.card.hold_line(True)
    rig.chip.at(rig.chip.cycle + cycles(STALL_S), partial(rig.card.hold_line, False))


def late_card(rig: FlightRig) -> None:
    """It is put in after 3 s."""
    rig.card.remove()
    rig.chip.at(rig.chip.cycle + cycles(STALL_S), rig.card.insert)


def slow_reads(rig: FlightRig) -> None:
    """No block comes out for the first 3 s."""
    rig.card.delay(read_s=STALL_S)
    rig.chip.at(rig.chip.cycle + cycles(STALL_S), rig.card.delay)


def stall_in_search(rig: FlightRig) -> None:
    """No block comes out from 4 to 7 s, while the FAT is searched."""
    for at_s, read_s in ((4.0, STALL_S), (4.0 + STALL_S, 0.0002)):
        rig.chip.at(rig.chip.cycle + cycles(at_s), partial(rig.card.delay, read_s=read_s))


STRANGE_CARDS = (
    StrangeCard("closing cut, chain first, 4 kB",
                partial(closing_cut, 4, State.CUT_CHAIN_FIRST, 130)),
    StrangeCard("closing cut, chain first, 32 kB",
                partial(closing_cut, 32, State.CUT_CHAIN_FIRST, None)),
    StrangeCard("closing cut, size first, 4 kB", partial(closing_cut, 4, State.CUT_SIZE_FIRST, 0)),
    StrangeCard("closing cut, size first, 64 kB",
                partial(closing_cut, 64, State.CUT_SIZE_FIRST, 1)),
    StrangeCard("newest chain cut short", partial(damaged, 4, cut_short)),
    StrangeCard("newest chain cyclic at its end", partial(damaged, 4, cyclic)),
    StrangeCard("newest chain cyclic at its begin", partial(damaged, 4, cyclic_at_once)),
    StrangeCard("newest chain cyclic, 32 kB", partial(damaged, 32, cyclic_at_once)),
    StrangeCard("garbage in the FAT", partial(damaged, 4, garbage_fat)),
    StrangeCard("first cluster out of range", partial(damaged, 4, first_cluster(0x0FFFFFF0))),
    StrangeCard("folder named as a flight", folder_named_as_a_flight, f"ready {NUMBER + 2}"),
    StrangeCard("16 GB 95 % full, room at hint",
                lambda: nearly_full(16.0, [(0.95, 700 << 20)], hint=0.95), "ready 42"),
    StrangeCard("32 GB 95 % full, no hint",
                lambda: nearly_full(32.0, [(0.9, 700 << 20)], hint=None, flight_at=0.1),
                "searching", records=False),
    StrangeCard("3 s stall while the card starts", good, "ready 8", slow_start),
    StrangeCard("card put in after 3 s", good, "ready 8", late_card),
    StrangeCard("3 s stall while mounting", good, "ready 8", slow_reads),
    StrangeCard("3 s stall in the search",
                lambda: nearly_full(32.0, [(0.9, 700 << 20)], hint=None, flight_at=0.1),
                "searching", stall_in_search, records=False),
)  # fmt: skip


def fly_strange(elf: Path, folder: Path, row: StrangeCard) -> CardFlight:
    """Fly with the card of a row."""
    seen = in_fork(partial(fly_beside, elf, row.make(), folder, prepare=row.prepare))
    wrong = seen.judgement.wrong
    if not seen.judgement.message.startswith(row.message):
        wrong.append(f"says {seen.judgement.message!r}")
    if row.records and seen.judgement.stage is not Stage.RECORDING:
        wrong.append("does not record")
    elif not row.records:
        wrong[:] = [text for text in wrong if not text.startswith("does not record")]
    return seen


def run_strange(elf: Path, folder: Path, *, only: str = "") -> tuple[int, float]:
    """Print a row for each; gives the number of wrong ones and the lowest gate voltage."""
    bad, gate_volt = 0, float("inf")
    for row in STRANGE_CARDS:
        if only not in row.injected:
            continue
        seen = fly_strange(elf, folder, row)
        wrong = seen.judgement.wrong
        bad += bool(wrong)
        gate_volt = min(gate_volt, seen.beats.gate_volt)
        said = "NOT: " + "; ".join(wrong) if wrong else f'"{seen.judgement.message}"'
        expected = "records, Mega drives" if row.records else f"{row.message}, Mega drives"
        print(
            f"5   {row.injected:31} {expected:33} {seen.gap_ms:4.0f} {'-':>5} {'-':>6} "
            f"{seen.beats.gate_volt:5.2f}  {said}",
            flush=True,
        )
    return bad, gate_volt
