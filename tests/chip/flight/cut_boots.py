"""Power cut at every write of metadata, and the next boot as the pilot has it: nothing is repaired.

One run on the ground closes an open flight and prepares the next file; every block it programs is
kept. The card of any instant follows from that: all blocks whose programming had ended, and the
one under way as it was before, or as garbage.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from flight.card_files import BLOCK, findings, read_file
from flight.card_flight import fly_beside
from flight.rig import IDLE_US, FlightRig
from pyfatfs.PyFat import PyFat
from simavr_bench import in_fork
from simavr_bench.card_journal import CardJournal, Journal
from simavr_bench.heartbeat import Beats

from tests.cards.damage import NUMBER, card_with
from tests.cards.flights import State
from tests.cards.judge import Stage
from tests.cards.sparse import SparseCard
from tests.cards.truth import look_at

CLUSTER_KILOBYTES = (4, 32, 64)
GROUND_S = 40.0  # idle until it is the ground, closing, preparing
MENDED_S = 60.0
FILE_BYTES = 64 << 20
# What fsck.vfat may find behind a cut; a copy of the FAT not yet written is no loss.
ALLOWED = (
    r"fsck\.fat .*",
    r"Reclaimed \d+ unused clusters? \(\d+ bytes\)\.",
    r"File size is \d+ bytes, cluster chain length is > \d+ bytes\.",
    r"Truncating file to \d+ bytes\.",
    r"/FLT\d{5}\.BIN",
    r"FATs differ but appear to be intact\.",
    r"Using first FAT\.",
    r"Free cluster summary (uninitialized|wrong) .*",
    r"Auto-(correcting|setting)\.",
    r"Leaving filesystem unchanged\.",
    r"(There are d|D)ifferences between boot sector and its backup\..*",
    r".*: \d+ files, \d+/\d+ clusters",
    r"\s*",
)


@dataclass(frozen=True, slots=True)
class GroundWrites:
    """A run on the ground with an open flight.

    Attributes
    ----------
    kilobytes : int
        Size of a cluster.
    card : SparseCard
        Before it.
    writes : Journal
        What was programmed.
    flight : bytes
        Every block of the open flight.
    """

    kilobytes: int
    card: SparseCard
    writes: Journal
    flight: bytes

    def card_after(self, count: int) -> SparseCard:
        """Make the card on which the first writes were done."""
        copy = copy_of(self.card)
        for row in self.writes[:count]:
            copy.write(int(row["block"]), row["data"].tobytes())
        return copy

    def card_with_garbage(self, number: int, rng: np.random.Generator) -> SparseCard:
        """Make the card whose power went while a block was programmed."""
        copy = self.card_after(number)
        copy.write(int(self.writes[number]["block"]), rng.bytes(BLOCK))
        return copy


@dataclass(slots=True)
class CutBoot:
    """What came of a cut and of the boot behind it.

    Attributes
    ----------
    kilobytes, write : int
        Size of a cluster; number of the write before which or in which the power went.
    garbage : bool
        Whether that block is garbage.
    beats : Beats or None
        Beats of the boot on the chip, if there was one.
    wrong : list of str
        What is not as it must be.
    """

    kilobytes: int
    write: int
    garbage: bool
    beats: Beats | None = None
    wrong: list[str] = field(default_factory=list)


def copy_of(card: SparseCard) -> SparseCard:
    """Make another card with the same content."""
    copy = SparseCard(card.cluster_blocks, clusters=card.clusters)
    for start, piece in card.content().items():
        copy.image[start : start + len(piece)] = piece
    return copy


def write_on_the_ground(elf: Path, kilobytes: int, folder: Path) -> GroundWrites:
    """Power on with an open flight, throttle idle: it is closed, the next file prepared.

    Raises
    ------
    AssertionError
        If it is not.
    """
    card, flight = card_with(kilobytes, State.OPEN)
    rows = in_fork(partial(_stay, elf, card.save(folder / "ground.img")))
    done = GroundWrites(kilobytes, card, rows, card.read(card.lba(flight.first), flight.used))
    after = look_at(done.card_after(len(rows)))
    sizes = {number: entry.size for number, entry in after.flights}
    if sizes.get(NUMBER, FILE_BYTES) == FILE_BYTES or NUMBER + 1 not in sizes:
        raise AssertionError(f"{kilobytes} kB: not closed and prepared: {sizes}")
    return done


def _stay(elf: Path, image: Path) -> Journal:
    rig = FlightRig(elf, image, in_place=False, ground_s=GROUND_S + 1.0)
    rig.receiver.width_us[3] = IDLE_US
    journal = CardJournal(rig.card)
    rig.power_on()
    rig.chip.run_s(GROUND_S)
    rows = journal.records()
    rig.chip.close()
    return rows[rows["ended"] < np.iinfo(np.uint64).max]


def judge_card(card: SparseCard, run: GroundWrites, folder: Path) -> list[str]:
    """Judge a card as a PC does before anything is repaired: fsck's words, the flight's blocks."""
    image = card.save(folder / "cut.img")
    wrong = [f"fsck.vfat says {text!r}" for text in beyond_a_file(findings(image), run.kilobytes)]
    name = f"FLT{NUMBER:05d}.BIN"
    for reader, content in (
        ("mtools", read_file(image, name, folder / "cut.bin")),
        ("pyfatfs", read_with_pyfatfs(image, name)),
    ):
        if content[: len(run.flight)] != run.flight:
            wrong.append(f"{reader} does not read every block of the flight")
    return wrong + decodes_in_full(folder / "cut.bin", run)


def judge_garbage(card: SparseCard, run: GroundWrites, folder: Path) -> list[str]:
    """With a block of metadata spoilt: the card's image decodes, with every block of the flight."""
    image = card.save(folder / "garbage.img")
    file_id = int.from_bytes(run.flight[4:8], "little")
    return decodes_in_full(image, run, file_id=file_id)


