"""What a card truly is, read by the rules of Microsoft's FAT specification and believed nowhere.

The oracle for what the recorder says of it. Knows nothing of the firmware.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tests.cards.sparse import BLOCK, DIRECTORY, ENTRY_BYTES

VOLUME_LABEL = 0x08
FREE, END_FROM, MASK = 0, 0x0FFFFFF8, 0x0FFFFFFF
ONE_FAT_ONLY = 0x80  # of BPB_ExtFlags; its low bits say which


class Card(Protocol):
    """Anything of which blocks can be read."""

    @property
    def blocks(self) -> int:
        """Its size."""

    def read(self, lba: int, blocks: int = 1) -> bytes:
        """Return some blocks."""


@dataclass(frozen=True, slots=True)
class Volume:
    """A FAT32 volume found on a card.

    Attributes
    ----------
    active : int
        The FAT that counts: the first unless the boot sector names another.
    sound : bool
        Whether every figure of the boot sector fits the others and the card; where not, a reader
        may refuse it.
    """

    first: int
    cluster_blocks: int
    fat_lba: int
    fat_blocks: int
    copies: int
    data_lba: int
    clusters: int
    root: int
    active: int
    sound: bool

    def lba(self, cluster: int) -> int:
        """First block of a cluster."""
        return self.data_lba + (cluster - 2) * self.cluster_blocks


@dataclass(frozen=True, slots=True)
class Entry:
    """A file or folder of the root folder."""

    name: str
    attributes: int
    first: int
    size: int


@dataclass(slots=True)
class Truth:
    """What is on the card.

    Attributes
    ----------
    volume : Volume or None
        None: no FAT32 volume.
    fats : list of NDArray[np.uint32]
        Every copy's entries, their upper four bits masked.
    entries : list of Entry
        Entries of the root folder, as far as its chain can be followed.
    folder_room : bool
        Whether an entry of the root folder is free.
    """

    volume: Volume | None
    fats: list[NDArray[np.uint32]] = field(default_factory=list)
    entries: list[Entry] = field(default_factory=list)
    folder_room: bool = False

    @property
    def flights(self) -> list[tuple[int, Entry]]:
        """Flight files with their numbers, folders of that name too."""
        found = []
        for entry in self.entries:
            digits = entry.name[3:8]
            is_flight = entry.name[:3] == "FLT" and entry.name[8:] == ".BIN"
            if is_flight and digits.isdecimal() and digits.isascii():
                found.append((int(digits), entry))
        return sorted(found, key=lambda pair: pair[0])

    @property
    def fat(self) -> NDArray[np.uint32]:
        """The FAT that counts."""
        assert self.volume is not None
        return self.fats[self.volume.active]

    def longest_free_run(self) -> int:
        """Return the clusters of the longest run of free ones."""
        used = np.flatnonzero(self.fat[2:] != FREE)
        edges = np.concatenate(([-1], used, [len(self.fat) - 2]))
        return int(np.diff(edges).max()) - 1

    def follow(self, first: int) -> list[int]:
        """Return a chain's clusters up to its end, a repeated one or one that is none."""
        found: list[int] = []
        seen = set()
        fat = self.fat
        while 2 <= first < len(fat) and first not in seen:
            found.append(first)
            seen.add(first)
            first = int(fat[first])
        return found

    def runs_in_one_piece(self, entry: Entry) -> bool:
        """Whether a file's chain is one run of clusters that ends where its size says."""
        if self.volume is None:
            return False
        chain = self.follow(entry.first)
        wanted = -(-entry.size // (self.volume.cluster_blocks * BLOCK))
        run = list(range(entry.first, entry.first + wanted))
        return chain == run and int(self.fat[chain[-1]]) >= END_FROM if chain else False


def look_at(card: Card) -> Truth:
    """Read a card."""
    volume = find_volume(card, card.blocks)
    if volume is None:
        return Truth(None)
    truth = Truth(volume)
    for copy in range(volume.copies):
        raw = card.read(volume.fat_lba + copy * volume.fat_blocks, volume.fat_blocks)
        table = np.frombuffer(raw, "<u4")[: volume.clusters + 2] & np.uint32(MASK)
        truth.fats.append(table)
    for cluster in truth.follow(volume.root):
        content = card.read(volume.lba(cluster), volume.cluster_blocks)
        marks = content[::ENTRY_BYTES]
        truth.folder_room = truth.folder_room or 0 in marks or 0xE5 in marks
        if not read_folder(content, truth.entries):
            break
    return truth


def find_volume(card: Card, blocks: int) -> Volume | None:
    """Find the first FAT32 volume: on the whole card, or behind a partition table."""
    boot = card.read(0)
    if boot[510:512] != b"\x55\xaa":
        return None
    whole = parse_boot(boot, 0, blocks)
    if whole is not None:
        return whole
    for slot in range(446, 510, 16):
        (first,) = struct.unpack_from("<I", boot, slot + 8)
        if boot[slot + 4] and 0 < first < blocks:
            found = parse_boot(card.read(first), first, blocks)
            if found is not None:
                return found
    return None


def parse_boot(boot: bytes, first: int, blocks: int) -> Volume | None:
    """Read a boot sector; None where what it says cannot be a FAT32 volume."""
    size, per_cluster, reserved, copies, root_entries, small_total = struct.unpack_from(
        "<HBHBHH", boot, 11
    )
    (small_fat,) = struct.unpack_from("<H", boot, 22)
    (total,) = struct.unpack_from("<I", boot, 32)
    fat_blocks, flags, version, root = struct.unpack_from("<IHHI", boot, 36)
    power = per_cluster and per_cluster & (per_cluster - 1) == 0
    if boot[510:512] != b"\x55\xaa" or size != BLOCK or not power or copies not in (1, 2):
        return None
    if small_fat or root_entries or not reserved or not fat_blocks:
        return None
    total = small_total or total
    data = reserved + copies * fat_blocks
    clusters = (total - data) // per_cluster
    if clusters < 1 or not 2 <= root < clusters + 2:
        return None
    active = flags & 0x0F if flags & ONE_FAT_ONLY else 0
    room = fat_blocks * (BLOCK // 4) - 2
    sound = (
        not small_total
        and first + total <= blocks
        and 65_525 <= clusters <= room
        and version == 0
        and active < copies
        and boot[0] in (0xEB, 0xE9)
        and boot[82:90] == b"FAT32   "
    )
    within = min(clusters, room, (blocks - first - data) // per_cluster)
    if within < 1:
        return None
    return Volume(
        first, per_cluster, first + reserved, fat_blocks, copies, first + data, within, root,
        active % copies, sound,
    )  # fmt: skip


def read_folder(content: bytes, entries: list[Entry]) -> bool:
    """Read a piece of a folder; gives whether it goes on."""
    for at in range(0, len(content), ENTRY_BYTES):
        raw = content[at : at + ENTRY_BYTES]
        if raw[0] == 0:
            return False
        if raw[0] == 0xE5 or raw[11] & VOLUME_LABEL:  # long names carry the label's bit too
            continue
        name = raw[0:8].rstrip(b" ").decode("latin-1") + "." + raw[8:11].decode("latin-1")
        (high,) = struct.unpack_from("<H", raw, 20)
        low, size = struct.unpack_from("<HI", raw, 26)
        first = (high << 16 | low) & MASK
        entries.append(Entry(name, raw[11] & (0x3F | DIRECTORY), first, size))
    return True
