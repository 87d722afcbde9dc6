"""Cards drawn at random: a good one as a pilot has it, then altered in one to three places.

card = draw(seed)        the same card for the same seed
card.altered             what was done to it, in words
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from tests.cards.flights import FlightFile, State, add_flight
from tests.cards.sparse import (
    BLOCK,
    DIRECTORY,
    END,
    ENTRIES_PER_FAT_BLOCK,
    ENTRY_BYTES,
    FATS,
    INFO_LBA,
    ROOT_CLUSTER,
    SparseCard,
    directory_entry,
)

CLUSTER_BLOCKS = (8, 32, 64, 128)  # 4, 16, 32, 64 kB
FIRST_FREE = 3
BAD_CLUSTER = 0x0FFFFFF7
READ_ONLY, HIDDEN, LABEL = 0x01, 0x02, 0x08
# Numbers a careless reader stumbles over.
ODD = (0, 1, 2, 3, 0x7F, 0x80, 0xFF, 0x100, 0xFFFF, 0x10000, 0x0FFFFFF6, BAD_CLUSTER, END,
       0x10000000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFE, 0xFFFFFFFF)  # fmt: skip


@dataclass(slots=True)
class DrawnCard:
    """A card under alteration.

    Attributes
    ----------
    card : SparseCard
        The card.
    rng : Generator
        Draws everything.
    flights : list of FlightFile
        Its flights, the newest last; none on an empty card.
    altered : list of str
        What was done to it.
    """

    card: SparseCard
    rng: np.random.Generator
    flights: list[FlightFile] = field(default_factory=list)
    altered: list[str] = field(default_factory=list)

    @property
    def newest(self) -> FlightFile | None:
        """The flight with the largest number."""
        return self.flights[-1] if self.flights else None

    def odd(self) -> int:
        """Draw a number: odd ones, or any."""
        if self.rng.random() < 0.7:
            return int(self.rng.choice(ODD))
        return int(self.rng.integers(0, 1 << 32))

    def cluster(self) -> int:
        """Draw a cluster of the card."""
        return int(self.rng.integers(2, self.card.clusters + 2))

    def any_entry(self) -> int:
        """Draw the byte of a directory entry: mostly the newest flight's."""
        if self.newest is not None and self.rng.random() < 0.7:
            return self.newest.entry
        root = self.card.lba(ROOT_CLUSTER) * BLOCK
        return root + ENTRY_BYTES * int(self.rng.integers(0, 16))


def draw(seed: int) -> DrawnCard:
    """Draw a card and alter it in one to three places."""
    rng = np.random.default_rng(seed)
    drawn = good_card(rng)
    for _ in range(int(rng.choice([1, 2, 3], p=[0.6, 0.25, 0.15]))):
        group = ALTERATIONS[int(rng.choice(len(ALTERATIONS), p=WEIGHTS))]
        alter = group[int(rng.integers(0, len(group)))]
        said = alter(drawn)
        drawn.altered.append(f"{alter.__name__.replace('_', ' ')}: {said}")
    return drawn


def good_card(rng: np.random.Generator) -> DrawnCard:
    """Make a card as it comes out of an aircraft: up to three closed flights and a newest one."""
    card = SparseCard(int(rng.choice(CLUSTER_BLOCKS)), partitioned=bool(rng.random() < 0.2))
    drawn = DrawnCard(card, rng)
    number, first = int(rng.integers(1, 400)), FIRST_FREE
    if rng.random() < 0.5:
        photo = int(rng.integers(1, 300))
        card.add_entry("PHOTO.JPG", first, photo * card.cluster_blocks * BLOCK - 77)
        card.chain(first, photo)
        first += photo
    for _ in range(int(rng.integers(0, 4))):
        drawn.flights.append(add_flight(card, number, first, State.CLOSED, used=50))
        number += 1
        first += drawn.flights[-1].clusters + int(rng.integers(0, 3))
    if rng.random() < 0.9:
        state = State(rng.choice([state.value for state in State]))
        freed = int(rng.choice([0, 1, 100, 128, 500, 4000, 20_000]))
        used = int(rng.integers(30, 900))
        flight = add_flight(card, number, first, state, used=used, freed_clusters=freed)
        drawn.flights.append(flight)
    if rng.random() < 0.5:
        drawn.card.set_hint(first)
    return drawn


# --- the chain of the newest file ---


def chain_cut_short(drawn: DrawnCard) -> str:
    """Its end comes early."""
    flight = drawn.newest
    if flight is None:
        return link_of_anything(drawn)
    at = flight.first + int(drawn.rng.integers(0, max(flight.clusters - 1, 1)))
    drawn.card.set_fat(at, [END])
    return f"ends at cluster {at} of {flight.first} to {flight.first + flight.clusters - 1}"