def decodes_in_full(path: Path, run: GroundWrites, *, file_id: int | None = None) -> list[str]:
    """Let the host decode a file or a card's image; every block of the flight must be in it."""
    import host

    log = host.read_log(path, file_id=file_id)
    wanted = len(run.flight) // BLOCK
    found = log.scan.blocks
    own = found.take(found.file_id == int.from_bytes(run.flight[4:8], "little"))
    sequences = np.unique(own.sequence)
    if not np.isin(np.arange(wanted), sequences).all() or log.loss.frames:
        return [f"{path.name}: {len(sequences)} of {wanted} blocks of the flight decode"]
    return []


def beyond_a_file(found: str, kilobytes: int) -> list[str]:
    """Return what fsck.vfat says beyond lost clusters and long chains of one file's worth."""
    lines = [line.strip() for line in found.splitlines()]
    strange = [line for line in lines if not any(re.fullmatch(text, line) for text in ALLOWED)]
    lost = sum(int(n) for n in re.findall(r"Reclaimed (\d+) unused", found))
    if lost * kilobytes * 1024 > FILE_BYTES:
        strange.append(f"{lost} clusters lost")
    return strange


def read_with_pyfatfs(image: Path, name: str) -> bytes:
    """Copy a file out through a reader that repairs nothing: its chain, up to its size."""
    volume = PyFat()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # clusters of 64 kB
        volume.open(str(image), read_only=True)
    try:
        _, files, _ = volume.root_dir.get_entries()
        entry = next(entry for entry in files if entry.get_short_name() == name)
        out = io.BytesIO()
        for cluster in volume.get_cluster_chain(entry.get_cluster()):
            out.write(volume.read_cluster_contents(cluster))
            if out.tell() >= entry.filesize:
                break
        return out.getvalue()[: entry.filesize]
    finally:
        volume.close()


def boot_on_the_chip(elf: Path, card: SparseCard, folder: Path) -> tuple[Beats, list[str]]:
    """Boot as the pilot does, throttle up after ten seconds: it records, he notices nothing."""
    flown = in_fork(partial(fly_beside, elf, card, folder))
    judgement = flown.judgement
    late = [] if judgement.stage is Stage.RECORDING else [f"next boot says {judgement.message!r}"]
    return flown.beats, judgement.wrong + late


def boot_in_sitl(card: SparseCard) -> list[str]:
    """The same with the recorder on this computer, which is some fifty times faster; changes it."""
    from host.twin.recorder.sitl_library import Sitl

    from tests.sitl.card_flight import fly

    judgement = fly(Sitl(), card)
    late = [] if judgement.stage is Stage.RECORDING else [f"next boot says {judgement.message!r}"]
    return judgement.wrong + late


def mend_in_sitl(card: SparseCard, folder: Path) -> list[str]:
    """Boot and stay on the ground: size and chain of every flight agree behind it; changes it."""
    from host.twin.recorder.sitl_library import Sitl

    from tests.sitl.card_flight import stay

    stay(Sitl(), card, MENDED_S)
    said = findings(card.save(folder / "mended.img"))
    return [f"not mended: {line.strip()}" for line in said.splitlines() if "File size" in line]


def cut_everywhere(
    elf: Path, run: GroundWrites, folder: Path, *, every: int, on_chip: int, seed: int
) -> Iterator[CutBoot]:
    """Cut between and within the writes of a run, judge the card and the boot behind it.

    Parameters
    ----------
    elf : Path
        The flight image.
    run : GroundWrites
        What was written.
    folder : Path
        For images.
    every, on_chip : int
        Writes from one that is cut to the next; of these, from one flown on the chip to the next.
    seed : int
        For the garbage.
    """
    rng = np.random.default_rng(seed)
    for turn, write in enumerate(range(0, len(run.writes), every)):
        for garbage in (False, True):
            card = run.card_with_garbage(write, rng) if garbage else run.card_after(write)
            wrong = (judge_garbage if garbage else judge_card)(card, run, folder)
            on_the_chip = turn % on_chip == 0
            beats = None
            if on_the_chip:
                beats, seen = boot_on_the_chip(elf, card, folder)
                wrong += [f"on the chip: {text}" for text in seen]
            again = copy_of(card)
            wrong += boot_in_sitl(card)
            if not garbage:
                wrong += mend_in_sitl(again, folder)
            card.close()
            again.close()
            yield CutBoot(run.kilobytes, write, garbage, beats, wrong)
