"""The blocks of one log among all valid blocks of a file (protocol/README.md, "File")."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from host.errors import LogError, NotALogError
from host.wire.blocks import Blocks, Scan
from host.wire.extents import BLOCK_BYTES

_SHOWN_IDS = 8


@dataclass(frozen=True, slots=True)
class Foreign:
    """Valid blocks of another log in the same file: older data, or a second log glued on.

    Parameters
    ----------
    file_id : int
    sessions : tuple of int
        Session numbers, ascending.
    blocks : int
        How many there are.
    offset : int
        Byte position of the first.
    """

    file_id: int
    sessions: tuple[int, ...]
    blocks: int
    offset: int


@dataclass(frozen=True, slots=True)
class Selection:
    """The blocks of one log in the order in which they were written.

    Parameters
    ----------
    blocks : Blocks
        One per sequence number, ascending.
    file_id : int
    sessions : tuple of int
        Sessions of this log, in the order in which they were recorded.
    foreign : tuple of Foreign
        Blocks of other logs in the file, in the order of position.
    duplicates : int
        Blocks that stand in the file more than once, beyond the first copy.
    displaced : int
        Blocks that do not stand behind the block of the sequence number before.
    base : int
        Byte position of the log's first block: 0, but in a card's image or behind another log.
    """

    blocks: Blocks
    file_id: int
    sessions: tuple[int, ...]
    foreign: tuple[Foreign, ...]
    duplicates: int
    displaced: int
    base: int


def select(scan: Scan, name: str, file_id: int | None = None) -> Selection:
    """Pick the log of a file: that of its first valid block, or the one asked for.

    In the image of a card it is the newest flight: the largest session that recorded.

    Parameters
    ----------
    scan : Scan
    name : str
        What to call the file in an error.
    file_id : int, optional
        Take the blocks with this id instead.

    Returns
    -------
    Selection

    Raises
    ------
    NotALogError
        If the file holds no valid block.
    LogError
        If no block has the id asked for.
    """
    blocks = scan.blocks
    if not len(blocks):
        raise NotALogError(
            f"{name}: not one intact block of a flight log in {scan.size_bytes} bytes; expected a"
            " file the logger wrote (FLTnnnnn.BIN)"
        )
    own_id = file_id
    if own_id is None:
        own_id = int(blocks.file_id[_newest(blocks) if scan.is_card else 0])
    own = blocks.take(blocks.file_id == own_id)
    if not len(own):
        ids = np.unique(blocks.file_id)
        known = ", ".join(f"{other:08x}" for other in ids[:_SHOWN_IDS])
        known += f" and {len(ids) - _SHOWN_IDS} more" if len(ids) > _SHOWN_IDS else ""
        raise LogError(f"{name}: no block has file id {own_id:08x}; the file holds {known}")
    base = _base(own)
    ordered, duplicates = _ordered(own, base)
    return Selection(
        blocks=ordered,
        file_id=own_id,
        sessions=_in_order(ordered.session),
        foreign=_foreign(blocks, own_id),
        duplicates=duplicates,
        displaced=int(np.count_nonzero(np.diff(ordered.position) <= 0)),
        base=base,
    )


def _newest(blocks: Blocks) -> int:
    """Return a block of the newest flight; a file's first block is written when it is made."""
    recorded = np.flatnonzero(blocks.sequence > 0)
    return int(recorded[np.argmax(blocks.session[recorded])]) if len(recorded) else 0


def _base(own: Blocks) -> int:
    """Return where block 0 stands, by most blocks, if none stands at its place in the file."""
    place = own.position - own.sequence.astype(np.int64) * BLOCK_BYTES
    if not place.all() or place.max() < 0:
        return 0
    values, counts = np.unique(place[place > 0], return_counts=True)
    return int(values[np.argmax(counts)])


def _ordered(own: Blocks, base: int) -> tuple[Blocks, int]:
    sequence = own.sequence.astype(np.int64)
    if len(own) < 2 or bool((np.diff(sequence) > 0).all()):
        return own, 0
    # A copy that stands where its number says is preferred to one that does not.
    away = own.position != base + sequence * BLOCK_BYTES
    order = np.lexsort((own.position, away, sequence))
    first: NDArray[np.bool_] = np.r_[True, np.diff(sequence[order]) != 0]
    return own.take(order[first]), int(len(first) - np.count_nonzero(first))


def _in_order(values: NDArray[np.uint32]) -> tuple[int, ...]:
    """Return each value once, in the order of first appearance."""
    first = np.flatnonzero(np.r_[True, values[1:] != values[:-1]][: len(values)])
    return tuple(dict.fromkeys(values[first].tolist()))


def _foreign(blocks: Blocks, own_id: int) -> tuple[Foreign, ...]:
    others = blocks.take(blocks.file_id != own_id)
    order = np.lexsort((others.session, others.file_id))
    ids, sessions, places = (
        column[order] for column in (others.file_id, others.session, others.position)
    )
    edges = [0, *(np.flatnonzero(np.diff(ids.astype(np.int64))) + 1).tolist(), len(ids)]
    found = [
        Foreign(
            int(ids[first]),
            tuple(dict.fromkeys(sessions[first:last].tolist())),
            last - first,
            int(places[first:last].min()),
        )
        for first, last in itertools.pairwise(edges)
        if last > first
    ]
    return tuple(sorted(found, key=lambda other: other.offset))
