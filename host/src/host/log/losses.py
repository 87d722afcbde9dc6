"""Finds what a log lost by comparing counters, block numbers and bytes (protocol/README.md)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from host.log.ledger import Ledger, Loss
from host.physical.session import Session
from host.wire.blocks import MAGIC, Blocks, Scan, read_at
from host.wire.extents import BLOCK_BYTES
from host.wire.selection import Selection
from host.wire.store import FrameStore

_OUTSIDE_DAMAGE = frozenset({"ring_full", "unexplained", "truncated"})
# A file that goes on for no more than this behind its last block, without a session end, is taken
# for a closed file whose end was destroyed: 8 blocks, 0.6 s of a 64 MiB preallocation.
_END_DESTROYED_BYTES = 8 * BLOCK_BYTES
_LOOK_BYTES = 64 << 10


@dataclass(slots=True)
class _Hole:
    """Missing counts between two identification frames in blocks `before` and `behind`."""

    before: int
    behind: int
    frames: int
    seconds: float
    t_s: float


@dataclass(frozen=True, slots=True)
class _Gap:
    """Missing blocks behind block `before` of the log."""

    before: int
    offset: int
    length: int
    blocks: int
    cause: str


def make_ledger(
    scan: Scan,
    selection: Selection,
    store: FrameStore,
    sessions: list[Session],
    *,
    only: int | None = None,
) -> Ledger:
    """Compare counters, block numbers and bytes of a log.

    Parameters
    ----------
    scan : Scan
        The whole file.
    selection : Selection
        The log in it.
    store : FrameStore
        Its frames, of one session if `only` is given.
    sessions : list of Session
    only : int, optional
        Session asked for: what happened before and behind it is not looked at.

    Returns
    -------
    Ledger
    """
    blocks = store.blocks
    holes = [hole for session in sessions for hole in _holes(session)]
    gaps = list(_gaps(scan, blocks, store, whole=only is None))
    losses = _blamed(gaps, holes, blocks, sessions, store)
    ended = _ended(store)
    if store.unread_bytes:
        losses.append(Loss("unread", int(blocks.position[0]), store.unread_bytes))
    if only is None:
        last = sessions[-1] if sessions else None
        losses += _end(scan, selection, store.path, ended=ended, session=last)
    damaged = any(loss.cause not in _OUTSIDE_DAMAGE for loss in losses)
    truncated = any(loss.cause == "truncated" for loss in losses)
    return Ledger(
        losses=tuple(losses),
        complete="damaged" if damaged else "truncated" if truncated else "complete",
        dropped_frames=sum(_dropped(blocks, session) for session in sessions),
    )


def _holes(session: Session) -> Iterator[_Hole]:
    last_count = last_us = last_block = None
    for part in session.store.fast_pieces(session.span):
        if not len(part.data):
            continue
        t_us = session.since_start_us(part)
        count = part.data["count"].astype(np.int64)
        block = part.block
        if last_count is not None:
            t_us, count = np.r_[last_us, t_us], np.r_[last_count, count]
            block = np.r_[last_block, block]
        step = np.diff(count) & 0xFFFF
        for at in np.flatnonzero(step != 1).tolist():
            passed_us = float(t_us[at + 1] - t_us[at])
            expected = passed_us / session.interval_us
            turns = round((expected - int(step[at])) / 65536)
            frames = int(step[at]) - 1 + 65536 * turns
            if frames > 0:
                yield _Hole(
                    int(block[at]),
                    int(block[at + 1]),
                    frames,
                    max(0.0, passed_us - session.interval_us) * 1e-6,
                    float(session.seconds(t_us[at : at + 1])[0]),
                )
        last_count, last_us, last_block = count[-1], t_us[-1], block[-1]


def _gaps(scan: Scan, blocks: Blocks, store: FrameStore, *, whole: bool) -> Iterator[_Gap]:
    own = np.flatnonzero(blocks.schema_hash == store.schema.hash)
    if not len(own):
        return
    sequence = blocks.sequence.astype(np.int64)
    refused = _refused(store)
    with store.path.open("rb", buffering=0) as file:

        def content(offset: int, length: int) -> bytes:
            return bytes(read_at(file, offset, min(length, _LOOK_BYTES)))

        first = int(own[0])
        if whole and sequence[first]:
            lost = int(sequence[first])
            room = int(blocks.position[first])
            yield _classified(scan, blocks, content, -1, 0, room, lost, store)
        for at in np.flatnonzero(np.diff(sequence[own]) > 1).tolist():
            before, behind = int(own[at]), int(own[at + 1])
            lost = int(sequence[behind] - sequence[before]) - 1
            start = int(blocks.position[before]) + BLOCK_BYTES
            room = int(blocks.position[behind]) - start
            gap = _classified(scan, blocks, content, before, start, room, lost, store)
            if refused & set(range(int(sequence[before]) + 1, int(sequence[behind]))):
                gap = replace(gap, cause="card_refused")
            elif behind - before > 1:
                gap = replace(gap, cause="other_schema", length=lost * BLOCK_BYTES)
            yield gap


def _classified(
    scan: Scan,
    blocks: Blocks,
    content: Callable[[int, int], bytes],
    before: int,
    start: int,
    room: int,
    lost: int,
    store: FrameStore,
) -> _Gap:
    if room <= 0 or room < lost * BLOCK_BYTES // 2:
        return _Gap(before, start, max(0, room), lost, "missing")
    looked = content(start, room)
    positions = scan.blocks.position
    low, high = np.searchsorted(positions, (start, start + room))
    if high > low:
        cause = "not_written"
    elif not looked.strip(b"\0"):
        cause = "zeroed"
    elif _resembles(looked, blocks, max(before, 0)):
        cause = "crc"
    else:
        cause = "overwritten"
    return _Gap(before, start, room, lost, cause)


def _resembles(looked: bytes, blocks: Blocks, near: int) -> bool:
    """Tell whether bytes begin like a block of this log: at least two words of the header fit."""
    words = [looked[at : at + 4] for at in (0, 4, 8, 16)]
    expected = [
        MAGIC,
        *(
            int(value[near]).to_bytes(4, "little")
            for value in (blocks.file_id, blocks.session, blocks.schema_hash)
        ),
    ]
    return sum(one == other for one, other in zip(words, expected, strict=True)) >= 2


def _refused(store: FrameStore) -> set[int]:
    if "event" not in store.schema.by_name:
        return set()
    events = store["event"].data
    code = store.schema.enums.get("event", {}).get("block_skipped", -1)
    return set(events["arg"][events["code"] == code].tolist())


def _blamed(
    gaps: list[_Gap],
    holes: list[_Hole],
    blocks: Blocks,
    sessions: list[Session],
    store: FrameStore,
) -> list[Loss]:
    """Join missing blocks and missing counts: each hole is blamed on what lies inside it."""
    starts = np.array([hole.before for hole in holes], np.int64)
    taken: NDArray[np.bool_] = np.zeros(len(holes), bool)
    losses: list[Loss] = []
    for gap in gaps:
        at = int(np.searchsorted(starts, gap.before, side="right")) - 1
        hole = holes[at] if at >= 0 and holes[at].behind > gap.before >= 0 else None
        loss = Loss(gap.cause, gap.offset, gap.length, gap.blocks)
        if hole is not None:
            first = not taken[at]  # several gaps in one hole: the first carries its frames
            taken[at] = True
            loss = replace(
                loss,
                frames=hole.frames if first else 0,
                seconds=hole.seconds if first else 0.0,
                t_s=hole.t_s,
            )
        elif _inside(gap, sessions, store):
            loss = replace(loss, frames=0, seconds=0.0)
        losses.append(loss)
    budget = {session.span: _dropped(blocks, session) for session in sessions}
    for at, hole in enumerate(holes):
        if taken[at]:
            continue
        span = next(span for span in budget if span[0] <= hole.before < span[1])
        cause = "ring_full" if budget[span] >= hole.frames else "unexplained"
        if cause == "ring_full":
            budget[span] -= hole.frames
        offset = int(blocks.position[hole.behind])
        losses.append(Loss(cause, offset, 0, 0, hole.frames, hole.seconds, 0, hole.t_s))
    losses += _dropped_elsewhere(budget, blocks, losses)
    return sorted(losses, key=lambda loss: loss.offset)


def _dropped_elsewhere(
    budget: dict[tuple[int, int], int], blocks: Blocks, losses: list[Loss]
) -> Iterator[Loss]:
    """Report dropped frames of other kinds, beyond those that a lost block hides."""
    hidden = sum(loss.frames or 0 for loss in losses if loss.blocks)
    for span, count in budget.items():
        count -= min(count, hidden)
        if count > 0:
            first = span[0] + int(np.argmax(blocks.dropped[span[0] : span[1]] > 0))
            yield Loss("ring_full", int(blocks.position[first]), 0, 0, 0, 0.0, count)


def _inside(gap: _Gap, sessions: list[Session], store: FrameStore) -> bool:
    """Tell whether identification frames of one session stand on both sides of a gap."""
    for session in sessions:
        first, last = session.span
        if first <= gap.before and gap.before + 1 < last:
            blocks = [
                int(edge)
                for part in store.fast_pieces(session.span)
                if len(part.block)
                for edge in (part.block[0], part.block[-1])
            ]
            return bool(blocks) and min(blocks) <= gap.before < max(blocks)
    return False


def _dropped(blocks: Blocks, session: Session) -> int:
    first, last = session.span
    return int(blocks.dropped[first:last].max()) if last > first else 0


def _ended(store: FrameStore) -> bool:
    """Tell whether the last block with frames holds an event `session_end`."""
    if "event" not in store.schema.by_name or not len(store.blocks):
        return False
    events = store["event"]
    code = store.schema.enums.get("event", {}).get("session_end", -1)
    ends = events.block[events.data["code"] == code]
    return bool(len(ends)) and int(ends[-1]) == len(store.blocks) - 1


def _end(
    scan: Scan, selection: Selection, path: Path, *, ended: bool, session: Session | None
) -> Iterator[Loss]:
    """Judge what stands behind the last block of a log."""
    if ended:
        return
    blocks = selection.blocks
    end = int(blocks.position.max()) + BLOCK_BYTES
    room = scan.size_bytes - end
    t_s = None
    if session is not None and session.rows:
        t_s = float(session.seconds(np.array([session.end_us - session.start_us], float))[0])
    behind = scan.blocks.position >= end
    foreign = int(scan.blocks.position[behind].min()) - end if behind.any() else room
    bad = next(((a, b) for a, b in scan.bad if b > end), None)
    if room < BLOCK_BYTES:
        yield Loss("truncated", end, room, t_s=t_s)
    elif foreign % BLOCK_BYTES and behind.any():
        yield Loss("truncated", end, foreign, t_s=t_s)  # cut, then glued to another log
    elif room <= _END_DESTROYED_BYTES and not behind.any():
        cause = "zeroed" if bad is None else "overwritten"
        yield Loss(cause, end, room, -(-room // BLOCK_BYTES), t_s=t_s)
    elif bad is not None and bad[0] <= end:
        # The battery was pulled while a block was written, or blocks were damaged later.
        lost = _damaged_end(scan, selection.blocks, path, end)
        if lost:
            yield Loss("crc", end, lost * BLOCK_BYTES, lost, t_s=t_s)


def _damaged_end(scan: Scan, blocks: Blocks, path: Path, start: int) -> int:
    """Count the slots from `start` on that look like blocks of this log and are not valid."""
    last = len(blocks) - 1
    lost = 0
    # Valid blocks of an older flight have the magic and the schema of this one.
    behind = scan.blocks.position[scan.blocks.position >= start]
    end = int(behind.min()) if len(behind) else scan.size_bytes
    with path.open("rb", buffering=0) as file:
        while start + (lost + 1) * BLOCK_BYTES <= end:
            looked = bytes(read_at(file, start + lost * BLOCK_BYTES, 28))
            if not _resembles(looked, blocks, last):
                break
            lost += 1
    return lost
