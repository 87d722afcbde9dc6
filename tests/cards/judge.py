"""What a recorder did with a card: is its message true, what did it write, can a PC read it?"""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from host.wire.framing import text_of
from numpy.typing import NDArray

from tests.cards.sparse import BLOCK
from tests.cards.truth import Card, Truth, look_at

FILE_BLOCKS = 131_072
LEAST_BLOCKS = 5  # within a second, the schema first
CARD_WORDS = re.compile(r"\| card (.*?) \|")


class Stage(IntEnum):
    """How far the recorder came."""

    REFUSED = 0  # no FAT32 volume
    MOUNTED = 1
    FOUND = 2  # the newest file was found and looked at
    RECORDING = 3


@dataclass(slots=True)
class Judgement:
    """What came of a card.

    Attributes
    ----------
    stage : Stage
        How far it came.
    message : str
        Message of the status line ten seconds after power-on.
    wrong : list of str
        What must not be.
    """

    stage: Stage
    message: str
    wrong: list[str] = field(default_factory=list)


def message_of(sent: bytes) -> str:
    """Return what the last whole status line says of the card."""
    lines = text_of(sent).decode("ascii", "replace").split("\r\n")
    found = [m[1] for line in lines[:-1] if (m := CARD_WORDS.search(line))]
    return found[-1] if found else ""


def judge(
    message: str, before: Truth, card: Card, changed: NDArray[np.int64], *, recording: bool
) -> Judgement:
    """Judge what was said of a card and what became of it.

    Parameters
    ----------
    message : str
        What the status line said.
    before : Truth
        Truth of the card at power-on.
    card : Card
        As it is now.
    changed : NDArray[np.int64], shape (n,)
        Its blocks that are others now.
    recording : bool
        Whether it records.
    """
    sound = before.volume is not None and before.volume.sound
    if recording:
        stage = Stage.RECORDING
    elif message == "not FAT32" or (message == "damaged" and not sound):
        stage = Stage.REFUSED
    else:
        found = re.match("ready|open|full|fragmented|searching|damaged", message)
        stage = Stage.FOUND if found else Stage.MOUNTED
    wrong = [] if recording else untrue(message, before)
    wrong += misplaced(before, changed, recording=recording)
    if recording:
        wrong += unreadable(card)
    return Judgement(stage, message, wrong)


def untrue(message: str, truth: Truth) -> list[str]:
    """Compare a message that keeps a recorder from recording with what is on the card."""
    volume = truth.volume
    if message == "not FAT32":
        return [] if volume is None or not volume.sound else ["says not FAT32, and it is"]
    if message == "damaged":
        sound = volume is not None and volume.sound
        return ["says damaged, and it is not"] if sound and truth.folder_room else []
    if volume is None:
        return [f"says {message!r} of a card without FAT32"]
    if message in ("full", "fragmented"):
        room = truth.longest_free_run()
        if room * volume.cluster_blocks < FILE_BLOCKS:
            return []
        if message == "full" and any(number >= 99_999 for number, _ in truth.flights):
            return []
        return [f"says {message}, and {room} clusters in one piece are free"]
    return [f"does not record and says {message!r}"]


def misplaced(before: Truth, changed: NDArray[np.int64], *, recording: bool) -> list[str]:
    """Look at every block that changed: whose was it?"""
    if not len(changed):
        return ["records, and wrote nothing"] if recording else []
    if before.volume is None:
        return [f"wrote {len(changed)} blocks to a card without FAT32"]
    data = changed[changed >= before.volume.data_lba]
    beside = changed[changed < before.volume.fat_lba]
    wrong = []
    if np.any(beside != before.volume.first + 1):
        wrong.append(f"wrote blocks {beside[:5]} before the FAT")
    strange = data[~_allowed(before, data)]
    if len(strange):
        wrong.append(f"wrote {len(strange)} blocks of others, from {strange[0]} on")
    return wrong


def _allowed(truth: Truth, lbas: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Tell which blocks of the data area are free, the newest flight's or the root folder's."""
    volume = truth.volume
    assert volume is not None
    cluster = (lbas - volume.data_lba) // volume.cluster_blocks + 2
    inside = cluster < len(truth.fat)
    mine = truth.follow(volume.root)
    if truth.flights:
        mine += truth.follow(truth.flights[-1][1].first)
    free = truth.fat[np.minimum(cluster, len(truth.fat) - 1)] == 0
    allowed: NDArray[np.bool_] = (free & inside) | np.isin(cluster, mine)
    return allowed


def unreadable(card: Card) -> list[str]:
    """Read the newest flight as a PC does: entry, chain, blocks."""
    after = look_at(card)
    if not after.flights or after.volume is None:
        return ["records, and there is no flight in the root folder"]
    number, entry = after.flights[-1]
    if not after.runs_in_one_piece(entry):
        return [f"records into flight {number}, whose chain is not one run of clusters"]
    places = list(_own_blocks(card, after.volume.lba(entry.first), entry.size // BLOCK))
    if places != list(range(len(places))) or len(places) < LEAST_BLOCKS:
        return [f"{len(places)} blocks of flight {number}, numbered {places[:3]} to {places[-3:]}"]
    return []


def _own_blocks(card: Card, first_lba: int, blocks: int) -> Iterator[int]:
    """Give the numbers of the blocks of a file up to the first that is not of its flight."""
    file_id = b""
    for lba in range(first_lba, first_lba + blocks):
        block = card.read(lba)
        whole = block[:4] == b"FLT1" and zlib.crc32(block[:508]) == int.from_bytes(
            block[508:], "little"
        )
        if not whole or block[4:8] != (file_id or block[4:8]):
            return
        file_id = block[4:8]
        yield int.from_bytes(block[12:16], "little")
