"""Fly the image with a card drawn or damaged: the Mega drives while it mounts and prepares."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from flight.rig import CRUISE_US, IDLE_US, MEGA_US, FlightRig
from flight.servos import LONGEST_GAP_MS, spoiled, worst_gap_ms
from simavr_bench import SdCard, cycles
from simavr_bench.card_journal import CardJournal, Journal
from simavr_bench.heartbeat import Beats

from tests.cards.judge import Judgement, judge, message_of
from tests.cards.sparse import SparseCard
from tests.cards.truth import look_at

SWITCH_S = 0.4  # to Mega, once it was heard at direct
DRIVES_S = 1.0
MESSAGE_S = 10.0
RECORDING_S = 12.0
USB_PORT = 0


@dataclass(frozen=True, slots=True)
class InReader:
    """A simulated card as a reader sees it."""

    card: SdCard

    @property
    def blocks(self) -> int:
        """Size of the card."""
        return self.card.blocks

    def read(self, lba: int, blocks: int = 1) -> bytes:
        """Return some blocks."""
        return self.card.block(lba, blocks)


@dataclass(slots=True)
class CardFlight:
    """What came of it.

    Attributes
    ----------
    judgement : Judgement
        Judgement of the card and of the pilot's link.
    gap_ms : float
        Longest time without a pulse at any servo.
    beats : Beats
        Beats of the heartbeat.
    """

    judgement: Judgement
    gap_ms: float
    beats: Beats


def recording(rows: Journal, since: int) -> bool:
    """Tell whether blocks of a flight were programmed since a cycle."""
    late = rows[rows["begun"] > since]
    return bool(len(late)) and bool(np.all(late[-1]["data"][:4] == np.frombuffer(b"FLT1", "u1")))


def pilot_noticed(rig: FlightRig, since: int, gap_ms: float) -> list[str]:
    """What the pilot would have noticed since the Mega drives: servos, relay, a reset."""
    noticed = []
    if len(rig.started) != 1:
        noticed.append(f"the chip started {len(rig.started)} times")
    if not rig.relay.engaged:
        noticed.append("the receiver drives")
    if gap_ms > LONGEST_GAP_MS:
        noticed.append(f"gap of {gap_ms:.0f} ms")
    bad = [servo for servo in rig.relay.servos if spoiled(rig, since, servo)]
    return noticed + [f"spoilt pulses at {servo}" for servo in bad]


def fly_beside(
    elf: Path, card: SparseCard, folder: Path, *, prepare: Callable[[FlightRig], object] = id
) -> CardFlight:
    """Fly and judge; only in a child of in_fork.

    Parameters
    ----------
    elf : Path
        The flight image.
    card : SparseCard
        Not changed.
    folder : Path
        For the card's file.
    prepare : callable
        Done to the rig before power-on.
    """
    before = look_at(card)
    rig = FlightRig(elf, card.save(folder / "strange.img"), in_place=False)
    rig.receiver.width_us[3] = IDLE_US
    journal = CardJournal(rig.card)
    prepare(rig)
    rig.power_on()
    rig.chip.run_s(SWITCH_S)
    rig.receiver.width_us[4] = MEGA_US
    rig.chip.run_s(DRIVES_S - SWITCH_S)
    since = rig.chip.cycle
    rig.chip.run_until(cycles(MESSAGE_S))
    message = message_of(rig.chip.uart_sent(USB_PORT))
    rig.receiver.width_us[3] = CRUISE_US
    rig.chip.run_until(cycles(RECORDING_S))
    gap_ms = worst_gap_ms(rig, since)
    beats = rig.beats()
    noticed = pilot_noticed(rig, since, gap_ms) + beats.wrong()
    rows = journal.records()
    done = rows[rows["ended"] <= rig.chip.cycle]
    judgement = judge(
        message, before, InReader(rig.card), np.unique(done["block"].astype(np.int64)),
        recording=recording(rows, rig.chip.cycle - cycles(0.5)),
    )  # fmt: skip
    judgement.wrong[:0] = noticed
    rig.chip.close()
    return CardFlight(judgement, gap_ms, beats)
