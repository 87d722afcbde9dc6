"""An SD card on the SPI bus, its blocks in memory or in an image file."""

from __future__ import annotations

import ctypes as ct
import mmap
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simavr_bench.chip import Chip, cycles
from simavr_bench.library import SdCounters, SdSettings
from simavr_bench.pins import pin_number

BLOCK = 512
MAP_NORESERVE = 0x4000  # <asm-generic/mman.h>; Python names it from 3.13 on


class CardKind(Enum):
    """Standard (byte addresses, with or without CMD8) or high capacity (block addresses)."""

    SDSC_V1 = "SDSC v1"
    SDSC = "SDSC v2"
    SDHC = "SDHC"


@dataclass(frozen=True, slots=True)
class CardCount:
    """What the card has done; ``lost`` are blocks left as garbage by a power cut."""

    commands: int
    written: int
    read: int
    rejected: int
    lost: int
    bytes_ignored: int
    erased: int


class SdCard:
    """A card in SPI mode.

    Parameters
    ----------
    chip : Chip
        The host; must outlive the card's use.
    cs : str
        Its chip select.
    image : Path or None
        File of whole blocks; else an empty card of ``blocks`` in memory.
    in_place : bool
        The file changes as the card does; else it only is what the card starts with.
    blocks : int
        Size without an image; a multiple of 1024.
    kind : CardKind
        How it is addressed.
    busy_s, read_s, init_s : float
        Busy after a block, delay before read data, time until ACMD41 reports ready.
    seed : int
        For the garbage of a cut.
    """

    CRC_REJECT, WRITE_ERROR = 0x0B, 0x0D

    def __init__(
        self,
        chip: Chip,
        cs: str,
        *,
        image: Path | None = None,
        blocks: int = 65_536,
        in_place: bool = True,
        kind: CardKind = CardKind.SDHC,
        busy_s: float = 0.001,
        read_s: float = 0.0002,
        init_s: float = 0.05,
        seed: int = 1,
    ) -> None:
        self._chip = chip
        # Private pages: after a fork each process has its own card.
        if image is None:
            self._memory = mmap.mmap(
                -1, blocks * BLOCK, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
            )
        else:
            blocks = image.stat().st_size // BLOCK
            # A card of 32 GB is larger than the memory it is promised: only what changes is taken.
            flags = mmap.MAP_SHARED if in_place else mmap.MAP_PRIVATE | MAP_NORESERVE
            with image.open("r+b") as file:
                self._memory = mmap.mmap(file.fileno(), blocks * BLOCK, flags=flags)
        if blocks % 1024 or blocks == 0:
            raise ValueError(f"card of {blocks} blocks, expected a multiple of 1024")
        self.blocks = blocks
        settings = SdSettings(
            blocks=blocks,
            high_capacity=kind is CardKind.SDHC,
            version_1=kind is CardKind.SDSC_V1,
            busy_cycles=cycles(busy_s),
            read_cycles=cycles(read_s),
            init_cycles=cycles(init_s),
            erase_cycles=cycles(0.01),
            response_bytes=1,
        )
        self._buffer = (ct.c_uint8 * (blocks * BLOCK)).from_buffer(self._memory)
        self._lib = chip.library
        self._card = self._lib.bench_sd_card(
            chip.handle, pin_number(cs), ct.addressof(self._buffer), ct.byref(settings), seed
        )
        chip.on_power(self._power)

    def _power(self, on: bool) -> None:
        if not on:
            self._lib.bench_sd_power_cut(self._card)

    def remove(self) -> None:
        """Pull the card out."""
        self._lib.bench_sd_insert(self._card, False)

    def insert(self) -> None:
        """Put it back, not initialised."""
        self._lib.bench_sd_insert(self._card, True)

    def stall(self, time_s: float, *, at_cycle: int | None = None) -> None:
        """Make the first block after a cycle busy for this long (several may be planned)."""
        at = self._chip.cycle if at_cycle is None else at_cycle
        self._lib.bench_sd_stall(self._card, at, cycles(time_s))

    def stall_at(self, at_cycles: Iterable[int], time_s: float) -> None:
        """Plan stalls of one length at rising cycles."""
        for at in at_cycles:
            self.stall(time_s, at_cycle=at)

    def reject(self, count: int = 1, *, token: int = CRC_REJECT, at_cycle: int = 0) -> None:
        """Answer the next blocks after a cycle with an error token."""
        self._lib.bench_sd_reject(self._card, at_cycle, count, token)

    def fail_reads(self, fail: bool = True) -> None:
        """Answer reads of blocks with an error token: its own error correction failed."""
        self._lib.bench_sd_fail_reads(self._card, fail)

    def hold_line(self, low: bool) -> None:
        """Hold the line to the chip low, as a short or a hung card does."""
        self._lib.bench_sd_hold_line(self._card, low)

    def delay(self, *, read_s: float = 0.0002, init_s: float = 0.05) -> None:
        """Change the delay before read data, and the time until ACMD41 reports ready."""
        self._lib.bench_sd_delays(self._card, cycles(read_s), cycles(init_s))

    @property
    def busy(self) -> bool:
        """Whether it is programming now."""
        return bool(self._lib.bench_sd_busy(self._card))

    def start_journal(self, memory: mmap.mmap, capacity: int) -> None:
        """Let the card keep what it programs in memory that must outlive it (CardJournal)."""
        self._journal = (ct.c_uint8 * len(memory)).from_buffer(memory)
        self._lib.bench_sd_journal(self._card, ct.addressof(self._journal), capacity)

    def journal_count(self) -> int:
        """Blocks whose programming began since the journal did."""
        return int(self._lib.bench_sd_journal_count(self._card))

    def count(self) -> CardCount:
        """Counters since the card was made."""
        raw = SdCounters()
        self._lib.bench_sd_counters(self._card, ct.byref(raw))
        return CardCount(
            commands=raw.commands, written=raw.written, read=raw.read, rejected=raw.rejected,
            lost=raw.lost, bytes_ignored=raw.bytes_ignored, erased=raw.erased,
        )  # fmt: skip

    def block(self, number: int, count: int = 1) -> bytes:
        """Content of blocks."""
        return self._memory[number * BLOCK : (number + count) * BLOCK]

    def changed_pages(self) -> NDArray[np.bool_]:
        """Tell which pages of a card with `in_place` false are no longer those of its image.

        All of them, where the system does not tell.
        """
        words = -(-len(self._memory) // mmap.PAGESIZE)
        try:
            with Path("/proc/self/pagemap").open("rb") as pages:
                pages.seek(8 * (ct.addressof(self._buffer) // mmap.PAGESIZE))
                entries = np.frombuffer(pages.read(8 * words), "<u8")
        except OSError:
            return np.ones(words, dtype=np.bool_)
        # proc(5): 63 in memory, 62 swapped out, 61 of a file.
        return np.asarray((entries >> 62 != 0) & (entries >> 61 & 1 == 0))

    def put(self, number: int, content: bytes) -> None:
        """Change blocks as another computer does, the card being out."""
        self._memory[number * BLOCK : number * BLOCK + len(content)] = content

    def save(self, path: Path) -> None:
        """Copy the whole card to a file, as a reader would see it now."""
        path.write_bytes(self._memory[:])


def make_fat32(path: Path, mebibytes: int = 4096, *, cluster_blocks: int = 64) -> Path:
    """Make an empty FAT32 image (sparse) with Debian's mkfs.vfat.

    Parameters
    ----------
    path : Path
        File to make.
    mebibytes : int
        Size. Cards of 4 to 32 GB are delivered with clusters of 64 blocks; FAT32 then needs
        2048 MiB. A small image with small clusters makes the host search a FAT that no card has.
    cluster_blocks : int
        Blocks per cluster.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    subprocess.CalledProcessError
        If mkfs.vfat (package dosfstools) refuses.
    """
    with path.open("wb") as file:
        file.truncate(mebibytes << 20)
    subprocess.run(
        ["/usr/sbin/mkfs.vfat", "-F", "32", "-s", str(cluster_blocks), "--invariant", str(path)],
        check=True, capture_output=True,
    )  # fmt: skip
    return path
