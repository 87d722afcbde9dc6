"""Find losses of a log by comparing counters, block numbers and bytes (protocol/README.md)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from io import FileIO

import numpy as np
from numpy.typing import NDArray

from host.log.ending import Ending, judge_ending
from host.log.ledger import Ledger, Loss
from host.physical.session import Session
from host.wire.blocks import HEADER_BYTES, Blocks, Scan, read_at, resembles
from host.wire.extents import BLOCK_BYTES
from host.wire.selection import Selection
from host.wire.store import FrameStore

_OUTSIDE_DAMAGE = frozenset({"ring_full", "unexplained"})
# Holes listed one by one; a forged log may have millions, and a flight like that is no flight.
_LISTED_HOLES = 10_000


@dataclass(frozen=True, slots=True)
class _Holes:
    """Missing counts between identification frames in blocks `before` and `behind`; arrays (n,)."""

    before: NDArray[np.int64]
    behind: NDArray[np.int64]
    frames: NDArray[np.int64]
    seconds: NDArray[np.float64]
    t_s: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.before)


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
        Session asked for: what happened before it is not looked at, and what came behind it only
        if it is the last.

    Returns
    -------
    Ledger
    """
    blocks = store.blocks
    holes = _joined([hole for session in sessions for hole in _holes(session)])
    gaps = list(_gaps(scan, selection, store, whole=only is None))
    losses = _blamed(gaps, holes, blocks, sessions)
    if store.unread_bytes:
        losses.append(Loss("unread", int(blocks.position[0]), store.unread_bytes))
    ending = Ending()
    if only in (None, selection.sessions[-1]):
        ending = judge_ending(scan, selection, store, sessions[-1] if sessions else None)
    losses += ending.losses
    damaged = any(loss.cause not in _OUTSIDE_DAMAGE for loss in losses)
    return Ledger(
        losses=tuple(losses),
        complete="damaged"
        if damaged
        else "complete"
        if ending.unproven_bytes is None
        else "truncated",
        dropped_frames=sum(_dropped(blocks, session) for session in sessions),
        unproven_bytes=ending.unproven_bytes,
    )


def _holes(session: Session) -> Iterator[_Holes]:
    last_count = last_us = last_block = None
    for part in session.store.fast_pieces(session.span):
        if not len(part.data):
            continue
        t_us = session.since_start_us(part)
        count = part.data["count"].astype(np.int64)
        block = part.block.astype(np.int64)
        if last_count is not None:
            t_us, count = np.r_[last_us, t_us], np.r_[last_count, count]
            block = np.r_[last_block, block]
        step = np.diff(count) & 0xFFFF
        at = np.flatnonzero(step != 1)
        passed_us = t_us[at + 1] - t_us[at]
        turns = np.rint((passed_us / session.interval_us - step[at]) / 65536)
        frames = step[at] - 1 + 65536 * turns.astype(np.int64)
        lost = frames > 0
        at, passed_us = at[lost], passed_us[lost]
        yield _Holes(
            block[at],
            block[at + 1],
            frames[lost],
            np.maximum(0.0, passed_us - session.interval_us) * 1e-6,
            session.seconds(t_us[at]),
        )
        last_count, last_us, last_block = count[-1], t_us[-1], block[-1]


def _joined(parts: list[_Holes]) -> _Holes:
    none = np.empty(0, np.int64), np.empty(0)
    parts = parts or [_Holes(none[0], none[0], none[0], none[1], none[1])]
    return _Holes(
        np.concatenate([part.before for part in parts]),
        np.concatenate([part.behind for part in parts]),
        np.concatenate([part.frames for part in parts]),
        np.concatenate([part.seconds for part in parts]),
        np.concatenate([part.t_s for part in parts]),
    )


def _gaps(scan: Scan, selection: Selection, store: FrameStore, *, whole: bool) -> Iterator[_Gap]:
    blocks = store.blocks
    own = np.flatnonzero(blocks.schema_hash == store.schema.hash)
    if not len(own):
        return
    sequence = blocks.sequence.astype(np.int64)
    refused = _refused(store)
    with store.path.open("rb", buffering=0) as file:
        look = _Look(scan, blocks, file)
        first = int(own[0])
        if whole and sequence[first]:
            room = int(blocks.position[first]) - selection.base
            yield look.at(-1, selection.base, room, int(sequence[first]))
        for at in np.flatnonzero(np.diff(sequence[own]) > 1).tolist():
            before, behind = int(own[at]), int(own[at + 1])
            lost = int(sequence[behind] - sequence[before]) - 1
            start = int(blocks.position[before]) + BLOCK_BYTES
            gap = look.at(before, start, int(blocks.position[behind]) - start, lost)
            low, high = np.searchsorted(refused, (sequence[before] + 1, sequence[behind]))
            if high > low:
                gap = replace(gap, cause="card_refused")
            elif behind - before > 1:
                gap = replace(gap, cause="other_schema", length=lost * BLOCK_BYTES)
            yield gap


