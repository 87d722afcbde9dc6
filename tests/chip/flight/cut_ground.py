"""Power cuts while the logger writes file system metadata: a file prepared, a file closed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from flight.card_files import list_files, read_file, repair, whole_blocks
from flight.rig import IDLE_US, FlightRig
from numpy.typing import NDArray
from simavr_bench import CardKind
from simavr_bench.card_journal import CardJournal, CutCard, Journal, copy_sparse

RUN_S = 20.0  # 10 s of idle throttle, closing, preparing


@dataclass(frozen=True, slots=True)
class GroundRun:
    """One run on the ground, the metadata it wrote and the blocks of flights it must not lose.

    Attributes
    ----------
    name : str
        Of the phase.
    base : Path
        The card before.
    journal : Journal
        What was programmed.
    first, last : int
        First and last record of the journal that belong to the phase to be cut.
    flights : dict
        Blocks of recorded flights by file id and sequence.
    """

    name: str
    base: Path
    journal: Journal
    first: int
    last: int
    flights: dict[tuple[int, int], bytes]

    def instants(self, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
        """Random cycles of the phase, in order."""
        begin = int(self.journal["begun"][self.first])
        end = int(self.journal["ended"][self.last])
        return np.sort(rng.integers(begin, end, count))

    def every_block(self) -> NDArray[np.int64]:
        """One cycle within the programming of every block of the phase."""
        rows = self.journal[self.first : self.last + 1]
        middle: NDArray[np.int64] = (rows["begun"] // 2 + rows["ended"] // 2).astype(np.int64)
        return middle


def logged(image: Path, folder: Path) -> tuple[dict[tuple[int, int], bytes], set[str]]:
    """Read every file of a card.

    Returns
    -------
    tuple(dict, set of str)
        Whole blocks of all files, and the names of files that hold any.
    """
    found: dict[tuple[int, int], bytes] = {}
    names = set()
    for name in list_files(image):
        blocks = whole_blocks(read_file(image, name, folder / "file.bin"))
        found.update(blocks)
        if blocks:
            names.add(name)
    return found, names


def close_and_prepare(
    elf: Path, base: Path, kind: CardKind, folder: Path
) -> tuple[GroundRun, GroundRun]:
    """Power on beside a card with an open flight, throttle idle.

    Returns
    -------
    tuple(GroundRun, GroundRun)
        The run twice: the part that closes the open file, and the part that prepares the next.

    Raises
    ------
    AssertionError
        If it did not write both.
    """
    flights, _ = logged(base, folder)
    rig = FlightRig(elf, base, in_place=False, card_kind=kind)
    rig.receiver.width_us[3] = IDLE_US
    journal = CardJournal(rig.card)
    rig.power_on()
    rig.chip.run_s(RUN_S)
    rows = journal.records()
    rig.chip.close()
    if len(rows) < 4:
        raise AssertionError(f"{len(rows)} blocks written: nothing was closed or prepared")
    # Between the two the card only reads, to find a free run of clusters.
    rest = rows["begun"][1:].astype(np.int64) - rows["ended"][:-1].astype(np.int64)
    split = int(np.argmax(rest))
    return (
        GroundRun("closing", base, rows, 0, split, flights),
        GroundRun("preparing", base, rows, split + 1, len(rows) - 1, flights),
    )


@dataclass(frozen=True, slots=True)
class GroundCut:
    """What a cut left.

    Attributes
    ----------
    spoilt : int or None
        The block that is garbage.
    passes : int
        Runs of `fsck.vfat -a` until nothing was left to repair.
    salvaged : bool
        Whether some blocks came back in a FSCKnnnn.REC only.
    wrong : list of str
        What is not as it must be.
    """

    spoilt: int | None
    passes: int
    salvaged: bool
    wrong: list[str]


def judge_ground_cut(run: GroundRun, card: CutCard, cycle: int, folder: Path) -> GroundCut:
    """Cut at a cycle, let fsck.vfat repair a copy, look for every block of every flight."""
    spoilt = card.cut(cycle)
    image = copy_sparse(card.path, folder / "repaired.img")
    wrong = []
    try:
        passes = repair(image)
        found, names = logged(image, folder)
    except AssertionError as error:
        return GroundCut(spoilt, 0, False, [str(error)])
    lost = [name for name, block in run.flights.items() if found.get(name) != block]
    if lost:
        wrong.append(f"{len(lost)} of {len(run.flights)} blocks lost; block {spoilt} was garbage")
    return GroundCut(spoilt, passes, any(name.startswith("FSCK") for name in names), wrong)
