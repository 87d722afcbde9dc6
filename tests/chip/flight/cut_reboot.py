"""True power cuts on the simulated chip, and what the next boot does with the card."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from flight.card_files import BLOCK, findings, read_file
from flight.cut_flight import FILE_BLOCKS, Flight, Plan, make_rig, place_of_file, take_off
from flight.rig import CRUISE_US, IDLE_US, FlightRig
from host.wire.schema_text import packed_schema
from simavr_bench import cycles, in_fork
from simavr_bench.card_journal import CardJournal, CutCard, Journal

GROUND_S = 5.0  # nobody moves, two witnesses stand still (core/airborne.h)
RESUME_S = 4.0
OFF_S = 0.5


@dataclass(frozen=True, slots=True)
class NextBoot:
    """What the pilot does when the power comes back, and what the logger must do then."""

    name: str
    throttle_us: float
    heard: bool
    moves: bool
    run_s: float
    resumes: bool
    closes: bool


BOOTS = (
    NextBoot("stands, throttle idle: closed", IDLE_US, True, False, 14.0, False, True),
    NextBoot("flies, throttle up: resumed", CRUISE_US, True, True, 6.0, True, False),
    NextBoot("glides, throttle idle: resumed", IDLE_US, True, True, 6.0, True, False),
    NextBoot("stands, no receiver: closed", IDLE_US, False, False, 14.0, False, True),
)


@dataclass(slots=True)
class RebootResult:
    """What came of a cut and the boot behind it.

    Attributes
    ----------
    first_block_s, first_metadata_s : float
        From power-on to the first write into the flight's file and outside it; nan: none.
    wrong : list of str
        What is not as it must be.
    """

    first_block_s: float = float("nan")
    first_metadata_s: float = float("nan")
    wrong: list[str] = field(default_factory=list)


@dataclass(slots=True)
class RebootBench:
    """A rig in flight whose card is journalled; each cut is a child process of it."""

    rig: FlightRig
    journal: CardJournal
    plan: Plan
    folder: Path

    @classmethod
    def take_off(cls, elf: Path, plan: Plan, base: Path, folder: Path, *, seed: int) -> RebootBench:
        """Fly until the Mega drives."""
        rig = make_rig(elf, plan, base, seed)
        journal = CardJournal(rig.card)
        take_off(rig, plan)
        return cls(rig, journal, plan, folder)

    def cut(self, wait_cycles: int, boot: NextBoot) -> RebootResult:
        """Cut the power after some cycles and boot again, in a child process."""
        return in_fork(partial(self._cut, wait_cycles, boot))

    def _cut(self, wait_cycles: int, boot: NextBoot) -> RebootResult:
        chip, result = self.rig.chip, RebootResult()
        chip.run_until(chip.cycle + wait_cycles)
        result.wrong += self.rig.beats().wrong()
        chip.power_off()
        self.rig.receiver.lost = True
        before = self.journal.records()
        first_lba = place_of_file(before)
        result.wrong += self._compare_with_memory(before)
        chip.run_s(OFF_S)
        self.rig.receiver.lost = not boot.heard
        self.rig.receiver.width_us[3] = boot.throttle_us
        (self.rig.fly if boot.moves else self.rig.stand)()
        chip.power_on()
        on = chip.cycle
        chip.run_s(boot.run_s)
        chip.power_off()
        after = self.journal.records()
        self._judge_writes(after[len(before) :], first_lba, on, boot, result)
        self._judge_card(after, before, boot, result)
        return result

    def _compare_with_memory(self, journal: Journal) -> list[str]:
        """Check that the journal tells what really is on the card: it is what other cuts use."""
        latest = {int(r["block"]): r["data"].tobytes() for r in journal}
        odd = [b for b, data in latest.items() if self.rig.card.block(b) != data]
        return [f"block {b} on the card is not what the journal says" for b in odd[:3]]

    def _judge_writes(
        self, later: Journal, first_lba: int, on: int, boot: NextBoot, result: RebootResult
    ) -> None:
        place = later["block"].astype(np.int64) - first_lba
        inside = (place >= 0) & (place < FILE_BLOCKS)
        begun_s = (later["begun"].astype(np.int64) - on) / 16e6
        if np.any(inside):
            result.first_block_s = float(begun_s[inside].min())
        if np.any(~inside):
            result.first_metadata_s = float(begun_s[~inside].min())
        if boot.resumes and not result.first_block_s <= RESUME_S:
            result.wrong.append(f"resumed after {result.first_block_s:.2f} s")
        if boot.closes and not result.first_metadata_s >= GROUND_S:
            result.wrong.append(f"metadata {result.first_metadata_s:.2f} s after power-on")
        if boot.closes and not result.first_block_s >= GROUND_S:
            result.wrong.append(f"wrote into the file after {result.first_block_s:.2f} s")
        if not boot.closes and np.any(~inside):
            result.wrong.append(f"metadata {result.first_metadata_s:.2f} s after power-on")
        if not boot.closes and not boot.resumes and len(later):
            result.wrong.append("wrote to the card without having heard a receiver")

    def _judge_card(
        self, after: Journal, before: Journal, boot: NextBoot, result: RebootResult
    ) -> None:
        import host

        card = CutCard(self.rig.card_image, self.folder / "reboot.img", after)
        card.cut(self.rig.chip.cycle)
        found = findings(card.path)
        if found:
            result.wrong.append(f"fsck.vfat found: {found[:300]}")
        file = self.folder / "reboot.bin"
        data = read_file(card.path, "FLT00001.BIN", file)
        log = host.read_log(file)
        codes = log.frames["event"]["code"]
        if boot.closes and (log.complete != "complete" or 2 not in codes):
            result.wrong.append(f"closed, but the log is {log.complete}")
        starts = int(np.count_nonzero(codes == packed_schema().number("event", "input_start")))
        if starts != int(self.plan.holds):
            result.wrong.append(f"{starts} rows began")
        sessions = len(log.sessions)
        if sessions != (2 if boot.resumes else 1):
            result.wrong.append(f"{sessions} sessions")
        kept = len(before) - int(before["spoiled"].sum())
        first_lba = place_of_file(before)
        for record in before[:kept]:
            at = (int(record["block"]) - first_lba) * BLOCK
            if 0 <= at < len(data) and data[at : at + BLOCK] != record["data"].tobytes():
                result.wrong.append(f"block {at // BLOCK} of before the cut is not in the file")
        if log.loss.any:
            result.wrong.append(
                "the log has losses: " + "; ".join(x.sentence() for x in log.loss.losses[:3])
            )


def compare_with(flight: Flight, bench: RebootBench) -> str:
    """Tell whether the bench's run is the flight's: same seed, same blocks at the same cycles."""
    mine = bench.journal.records()
    same = mine[: len(mine) - 1].tobytes() == flight.journal[: len(mine) - 1].tobytes()
    return "" if same else "the run differs from the one that the other cuts are derived from"


def spread(count: int, seed: int, span_s: float = 5.0) -> list[tuple[int, NextBoot]]:
    """Random waits in cycles, each with the next kind of boot."""
    rng = np.random.default_rng(seed)
    waits = rng.integers(1, cycles(span_s), count)
    return [(int(wait), BOOTS[k % len(BOOTS)]) for k, wait in enumerate(waits)]