class _Look:
    """Finds the content of a file where blocks are missing."""

    def __init__(self, scan: Scan, blocks: Blocks, file: FileIO) -> None:
        self._positions = scan.blocks.position
        self._bad = np.array(scan.bad, np.int64).reshape(-1, 2)
        self._blocks = blocks
        self._file = file

    def at(self, before: int, start: int, room: int, lost: int) -> _Gap:
        """Judge the `room` bytes from `start` on, where `lost` blocks behind `before` belong."""
        if room <= 0 or room < lost * BLOCK_BYTES // 2:
            return _Gap(before, start, max(0, room), lost, "missing")
        low, high = np.searchsorted(self._positions, (start, start + room))
        next_bad = int(np.searchsorted(self._bad[:, 1], start, side="right"))
        if high > low:
            cause = "not_written"
        elif next_bad == len(self._bad) or self._bad[next_bad, 0] >= start + room:
            cause = "zeroed"
        elif resembles(read_at(self._file, start, HEADER_BYTES), self._blocks, max(before, 0)):
            cause = "crc"
        else:
            cause = "overwritten"
        return _Gap(before, start, room, lost, cause)


def _refused(store: FrameStore) -> NDArray[np.int64]:
    """Return the numbers of the blocks that the card refused, rising."""
    events = store["event"].data
    code = store.schema.number("event", "block_skipped")
    return np.sort(events["arg"][events["code"] == code].astype(np.int64))


def _blamed(
    gaps: list[_Gap],
    holes: _Holes,
    blocks: Blocks,
    sessions: list[Session],
) -> list[Loss]:
    """Join missing blocks and missing counts: each hole is blamed on what lies inside it."""
    taken: NDArray[np.bool_] = np.zeros(len(holes), bool)
    starts = np.array([session.span[0] for session in sessions], np.int64)
    losses: list[Loss] = []
    for gap in gaps:
        at = int(np.searchsorted(holes.before, gap.before, side="right")) - 1
        loss = Loss(gap.cause, gap.offset, gap.length, gap.blocks)
        if at >= 0 and holes.behind[at] > gap.before >= 0:
            first = not taken[at]  # several gaps in one hole: the first carries its frames
            taken[at] = True
            loss = replace(
                loss,
                frames=int(holes.frames[at]) if first else 0,
                seconds=float(holes.seconds[at]) if first else 0.0,
                t_s=float(holes.t_s[at]),
            )
        elif gap.before >= 0:
            session = sessions[int(np.searchsorted(starts, gap.before, side="right")) - 1]
            low, high = session.ident_span
            if low <= gap.before < high:  # identification frames on both sides, none missing
                loss = replace(loss, frames=0, seconds=0.0)
        losses.append(loss)
    budget = [_dropped(blocks, session) for session in sessions]
    losses += _counted(holes, np.flatnonzero(~taken), starts, budget, blocks)
    losses += _dropped_elsewhere(budget, sessions, blocks, losses)
    return sorted(losses, key=lambda loss: loss.offset)


def _counted(
    holes: _Holes,
    which: NDArray[np.intp],
    starts: NDArray[np.int64],
    budget: list[int],
    blocks: Blocks,
) -> Iterator[Loss]:
    """Yield holes where no block is missing; `budget` says what the logger dropped, and shrinks."""
    owners = np.searchsorted(starts, holes.before[which], side="right") - 1
    rest: dict[str, Loss] = {}
    for number, (at, owner) in enumerate(zip(which.tolist(), owners.tolist(), strict=True)):
        frames = int(holes.frames[at])
        cause = "ring_full" if budget[owner] >= frames else "unexplained"
        if cause == "ring_full":
            budget[owner] -= frames
        offset = int(blocks.position[holes.behind[at]])
        seconds, t_s = float(holes.seconds[at]), float(holes.t_s[at])
        loss = Loss(cause, offset, 0, 0, frames, seconds, 0, t_s)
        if number < _LISTED_HOLES:
            yield loss
        elif cause not in rest:
            rest[cause] = loss
        else:
            rest[cause] = rest[cause].joined(loss)
    yield from rest.values()


def _dropped_elsewhere(
    budget: list[int], sessions: list[Session], blocks: Blocks, losses: list[Loss]
) -> Iterator[Loss]:
    """Report dropped frames of other kinds, beyond those that a lost block hides."""
    hidden = sum(loss.frames or 0 for loss in losses if loss.blocks)
    for session, count in zip(sessions, budget, strict=True):
        count -= min(count, hidden)
        if count > 0:
            first, last = session.span
            first += int(np.argmax(blocks.dropped[first:last] > 0))
            yield Loss("ring_full", int(blocks.position[first]), 0, 0, 0, 0.0, count)


def _dropped(blocks: Blocks, session: Session) -> int:
    first, last = session.span
    return int(blocks.dropped[first:last].max()) if last > first else 0
