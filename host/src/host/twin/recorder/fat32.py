"""A memory card as a computer would format and read it: one FAT32 partition, 8.3 names.

Microsoft, FAT32 File System Specification 1.03. Only what a flight card needs: an empty card is
made, files in the root folder are read back.
"""

from __future__ import annotations

import mmap
import struct
import sys
from dataclasses import dataclass

SECTOR = 512
PARTITION_START = 2048
RESERVED = 32
SECTORS_PER_CLUSTER = 8
END_OF_CHAIN = 0x0FFFFFF8
CARD_BYTES = 512 * 1024 * 1024  # reserved address space: untouched pages take no memory


class CardImageError(ValueError):
    """The image holds no FAT32 as expected; the text says what was found."""


@dataclass(frozen=True, slots=True)
class RootFile:
    """One file of the root folder."""

    name: str
    size: int
    first_cluster: int


def format_card(
    size_bytes: int = CARD_BYTES, serial: int = 0x20150601, *, full: bool = False
) -> mmap.mmap:
    """Return an empty, formatted card image.

    Parameters
    ----------
    size_bytes : int
        At least 300 MB, below which 4 KiB clusters would not make a FAT32.
    serial : int
        Volume serial number.
    full : bool
        Every cluster is taken.

    Raises
    ------
    CardImageError
        The size does not make a FAT32.
    """
    sectors = size_bytes // SECTOR - PARTITION_START
    clusters = (sectors - RESERVED) // SECTORS_PER_CLUSTER
    fat_sectors = -(-(clusters + 2) * 4 // SECTOR)
    clusters = (sectors - RESERVED - 2 * fat_sectors) // SECTORS_PER_CLUSTER
    if clusters < 65525:
        raise CardImageError(f"{size_bytes} bytes make {clusters} clusters, expected 65525 or more")
    image = unwritten_card(size_bytes)
    entry = struct.pack(
        "<B3sB3sII", 0, b"\x20\x21\x00", 0x0C, b"\xfe\xff\xff", PARTITION_START, sectors
    )
    image[446:462] = entry
    image[510:512] = b"\x55\xaa"
    boot = struct.pack(
        "<3s8sHBHBHHBHHHIIIHHIHH12xBBBI11s8s",
        b"\xeb\x58\x90", b"FLTCARD ", SECTOR, SECTORS_PER_CLUSTER, RESERVED, 2, 0, 0, 0xF8, 0,
        63, 255, PARTITION_START, sectors, fat_sectors, 0, 0, 2, 1, 6,
        0x80, 0, 0x29, serial, b"NO NAME    ", b"FAT32   ",
    )  # fmt: skip
    boot = boot.ljust(510, b"\0") + b"\x55\xaa"
    free = 0 if full else clusters - 1
    info = struct.pack("<I480xIII12xI", 0x41615252, 0x61417272, free, 3, 0xAA550000)
    base = PARTITION_START * SECTOR
    for copy in (0, 6):
        image[base + copy * SECTOR : base + (copy + 1) * SECTOR] = boot
        image[base + (copy + 1) * SECTOR : base + (copy + 2) * SECTOR] = info
    for copy in range(2):
        fat = base + (RESERVED + copy * fat_sectors) * SECTOR
        taken = clusters - 1 if full else 0
        image[fat : fat + 12] = struct.pack("<III", 0x0FFFFFF8, 0x0FFFFFFF, 0x0FFFFFFF)
        image[fat + 12 : fat + 12 + 4 * taken] = struct.pack("<I", 0x0FFFFFFF) * taken
    return image


def unwritten_card(size_bytes: int = CARD_BYTES) -> mmap.mmap:
    """Return a card of zeros: memory of this process alone, of which reading takes none."""
    if sys.platform == "win32":
        return mmap.mmap(-1, size_bytes)
    return mmap.mmap(-1, size_bytes, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)


class CardReader:
    """Reads the root folder of a card image.

    Parameters
    ----------
    image : mmap or bytes
        With a partition table.

    Raises
    ------
    CardImageError
        No FAT32 partition.
    """

    def __init__(self, image: mmap.mmap | bytes) -> None:
        self._image = image
        (start,) = struct.unpack_from("<I", image, 454)
        base = start * SECTOR
        if image[510:512] != b"\x55\xaa" or image[base + 82 : base + 87] != b"FAT32":
            raise CardImageError("no FAT32 partition found")
        per_cluster, reserved, fats = struct.unpack_from("<BHB", image, base + 13)
        (fat_sectors,) = struct.unpack_from("<I", image, base + 36)
        (self._root,) = struct.unpack_from("<I", image, base + 44)
        self._fat = base + reserved * SECTOR
        self._data = self._fat + fats * fat_sectors * SECTOR
        self._cluster = per_cluster * SECTOR

    def files(self) -> list[RootFile]:
        """Return the files of the root folder, in its order."""
        found = []
        folder = self._read(self._root, 0)
        for at in range(0, len(folder), 32):
            entry = folder[at : at + 32]
            if entry[0] == 0:
                break
            if entry[0] == 0xE5 or entry[11] & 0x18:
                continue
            stem = entry[:8].decode("ascii", "replace").rstrip()
            suffix = entry[8:11].decode("ascii", "replace").rstrip()
            high, low, size = struct.unpack_from("<H4xHI", entry, 20)
            found.append(RootFile(f"{stem}.{suffix}", size, high << 16 | low))
        return found

    def read(self, file: RootFile) -> bytes:
        """Return the content of a file, its whole size."""
        return self._read(file.first_cluster, file.size)[: file.size]

    def _read(self, cluster: int, size: int) -> bytes:
        parts: list[bytes] = []
        room = -(-size // self._cluster) if size else 1 << 20
        while 2 <= cluster < END_OF_CHAIN and len(parts) < room:
            at = self._data + (cluster - 2) * self._cluster
            parts.append(self._image[at : at + self._cluster])
            (cluster,) = struct.unpack_from("<I", self._image, self._fat + 4 * cluster)
            cluster &= 0x0FFFFFFF
        return b"".join(parts)
