"""Another card put in while the aircraft flies: nothing is written to it, the pilot goes on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from flight.card_flight import pilot_noticed, recording
from flight.rig import CRUISE_US, IDLE_US, FlightRig
from flight.servos import worst_gap_ms
from simavr_bench import cycles, in_fork
from simavr_bench.card_journal import CardJournal
from simavr_bench.heartbeat import Beats

from tests.cards.damage import NUMBER, card_with, cyclic_at_once
from tests.cards.flights import State
from tests.cards.judge import message_of
from tests.cards.sparse import END, SparseCard

OUT_S, FLIGHT_S, GROUND_S, AGAIN_S = 0.5, 6.0, 30.0, 3.0
OLD_METADATA_BYTES = 4 << 20
USB_PORT = 0


@dataclass(frozen=True, slots=True)
class Swap:
    """One row: the card put in, and what is said of it on the ground."""

    injected: str
    make: Callable[[], SparseCard]
    message: str


@dataclass(slots=True)
class SwapOutcome:
    """What was seen."""

    gap_ms: float
    beats: Beats
    message: str
    wrong: list[str]


def with_cyclic_chain() -> SparseCard:
    """The newest file's first cluster leads to itself."""
    card, flight = card_with(4, State.OPEN)
    cyclic_at_once(card, flight)
    return card


def full() -> SparseCard:
    """Every cluster is another file's."""
    card, _ = card_with(4, State.CLOSED)
    table = card.fat()
    table[table == 0] = END
    card.set_fat(0, table)
    return card


SWAPS = (
    Swap("card swapped for a cyclic one", with_cyclic_chain, f"ready {NUMBER + 1}"),
    Swap("card swapped for a full one", full, "full"),
)


def put_in(rig: FlightRig, card: SparseCard) -> None:
    """Give the simulated card another content, as if it were another card."""
    rig.card.put(0, bytes(OLD_METADATA_BYTES))
    for start, piece in card.content().items():
        rig.card.put(start // 512, piece)
    rig.card.insert()


def swap(rig: FlightRig, journal: CardJournal, row: Swap) -> SwapOutcome:
    """Swap in flight, land, wait, take off again; only in a child of in_fork."""
    card, chip, since = row.make(), rig.chip, rig.chip.cycle
    rig.card.remove()
    chip.run_s(OUT_S)
    written = journal.records()
    put_in(rig, card)
    chip.run_s(FLIGHT_S)
    wrong = []
    beside = journal.records()[len(written) :]
    if len(beside):
        wrong.append(f"{len(beside)} blocks written to the other card in flight")
    rig.receiver.width_us[3] = IDLE_US
    rig.stand()
    chip.run_s(GROUND_S)
    message = message_of(chip.uart_sent(USB_PORT))
    if message != row.message:
        wrong.append(f"says {message!r} on the ground")
    rig.receiver.width_us[3] = CRUISE_US
    rig.fly()
    chip.run_s(AGAIN_S)
    records = recording(journal.records(), chip.cycle - cycles(0.5))
    if records != row.message.startswith("ready"):
        wrong.append("records" if records else "does not record")
    gap_ms, beats = worst_gap_ms(rig, since), rig.beats()
    wrong += pilot_noticed(rig, since, gap_ms) + beats.wrong()
    return SwapOutcome(gap_ms, beats, message, wrong)


def run_swaps(rig: FlightRig, journal: CardJournal, *, only: str = "") -> tuple[int, float]:
    """Print a row for each; gives the number of wrong ones and the lowest gate voltage."""
    bad, gate_volt = 0, float("inf")
    for row in SWAPS:
        if only not in row.injected:
            continue
        seen = in_fork(partial(swap, rig, journal, row))
        bad += bool(seen.wrong)
        gate_volt = float(np.fmin(gate_volt, seen.beats.gate_volt))
        said = "NOT: " + "; ".join(seen.wrong) if seen.wrong else f'"{seen.message}"'
        print(
            f"3   {row.injected:31} {'pilot flies on, no write':33} {seen.gap_ms:4.0f} {'-':>5} "
            f"{'-':>6} {seen.beats.gate_volt:5.2f}  {said}",
            flush=True,
        )
    return bad, gate_volt
