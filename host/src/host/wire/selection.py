"""The blocks of one log among all valid blocks of a file (protocol/README.md, "File")."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from host.errors import LogError, NotALogError
from host.wire.blocks import Blocks, Scan
from host.wire.extents import BLOCK_BYTES


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
        What else the file holds, in the order of position.
    duplicates : int
        Blocks that stand in the file more than once, beyond the first copy.
    displaced : int
        Blocks that do not stand behind the block of the sequence number before.
    """

    blocks: Blocks
    file_id: int
    sessions: tuple[int, ...]
    foreign: tuple[Foreign, ...]
    duplicates: int
    displaced: int


def select(scan: Scan, name: str, file_id: int | None = None) -> Selection:
    """Pick the log of a file: that of its first valid block, or the one asked for.

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
    own_id = int(blocks.file_id[0]) if file_id is None else file_id
    own = blocks.take(blocks.file_id == own_id)
    if not len(own):
        known = ", ".join(f"{other:08x}" for other in np.unique(blocks.file_id))
        raise LogError(f"{name}: no block has file id {own_id:08x}; the file holds {known}")
    ordered, duplicates = _ordered(own)
    return Selection(
        blocks=ordered,
        file_id=own_id,
        sessions=_in_order(ordered.session),
        foreign=_foreign(blocks, own_id),
        duplicates=duplicates,
        displaced=int(np.count_nonzero(np.diff(ordered.position) <= 0)),
    )


def _ordered(own: Blocks) -> tuple[Blocks, int]:
    sequence = own.sequence.astype(np.int64)
    if len(own) < 2 or bool((np.diff(sequence) > 0).all()):
        return own, 0
    # A copy that stands where its number says is preferred to one that does not.
    away = own.position != sequence * BLOCK_BYTES
    order = np.lexsort((own.position, away, sequence))
    first: NDArray[np.bool_] = np.r_[True, np.diff(sequence[order]) != 0]
    return own.take(order[first]), int(len(first) - np.count_nonzero(first))


def _in_order(values: NDArray[np.uint32]) -> tuple[int, ...]:
    """Return each value once, in the order of first appearance."""
    first = np.flatnonzero(np.r_[True, values[1:] != values[:-1]][: len(values)])
    return tuple(dict.fromkeys(values[first].tolist()))


def _foreign(blocks: Blocks, own_id: int) -> tuple[Foreign, ...]:
    others = blocks.take(blocks.file_id != own_id)
    found = []
    for other in _in_order(others.file_id):
        its = others.take(others.file_id == other)
        sessions = tuple(np.unique(its.session).tolist())
        found.append(Foreign(int(other), sessions, len(its), int(its.position[0])))
    return tuple(found)
