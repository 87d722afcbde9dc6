"""FAT32 card images: formatted as a card comes from the shop, read as a PC reads them."""

from __future__ import annotations

import contextlib
import io
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pyfatfs.PyFat import PyFat

Image = bytes | bytearray | Path

BLOCK = 512
RESERVED = 32
FATS = 2
LEAST_CLUSTERS = 65_526  # fewer make it FAT16 (Microsoft FAT specification, section 3.5)
PARTITION_LBA = 2048
CARD_ID = bytes.fromhex("03534453553332478012345678015b3d")


def blocks_for(cluster_blocks: int, *, partitioned: bool = False) -> int:
    """Return the blocks of the smallest FAT32 volume with clusters of that size."""
    clusters = LEAST_CLUSTERS + 1024
    fat = -(-(clusters + 2) * 4 // BLOCK)
    size = RESERVED + FATS * fat + clusters * cluster_blocks
    return size + (PARTITION_LBA if partitioned else 0)


def format_fat32(image: memoryview, cluster_blocks: int, *, partitioned: bool = False) -> None:
    """Write an empty FAT32 volume as a quick format does: data clusters keep what they held.

    Parameters
    ----------
    image : memoryview of bytes
        The whole card.
    cluster_blocks : int
        Blocks in a cluster, a power of two.
    partitioned : bool
        Behind a partition table, as cards are sold, or filling the whole card.
    """
    first = PARTITION_LBA if partitioned else 0
    total = len(image) // BLOCK - first
    fat = -(-(total // cluster_blocks + 2) * 4 // BLOCK)
    clusters = (total - RESERVED - FATS * fat) // cluster_blocks
    if clusters < LEAST_CLUSTERS:
        raise ValueError(f"{clusters} clusters, FAT32 has at least {LEAST_CLUSTERS}")
    boot = bytearray(BLOCK)
    boot[0:11] = b"\xeb\x58\x90FLTDEMO "
    struct.pack_into("<HBHBHHBHHHII", boot, 11, BLOCK, cluster_blocks, RESERVED, FATS, 0, 0, 0xF8,
                     0, 63, 255, first, total)  # fmt: skip
    struct.pack_into("<IHHIHH", boot, 36, fat, 0, 0, 2, 1, 6)
    struct.pack_into("<BBBI11s8s", boot, 64, 0x80, 0, 0x29, 0x20260101, b"NO NAME    ", b"FAT32   ")
    boot[510:512] = b"\x55\xaa"
    info = bytearray(BLOCK)
    info[0:4] = b"RRaA"
    info[484:488] = b"rrAa"
    struct.pack_into("<II", info, 488, clusters - 1, 3)
    info[510:512] = b"\x55\xaa"
    for place, block in ((0, boot), (1, info), (6, boot), (7, info)):
        _put(image, first + place, block)
    tables = FATS * fat + cluster_blocks
    _put(image, first + RESERVED, bytes(tables * BLOCK))  # and the root folder behind them
    head = struct.pack("<III", 0x0FFFFFF8, 0x0FFFFFFF, 0x0FFFFFFF).ljust(BLOCK, b"\0")
    for copy in range(FATS):
        _put(image, first + RESERVED + copy * fat, head)
    if partitioned:
        table = bytearray(BLOCK)
        table[446:462] = struct.pack("<B3sB3sII", 0, b"\xfe\xff\xff", 0x0C, b"\xfe\xff\xff",
                                     first, total)  # fmt: skip
        table[510:512] = b"\x55\xaa"
        _put(image, 0, table)


def new_card(cluster_blocks: int = 1, *, partitioned: bool = False) -> bytearray:
    """Return the image of the smallest empty card."""
    image = bytearray(blocks_for(cluster_blocks, partitioned=partitioned) * BLOCK)
    format_fat32(memoryview(image), cluster_blocks, partitioned=partitioned)
    return image


def list_files(image: Image, *, partitioned: bool = False) -> dict[str, int]:
    """Return name and size of every file in the root folder, through pyfatfs."""
    with _opened(image, partitioned) as volume:
        return {str(e.get_short_name()): int(e.filesize) for e in _files(volume)}


def read_file(image: Image, name: str, *, partitioned: bool = False) -> bytes:
    """Return the content of a file in the root folder, through pyfatfs.

    Raises
    ------
    FileNotFoundError
        If there is none of that name.
    """
    with _opened(image, partitioned) as volume:
        for entry in _files(volume):
            if entry.get_short_name() == name:
                chain = volume.get_cluster_chain(entry.get_cluster()) if entry.filesize else ()
                content = b"".join(volume.read_cluster_contents(cluster) for cluster in chain)
                return content[: entry.filesize]
    raise FileNotFoundError(f"found no {name} on the card")


def remove_files(image: bytearray) -> None:
    """Delete every file in the root folder, as a PC does: the content of its clusters stays."""
    memory = _Memory(image)
    volume = PyFat()
    volume.set_fp(memory)
    for entry in _files(volume):
        volume.free_cluster_chain(entry.get_cluster())
        volume.root_dir.remove_dir_entry(entry.get_short_name())
    volume.update_directory_entry(volume.root_dir)
    volume.close()
    image[:] = memory.getvalue()


class _Memory(io.BytesIO):
    """Stays open when pyfatfs closes it, so that the result can be fetched."""

    def close(self) -> None:
        """Do nothing."""


class _ReadOnly(io.BytesIO):
    """Tells pyfatfs not to mark the volume as in use."""

    def writable(self) -> bool:
        """Say no."""
        return False


@contextlib.contextmanager
def _opened(image: Image, partitioned: bool) -> Iterator[PyFat]:
    volume = PyFat(offset=PARTITION_LBA * BLOCK if partitioned else 0)
    if isinstance(image, Path):
        volume.open(str(image), read_only=True)
    else:
        volume.set_fp(_ReadOnly(image))
    try:
        yield volume
    finally:
        volume.close()


def _files(volume: PyFat) -> list[Any]:
    _, files, _ = volume.root_dir.get_entries()
    return sorted(files, key=lambda entry: str(entry.get_short_name()))


def _put(image: memoryview, lba: int, block: bytes | bytearray) -> None:
    image[lba * BLOCK : lba * BLOCK + len(block)] = block