def cyclic_chain(drawn: DrawnCard) -> str:
    """It comes back to itself."""
    flight = drawn.newest
    if flight is None:
        return link_of_anything(drawn)
    at = flight.first + int(drawn.rng.integers(0, flight.clusters))
    back = int(drawn.rng.integers(flight.first, at + 1))
    drawn.card.set_fat(at, [back])
    return f"cluster {at} leads back to {back}"


def link_anywhere(drawn: DrawnCard) -> str:
    """It leads to another file, to a free cluster, out of the card."""
    flight = drawn.newest
    if flight is None:
        return link_of_anything(drawn)
    at = flight.first + int(drawn.rng.integers(0, flight.clusters))
    to = drawn.cluster() if drawn.rng.random() < 0.5 else drawn.odd()
    drawn.card.set_fat(at, [to])
    return f"cluster {at} leads to {to:#x}"


def first_link(drawn: DrawnCard) -> str:
    """Its first cluster is free, bad, an end."""
    flight = drawn.newest
    if flight is None:
        return link_of_anything(drawn)
    to = int(drawn.rng.choice([0, 1, BAD_CLUSTER, END, flight.first]))
    drawn.card.set_fat(flight.first, [to])
    return f"first cluster {flight.first} leads to {to:#x}"


def link_of_anything(drawn: DrawnCard) -> str:
    """Any link of the first clusters, the root folder's too."""
    at, to = int(drawn.rng.integers(2, 40)), drawn.odd()
    drawn.card.set_fat(at, [to])
    return f"cluster {at} leads to {to:#x}"


# --- the FATs ---


