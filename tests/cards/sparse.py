"""A FAT32 card of any size that keeps only what was written, in memory or as a sparse file.

Written from Microsoft's FAT specification; knows nothing of the firmware.
"""

from __future__ import annotations

import mmap
import os
import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

BLOCK = 512
RESERVED = 32
FATS = 2
INFO_LBA, INFO_HINT = 1, 492
ENTRIES_PER_FAT_BLOCK = 128
LEAST_CLUSTERS = 65_526  # fewer make it FAT16 (FAT specification, section 3.5)
ROOT_CLUSTER = 2
PARTITION_LBA = 2048
CARD_STEP_BLOCKS = 1024  # a card with CSD version 2 counts its size in 512 KiB
END = 0x0FFFFFFF
ENTRY_BYTES = 32
ARCHIVE, DIRECTORY = 0x20, 0x10


class SparseCard:
    """An empty FAT32 card; what is not written costs nothing.

    Parameters
    ----------
    cluster_blocks : int
        Blocks in a cluster.
    clusters : int
        Data clusters; as few as FAT32 allows unless given.
    partitioned : bool
        Behind a partition table, as cards are sold.

    Attributes
    ----------
    image : mmap
        The whole card; what changes it changes the card.
    """

    def __init__(
        self,
        cluster_blocks: int,
        *,
        clusters: int = LEAST_CLUSTERS + 1024,
        partitioned: bool = False,
    ) -> None:
        self.cluster_blocks = cluster_blocks
        self.clusters = clusters
        self.first = PARTITION_LBA if partitioned else 0
        self.fat_blocks = -(-(clusters + 2) // ENTRIES_PER_FAT_BLOCK)
        self.volume_blocks = RESERVED + FATS * self.fat_blocks + clusters * cluster_blocks
        self._file = os.memfd_create("card")
        size = self.first + self.volume_blocks
        os.ftruncate(self._file, -(-size // CARD_STEP_BLOCKS) * CARD_STEP_BLOCKS * BLOCK)
        self.image = mmap.mmap(self._file, 0)
        self._format(partitioned)

    @property
    def blocks(self) -> int:
        """Size of the card."""
        return len(self.image) // BLOCK

    @property
    def fat_lba(self) -> int:
        """First block of the first FAT."""
        return self.first + RESERVED

    @property
    def data_lba(self) -> int:
        """First block of cluster 2."""
        return self.fat_lba + FATS * self.fat_blocks

    def lba(self, cluster: int) -> int:
        """First block of a cluster."""
        return self.data_lba + (cluster - 2) * self.cluster_blocks

    def close(self) -> None:
        """Forget everything."""
        self.image.close()
        os.close(self._file)

    def read(self, lba: int, blocks: int = 1) -> bytes:
        """Return some blocks."""
        return self.image[lba * BLOCK : (lba + blocks) * BLOCK]

    def write(self, lba: int, content: bytes) -> None:
        """Write from the start of a block on; a last block may be written in part."""
        self.image[lba * BLOCK : lba * BLOCK + len(content)] = content

    def written(self) -> list[tuple[int, int]]:
        """Return the byte ranges that were ever written, in order; the rest reads as zero."""
        found, at, size = [], 0, len(self.image)
        while at < size:
            try:
                start = os.lseek(self._file, at, os.SEEK_DATA)
            except OSError:
                break
            at = os.lseek(self._file, start, os.SEEK_HOLE)
            found.append((start, at))
        return found

    def content(self) -> dict[int, bytes]:
        """Return everything written, by its first byte."""
        return {start: self.image[start:end] for start, end in self.written()}

    def changed_since(self, before: dict[int, bytes]) -> NDArray[np.int64]:
        """Return the blocks whose content is not that of an earlier `content()`."""
        changed: list[NDArray[np.int64]] = []
        for start, end in self.written():
            was = bytearray(end - start)
            for begin, piece in before.items():
                low, high = max(start, begin), min(end, begin + len(piece))
                if low < high:
                    was[low - start : high - start] = piece[low - begin : high - begin]
            now = np.frombuffer(self.image[start:end], np.uint8).reshape(-1, BLOCK)
            differs = (now != np.frombuffer(was, np.uint8).reshape(-1, BLOCK)).any(axis=1)
            changed.append(np.flatnonzero(differs) + start // BLOCK)
        return np.concatenate(changed) if changed else np.zeros(0, np.int64)

    def save(self, path: Path) -> Path:
        """Write a sparse file."""
        with path.open("wb") as file:
            file.truncate(len(self.image))
            for start, piece in self.content().items():
                file.seek(start)
                file.write(piece)
        return path

    def fat(self, first: int = 0, count: int | None = None, *, copy: int = 0) -> NDArray[np.uint32]:
        """Return entries of a FAT from `first` on, as a copy."""
        count = self.clusters + 2 - first if count is None else count
        start = (self.fat_lba + copy * self.fat_blocks) * BLOCK + 4 * first
        return np.frombuffer(self.image[start : start + 4 * count], "<u4").copy()

    def set_fat(self, first: int, entries: Sequence[int] | NDArray[np.uint32]) -> None:
        """Write entries of both FATs from `first` on."""
        for copy in range(FATS):
            self.set_fat_copy(copy, first, entries)

    def set_fat_copy(
        self, copy: int, first: int, entries: Sequence[int] | NDArray[np.uint32]
    ) -> None:
        """Write entries of one FAT from `first` on."""
        start = (self.fat_lba + copy * self.fat_blocks) * BLOCK + 4 * first
        content = np.asarray(entries, "<u4").tobytes()
        self.image[start : start + len(content)] = content

    def set_hint(self, cluster: int) -> None:
        """Write FSInfo's hint: the cluster from which on to look for a free one."""
        at = (self.first + INFO_LBA) * BLOCK + INFO_HINT
        self.image[at : at + 4] = struct.pack("<I", cluster & 0xFFFFFFFF)

    def chain(self, first: int, clusters: int) -> None:
        """Give a file one run of clusters."""
        self.set_fat(first, [*range(first + 1, first + clusters), END])

    def add_entry(self, name: str, first: int, size: int, *, attributes: int = ARCHIVE) -> int:
        """Put an entry behind those of the root folder; gives its byte in the image."""
        at = self.entry_end()
        self.image[at : at + ENTRY_BYTES] = directory_entry(name, first, size, attributes)
        return at

    def entry_end(self) -> int:
        """Return the byte of the first free entry of the root folder's first cluster."""
        at = self.lba(ROOT_CLUSTER) * BLOCK
        while self.image[at]:
            at += ENTRY_BYTES
        return at

    def _format(self, partitioned: bool) -> None:
        boot = bytearray(BLOCK)
        boot[0:11] = b"\xeb\x58\x90MSDOS5.0"
        struct.pack_into("<HBHBHHBHHHII", boot, 11, BLOCK, self.cluster_blocks, RESERVED, FATS,
                         0, 0, 0xF8, 0, 63, 255, self.first, self.volume_blocks)  # fmt: skip
        struct.pack_into("<IHHIHH", boot, 36, self.fat_blocks, 0, 0, ROOT_CLUSTER, INFO_LBA, 6)
        struct.pack_into(
            "<BBBI11s8s", boot, 64, 0x80, 0, 0x29, 0x20260101, b"NO NAME    ", b"FAT32   "
        )
        boot[510:512] = b"\x55\xaa"
        info = bytearray(BLOCK)
        info[0:4], info[484:488] = b"RRaA", b"rrAa"
        struct.pack_into("<II", info, 488, self.clusters - 1, ROOT_CLUSTER + 1)
        info[510:512] = b"\x55\xaa"
        for place, block in ((0, boot), (INFO_LBA, info), (6, boot), (7, info)):
            self.write(self.first + place, bytes(block))
        self.set_fat(0, [0x0FFFFFF8, END, END])
        if partitioned:
            table = bytearray(BLOCK)
            struct.pack_into("<B3sB3sII", table, 446, 0, b"\xfe\xff\xff", 0x0C, b"\xfe\xff\xff",
                             self.first, self.volume_blocks)  # fmt: skip
            table[510:512] = b"\x55\xaa"
            self.write(0, bytes(table))


def directory_entry(name: str, first: int, size: int, attributes: int = ARCHIVE) -> bytes:
    """Build an entry of a folder; the name as NAME.EXT."""
    stem, _, extension = name.partition(".")
    entry = bytearray(ENTRY_BYTES)
    entry[0:11] = stem.ljust(8).encode("ascii") + extension.ljust(3).encode("ascii")
    entry[11] = attributes
    struct.pack_into("<HH", entry, 20, first >> 16, 0)
    struct.pack_into("<HI", entry, 26, first & 0xFFFF, size)
    return bytes(entry)
