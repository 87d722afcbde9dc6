"""One flight, and the card that a power cut at any of its instants leaves."""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from flight.card_files import BLOCK, findings, frame_sizes, frames_of, put_file, read_file
from flight.flown_row import HOLDS, begin_row
from flight.rig import GROUND_S, FlightRig, numbered
from numpy.typing import NDArray
from simavr_bench import CardKind, cycles
from simavr_bench.card_journal import CardJournal, CutCard, Journal
from simavr_bench.heartbeat import Beats
from simavr_bench.sd_card import make_fat32

FILE_BLOCKS = 131_072  # 64 MiB
PAYLOAD = 480
INSTRUMENT = Path(__file__).resolve().parents[3] / "firmware" / "app" / "instrument.h"
REST_S = 0.020  # between two blocks; less, and the writer has more to write than it could
NEVER = 2**62  # a cycle
OTHER_FILE = "PHOTO.JPG"
IDENT = 1  # id of the identification frame


@dataclass(frozen=True, slots=True)
class Plan:
    """How a flight is flown and cut.

    Attributes
    ----------
    name : str
        For the table.
    kind : CardKind
        How the card is addressed.
    mebibytes, cluster_blocks : int
        Its file system.
    rate_hz : int
        Identification frames per second.
    busy_s, stall_s : float
        Busy after every block; length of the stalls, one every 3 s at a random phase (0: none).
    flight_s : float
        Length of the part that cuts are drawn from.
    holds : bool
        A row of a flight card is flown meanwhile, from 1.5 s before on, that holds two axes.
    """

    name: str
    kind: CardKind
    mebibytes: int
    cluster_blocks: int
    rate_hz: int = 100
    busy_s: float = 0.005
    stall_s: float = 0.0
    flight_s: float = 20.0
    holds: bool = False


@dataclass(frozen=True, slots=True)
class Flight:
    """A flight that went on to its end, with everything the card programmed on the way.

    Attributes
    ----------
    base : Path
        The card before it.
    journal : Journal
        What was programmed since.
    begin, end : int
        Cycles between which the power may be cut.
    first_lba : int
        Where the flight's file begins.
    beats : Beats
        Beats of the heartbeat.
    """

    plan: Plan
    base: Path
    journal: Journal
    begin: int
    end: int
    first_lba: int
    beats: Beats

    def in_file(self) -> NDArray[np.bool_]:
        """Tell which records of the journal are blocks of the flight's file."""
        place = self.journal["block"].astype(np.int64) - self.first_lba
        inside: NDArray[np.bool_] = (place >= 0) & (place < FILE_BLOCKS)
        return inside


@dataclass(frozen=True, slots=True)
class CutResult:
    """What a cut left.

    Attributes
    ----------
    state : str
        What the card was doing: "idle", "busy" (programming) or "behind" (block follows block
        without rest: after a stall, or while the schema goes out first).
    lost_bytes : int
        Bytes of frames made before the cut that are not on the card.
    wrong : list of str
        What is not as it must be.
    """

    state: str
    lost_bytes: int
    wrong: list[str]


@cache
def ring_bytes() -> int:
    """Size of the ring of frames, from the firmware's source.

    Raises
    ------
    AssertionError
        If it is not where it was.
    """
    found = re.search(r"kRingBytes = (\d+);", INSTRUMENT.read_text())
    if found is None:
        raise AssertionError(f"{INSTRUMENT.name} does not give kRingBytes")
    return int(found[1])


def make_base(plan: Plan, target: Path, seed: int) -> Path:
    """Format a card and put a file of the pilot's on it, of more clusters than a FAT sector has."""
    image = make_fat32(target, plan.mebibytes, cluster_blocks=plan.cluster_blocks)
    size = 150 * plan.cluster_blocks * BLOCK
    put_file(image, OTHER_FILE, np.random.default_rng(seed).bytes(size))
    return image


def make_rig(elf: Path, plan: Plan, base: Path, seed: int) -> FlightRig:
    """Wire a rig with a card of the plan's kind."""
    from flight.settings import settings_image

    rig = FlightRig(
        elf, base, imu_hz=float(plan.rate_hz), busy_s=plan.busy_s, in_place=False,
        card_kind=plan.kind, ground_s=HOLDS.ground_s if plan.holds else GROUND_S,
        source=HOLDS.source if plan.holds else numbered,
    )  # fmt: skip
    rig.receiver.jitter_us = 1.0
    rig.receiver.seed = seed
    if plan.rate_hz != 100:
        rig.chip.load(settings_image(rate_hz=plan.rate_hz))
    return rig


def take_off(rig: FlightRig, plan: Plan) -> None:
    """Fly until the Mega drives, and a row is flown where the plan has one."""
    if plan.holds:
        begin_row(rig, HOLDS)
    else:
        rig.take_off()