def garbage_fat_block(drawn: DrawnCard) -> str:
    """A block of one FAT or of both is noise, all ones, or another's content."""
    card, rng = drawn.card, drawn.rng
    near = 1 + (drawn.newest.first // ENTRIES_PER_FAT_BLOCK if drawn.newest else 0)
    block = (
        int(rng.integers(0, near + 2))
        if rng.random() < 0.7
        else int(rng.integers(0, card.fat_blocks))
    )
    contents = (
        rng.bytes(BLOCK),
        b"\xff" * BLOCK,
        bytes(BLOCK),
        b"FLT1" * 128,
        card.read(card.fat_lba),
    )
    content = contents[int(rng.integers(0, len(contents)))]
    copies = ([0], [1], [0, 1])[int(rng.integers(0, 3))]
    for copy in copies:
        card.write(card.fat_lba + copy * card.fat_blocks + block, content)
    return f"block {block} of FATs {copies}"


def flipped_bits(drawn: DrawnCard) -> str:
    """Single bits of the FAT's first blocks."""
    card, rng = drawn.card, drawn.rng
    start = card.fat_lba * BLOCK
    places = rng.integers(start, start + 4 * BLOCK, int(rng.integers(1, 12)))
    for place in places:
        card.image[int(place)] ^= 1 << int(rng.integers(0, 8))
    return f"{len(places)} bits"


def fats_differ(drawn: DrawnCard) -> str:
    """The second FAT is older: nothing of the newest flight is in it."""
    card, flight = drawn.card, drawn.newest
    first, count = (flight.first, flight.clusters) if flight else (2, 100)
    card.set_fat_copy(int(drawn.rng.integers(0, FATS)), first, np.zeros(count, np.uint32))
    return f"{count} entries from {first} on"


def card_nearly_full(drawn: DrawnCard) -> str:
    """Most clusters belong to something."""
    card, rng = drawn.card, drawn.rng
    low = drawn.newest.first + drawn.newest.clusters if drawn.newest else FIRST_FREE + 400
    table = card.fat(low)
    taken = rng.random(len(table)) < float(rng.choice([0.01, 0.5, 0.99, 1.0]))
    table[taken & (table == 0)] = END
    card.set_fat(low, table)
    return f"{np.count_nonzero(taken)} of {len(table)}"


# --- the folder ---


def entry_field(drawn: DrawnCard) -> str:
    """First cluster or size of an entry."""
    at, value = drawn.any_entry(), drawn.odd()
    image = drawn.card.image
    if drawn.rng.random() < 0.5:
        image[at + 20 : at + 22] = struct.pack("<H", value >> 16)
        image[at + 26 : at + 28] = struct.pack("<H", value & 0xFFFF)
        return f"first cluster {value:#x}"
    image[at + 28 : at + 32] = struct.pack("<I", value)
    return f"size {value:#x}"


def entry_attributes(drawn: DrawnCard) -> str:
    """A flight that is a folder, a label, read-only, hidden."""
    value = int(drawn.rng.choice([DIRECTORY, READ_ONLY, HIDDEN, LABEL, 0x0F, 0xFF, 0]))
    drawn.card.image[drawn.any_entry() + 11] = value
    return f"{value:#x}"


def folder_named_as_a_flight(drawn: DrawnCard) -> str:
    """A folder with the largest number."""
    number = (drawn.newest.number if drawn.newest else 0) + int(drawn.rng.integers(1, 3))
    first = int(drawn.rng.choice([0, 2, drawn.card.clusters, drawn.card.clusters + 5]))
    drawn.card.add_entry(f"FLT{number:05d}.BIN", first, 0, attributes=DIRECTORY)
    return f"number {number}, cluster {first}"


def another_flight(drawn: DrawnCard) -> str:
    """A flight whose entry leads into the newest one, into the root folder, nowhere."""
    flight = drawn.newest
    inside = flight.first + flight.clusters // 2 if flight else 5
    number = int(drawn.rng.choice([0, 1, 7, 500, 99_998, 99_999]))
    first = int(drawn.rng.choice([0, 1, 2, inside, drawn.card.clusters + 2]))
    size = drawn.odd()
    drawn.card.add_entry(f"FLT{number:05d}.BIN", first, size)
    return f"number {number}, cluster {first}, size {size:#x}"


def noise_in_the_folder(drawn: DrawnCard) -> str:
    """A block of the root folder is noise, or many entries without an end."""
    card, rng = drawn.card, drawn.rng
    block = card.lba(ROOT_CLUSTER) + int(
        rng.integers(0, card.cluster_blocks if rng.random() < 0.5 else 2)
    )
    if rng.random() < 0.5:
        card.write(block, rng.bytes(BLOCK))
        return f"block {block}"
    behind = card.lba(ROOT_CLUSTER + 1) * BLOCK
    end = min(card.entry_end(), behind)  # it may be full already
    card.image[end:behind] = directory_entry("KEEP.DAT", 0, 0) * ((behind - end) // ENTRY_BYTES)
    if rng.random() < 0.5:
        card.set_fat(ROOT_CLUSTER, [int(rng.choice([ROOT_CLUSTER, 0, 1, drawn.cluster()]))])
    return "no end mark"


# --- boot sector and FSInfo ---


def boot_field(drawn: DrawnCard) -> str:
    """One figure of the boot sector."""
    places = ((11, 2), (13, 1), (14, 2), (16, 1), (17, 2), (19, 2), (22, 2), (28, 4), (32, 4),
              (36, 4), (40, 2), (42, 2), (44, 4), (48, 2), (82, 4), (510, 2))  # fmt: skip
    at, size = places[int(drawn.rng.integers(0, len(places)))]
    value = drawn.odd() & ((1 << 8 * size) - 1)
    start = drawn.card.first * BLOCK + at
    drawn.card.image[start : start + size] = value.to_bytes(size, "little")
    return f"byte {at} is {value:#x}"


def boot_noise(drawn: DrawnCard) -> str:
    """Some bytes of the boot sector, or of the partition table."""
    first = drawn.card.first if drawn.rng.random() < 0.7 else 0
    count = int(drawn.rng.choice([1, 4, 64]))
    for place in drawn.rng.integers(0, BLOCK, count):
        drawn.card.image[first * BLOCK + int(place)] = int(drawn.rng.integers(0, 256))
    return f"{count} bytes of block {first}"


def fs_info(drawn: DrawnCard) -> str:
    """Hint, free count or signatures of FSInfo."""
    if drawn.rng.random() < 0.7:
        value = drawn.odd() if drawn.rng.random() < 0.5 else drawn.cluster()
        drawn.card.set_hint(value)
        return f"hint {value:#x}"
    drawn.card.write(drawn.card.first + INFO_LBA, drawn.rng.bytes(BLOCK))
    return "noise"


Alteration = Callable[[DrawnCard], str]
ALTERATIONS: tuple[tuple[Alteration, ...], ...] = (
    (chain_cut_short, cyclic_chain, link_anywhere, first_link, link_of_anything),
    (garbage_fat_block, flipped_bits, fats_differ, card_nearly_full),
    (entry_field, entry_attributes, folder_named_as_a_flight, another_flight, noise_in_the_folder),
    (fs_info,),
    (boot_field, boot_noise),
)
WEIGHTS = (0.33, 0.22, 0.25, 0.08, 0.12)
