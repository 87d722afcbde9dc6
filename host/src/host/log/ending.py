"""The end of a log: whether the session ended, the file was closed, and the end is proven.

Rules: protocol/README.md, "End".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from host.log.ledger import Loss
from host.physical.session import Session
from host.wire.blocks import HEADER_BYTES, Scan, read_at, resembles
from host.wire.extents import BLOCK_BYTES
from host.wire.selection import Selection
from host.wire.store import FrameStore

USUAL_PREALLOCATED_BYTES = 64 << 20  # of logs without a frame `file`


@dataclass(frozen=True, slots=True)
class Ending:
    """Losses and unproven bytes behind the last block.

    Parameters
    ----------
    losses : tuple of Loss
    unproven_bytes : int or None
        Bytes behind the last block of a file that was never closed: nothing tells whether blocks of
        this flight once stood there. None where the session's end is in the log.
    """

    losses: tuple[Loss, ...] = ()
    unproven_bytes: int | None = None


def judge_ending(
    scan: Scan, selection: Selection, store: FrameStore, session: Session | None
) -> Ending:
    """Judge the bytes behind the last block of a log.

    Parameters
    ----------
    scan : Scan
    selection : Selection
    store : FrameStore
        With the log's last block.
    session : Session or None
        The last one.
    """
    if _ended(store):
        return Ending()
    end = int(selection.blocks.position.max()) + BLOCK_BYTES
    full = selection.base + preallocated_bytes(store)
    in_larger_file = selection.base > 0 and full < scan.size_bytes
    size = full if in_larger_file else scan.size_bytes
    t_s = None
    if session is not None and session.rows:
        t_s = float(session.seconds(np.array([session.end_us - session.start_us], float))[0])
    losses = list(_torn(scan, selection, store, end, t_s))
    if size == full and size >= end:
        return Ending(tuple(losses), size - end)
    return Ending(tuple(losses or _cut(scan, end, t_s)))


def preallocated_bytes(store: FrameStore) -> int:
    """Return the size of the log's file before it is closed."""
    if "file" in store.schema.by_name:
        said = store["file"].data["preallocated"]
        if len(said) and said[-1]:
            return int(said[-1])
    return USUAL_PREALLOCATED_BYTES


def _ended(store: FrameStore) -> bool:
    """Tell whether the last block holds an event `session_end`."""
    events = store["event"]
    ends = events.block[events.data["code"] == store.schema.number("event", "session_end")]
    return bool(len(ends)) and int(ends[-1]) == len(store.blocks) - 1


def _torn(
    scan: Scan, selection: Selection, store: FrameStore, end: int, t_s: float | None
) -> Iterator[Loss]:
    """Yield the blocks at the end that look like this log's and are not valid.

    The battery was pulled while a block was written, or blocks were damaged later.
    """
    last = len(selection.blocks) - 1
    lost = 0
    # Valid blocks of an older flight have the magic and the schema of this one.
    behind = scan.blocks.position[scan.blocks.position >= end]
    stop = int(behind.min()) if len(behind) else scan.size_bytes
    with store.path.open("rb", buffering=0) as file:
        while end + (lost + 1) * BLOCK_BYTES <= stop:
            looked = read_at(file, end + lost * BLOCK_BYTES, HEADER_BYTES)
            if not resembles(looked, selection.blocks, last):
                break
            lost += 1
    if lost:
        yield Loss("crc", end, lost * BLOCK_BYTES, lost, t_s=t_s)


def _cut(scan: Scan, end: int, t_s: float | None) -> Iterator[Loss]:
    """Yield the losses of a file that is neither closed nor of its full size."""
    behind = scan.blocks.position[scan.blocks.position >= end]
    room = (int(behind.min()) if len(behind) else scan.size_bytes) - end
    if room < BLOCK_BYTES:
        yield Loss("truncated", end, room, t_s=t_s)
    else:
        bad = any(first < end + room and last > end for first, last in scan.bad)
        cause = "overwritten" if bad else "zeroed"
        yield Loss(cause, end, room, -(-room // BLOCK_BYTES), t_s=t_s)
