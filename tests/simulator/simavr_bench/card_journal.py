"""What a card programmed, block by block, and the card that a power cut at any instant leaves."""

from __future__ import annotations

import mmap
import subprocess
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simavr_bench.sd_card import BLOCK, SdCard

RECORD = np.dtype(
    [("begun", "<u8"), ("ended", "<u8"), ("block", "<u4"), ("spoiled", "<u4"), ("data", "u1", 512)]
)
NOT_ENDED = np.iinfo(np.uint64).max

Journal = NDArray[np.void]


class CardJournal:
    """Keeps every block that a card programs from now on.

    Parameters
    ----------
    card : SdCard
        The card; one journal at a time.
    capacity : int
        Records to keep, 536 bytes each, taken from the system only when used.
    """

    def __init__(self, card: SdCard, *, capacity: int = 65_536) -> None:
        self._card = card
        self._capacity = capacity
        self._memory = mmap.mmap(
            -1, capacity * RECORD.itemsize, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
        )
        card.start_journal(self._memory, capacity)

    def records(self) -> Journal:
        """Copy of the records so far, in time order.

        Returns
        -------
        Journal, shape (n,), dtype RECORD
            `begun`, `ended` in cycles (`ended` is NOT_ENDED while the card is busy with it),
            `spoiled` 1 for a block a cut left as garbage, with that garbage as its data.

        Raises
        ------
        OverflowError
            If there were more than the capacity.
        """
        count = self._card.journal_count()
        if count > self._capacity:
            raise OverflowError(f"{count} blocks were programmed, room for {self._capacity}")
        return np.frombuffer(self._memory, RECORD, count).copy()


def copy_sparse(source: Path, target: Path) -> Path:
    """Copy an image without filling its holes; gives the target."""
    subprocess.run(["cp", "--sparse=always", str(source), str(target)], check=True)
    return target


class CutCard:
    """An image file brought to what a power cut leaves, at one cycle after another.

    Parameters
    ----------
    base : Path
        The image as the card was when the journal began.
    work : Path
        Image to make; later cuts change only its changed blocks.
    journal : Journal
        What the card programmed, in time order.
    seed : int
        For the garbage in the block that was being programmed.
    """

    def __init__(self, base: Path, work: Path, journal: Journal, *, seed: int = 1) -> None:
        copy_sparse(base, work)
        self.path = work
        self.journal = journal
        self._rng = np.random.default_rng(seed)
        self._done = 0
        self._spoilt: tuple[int, bytes] | None = None

    def _block(self, number: int) -> bytes:
        with self.path.open("rb") as file:
            file.seek(number * BLOCK)
            return file.read(BLOCK)

    def _put(self, number: int, data: bytes) -> None:
        with self.path.open("r+b") as file:
            file.seek(number * BLOCK)
            file.write(data)

    def cut(self, cycle: int) -> int | None:
        """Leave every block whose busy time ended by a cycle, and garbage in the one under way.

        Parameters
        ----------
        cycle : int
            Cycle of the cut; not before that of the last call.

        Returns
        -------
        int or None
            Number of the block that is garbage.

        Raises
        ------
        ValueError
            If time would run backwards.
        """
        if self._spoilt is not None:
            self._put(*self._spoilt)
            self._spoilt = None
        if self._done and int(self.journal["ended"][self._done - 1]) > cycle:
            raise ValueError(f"the card is beyond cycle {cycle}: cuts go forward only")
        while self._done < len(self.journal) and int(self.journal["ended"][self._done]) <= cycle:
            record = self.journal[self._done]
            self._put(int(record["block"]), record["data"].tobytes())
            self._done += 1
        if self._done == len(self.journal) or int(self.journal["begun"][self._done]) > cycle:
            return None
        number = int(self.journal["block"][self._done])
        self._spoilt = (number, self._block(number))
        self._put(number, self._rng.bytes(BLOCK))
        return number