def place_of_file(journal: Journal) -> int:
    """Find the first block of the newest flight's file.

    Raises
    ------
    AssertionError
        If nothing was recorded, or a block lies where its number does not say.
    """
    magic = (journal["data"][:, :4] == np.frombuffer(b"FLT1", np.uint8)).all(axis=1)
    logged = journal[magic]
    if not len(logged):
        raise AssertionError("the journal holds no block of a flight")
    newest = logged[logged["data"][:, 4:8].view("<u4")[:, 0] == _id_of(logged[-1])]
    numbers = newest["data"][:, 12:16].copy().view("<u4")[:, 0]
    places = newest["block"].astype(np.int64) - numbers
    if np.any(places != places[0]):
        raise AssertionError("blocks of one file do not follow each other")
    return int(places[0])


def _id_of(record: np.void) -> int:
    return int.from_bytes(record["data"][4:8].tobytes(), "little")


def fly(elf: Path, plan: Plan, base: Path, *, seed: int) -> Flight:
    """Fly once, keep every block the card programs."""
    rng = np.random.default_rng(seed)
    rig = make_rig(elf, plan, base, seed)
    journal = CardJournal(rig.card)
    take_off(rig, plan)
    begin = rig.chip.cycle - cycles(1.5)
    end = rig.chip.cycle + cycles(plan.flight_s)
    if plan.stall_s:
        at = np.arange(rig.chip.cycle, end, cycles(3.0))
        phase = rng.integers(0, cycles(3.0 - plan.stall_s), len(at))
        rig.card.stall_at([int(c) for c in at + phase], plan.stall_s)
    rig.chip.run_until(end + cycles(1.5))
    records, beats = journal.records(), rig.beats()
    rig.chip.close()
    return Flight(plan, rig.card_image, records, begin, end, place_of_file(records), beats)


class FlightCuts:
    """Judges one cut after another of a flight.

    Parameters
    ----------
    flight : Flight
        The flight.
    folder : Path
        For the card.
    seed : int
        For the garbage.
    """

    def __init__(self, flight: Flight, folder: Path, *, seed: int) -> None:
        self.flight = flight
        self.card = CutCard(flight.base, folder / "cut.img", flight.journal, seed=seed)
        sizes = frame_sizes()
        rows = [
            (time_us * 16, size, size == sizes[IDENT], min(int(record["ended"]), NEVER))
            for record in flight.journal[flight.in_file()]
            for time_us, size in frames_of(record["data"].tobytes(), sizes)
        ]
        self._frames = np.array(rows, np.int64)

    def lost_bytes(self, cycle: int) -> int:
        """Bytes of frames whose instant had come by a cycle and that were not on the card."""
        made, size, _, ended = self._frames.T
        return int(size[(made <= cycle) & (ended > cycle)].sum())

    def state(self, cycle: int) -> str:
        """Tell what the card was doing."""
        begun = self.flight.journal["begun"]
        ended = self.flight.journal["ended"]
        now = int(np.searchsorted(begun, cycle, side="right"))
        if cycle < int(ended[now - 1]):
            return "busy"
        rest = int(begun[now]) - int(ended[now - 1])
        return "idle" if rest > cycles(REST_S) else "behind"

    def judge(self, cycle: int) -> CutResult:
        """Cut at a cycle; not before the last one."""
        self.card.cut(cycle)
        wrong = []
        found = findings(self.card.path)
        if found:
            wrong.append(f"fsck.vfat found: {found}")
        wrong += self._missing(cycle)
        state = self.state(cycle)
        lost = self.lost_bytes(cycle)
        allowed = 2 * PAYLOAD if state == "idle" else ring_bytes() + PAYLOAD
        if lost > allowed:
            wrong.append(f"{lost} bytes of frames lost with the card {state}, allowed {allowed}")
        return CutResult(state, lost, wrong)

    def _missing(self, cycle: int) -> list[str]:
        """Look for every block that had ended in the file as a PC reads it, and decode that."""
        from host.errors import LogError

        import host

        flight = self.flight
        file = self.card.path.with_name("cut.bin")
        try:
            data = read_file(self.card.path, "FLT00001.BIN", file)
        except subprocess.CalledProcessError:
            return ["mtools does not read FLT00001.BIN"]
        ended = flight.journal[flight.in_file() & (flight.journal["ended"] <= cycle)]
        wrong = []
        for record in ended:
            at = (int(record["block"]) - flight.first_lba) * BLOCK
            if data[at : at + BLOCK] != record["data"].tobytes():
                wrong.append(f"block {at // BLOCK}, ended at {record['ended']}, is not in the file")
        try:
            log = host.read_log(file)
        except LogError as error:
            return [*wrong, str(error)]
        if log.loss.any:
            wrong.append(f"decoding lost {log.loss.frames} frames")
        made = int(np.count_nonzero(self._frames[:, 2] & (self._frames[:, 3] <= cycle)))
        if len(log.frames["ident"]) != made:
            wrong.append(f"{len(log.frames['ident'])} identification frames decode, not {made}")
        return wrong
