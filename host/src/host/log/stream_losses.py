"""Losses of a telemetry stream, from times and places of its frames.

The radio carries every n-th identification frame: what decimation skips is no loss. A loss is a
time between two of them that is longer than one and a half times the usual one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from host.log.ledger import Ledger, Loss
from host.physical.sampling import GAP_FACTOR
from host.physical.session import Session
from host.wire.framing import HEAD_BYTES, TAIL_BYTES
from host.wire.store import FrameStore
from host.wire.stream import Stream

_LISTED = 1000  # ranges of one cause listed one by one; the rest is one record


@dataclass(frozen=True, slots=True)
class _Hole:
    """A time without identification frames: envelopes before and behind it, frames, seconds."""

    before: int
    behind: int
    frames: int
    seconds: float
    t_s: float


def make_stream_ledger(stream: Stream, store: FrameStore, sessions: list[Session]) -> Ledger:
    """Compare times, places and repeats of the frames of a stream.

    Parameters
    ----------
    stream : Stream
    store : FrameStore
        Its frames.
    sessions : list of Session
        Runs of the Mega's clock, placed in time.

    Returns
    -------
    Ledger
    """
    holes = [hole for session in sessions for hole in _holes(session)]
    losses = list(_damaged(stream, holes))
    blamed = {loss.t_s for loss in losses}
    losses += [
        Loss("radio_lost", hole.behind, 0, 0, hole.frames, hole.seconds, 0, hole.t_s)
        for hole in holes
        if hole.t_s not in blamed
    ]
    losses += _unused(stream, store)
    damaged = bool(losses)
    losses += _envelopes(stream, "radio_repeated", stream.repeated)
    complete = "damaged" if damaged else "complete" if _ended(store) else "truncated"
    return Ledger(
        losses=tuple(_shortened(sorted(losses, key=lambda loss: loss.offset))),
        complete=complete,
        dropped_frames=sum(_not_sent(session) for session in sessions),
        received=True,
    )


def _holes(session: Session) -> Iterator[_Hole]:
    for part in session.store.fast_pieces(session.span):
        t_us = session.since_start_us(part)
        if len(t_us) < 3:
            continue
        step = np.diff(t_us)
        usual_us = float(np.median(step))
        place = session.store.blocks.position[part.block]
        for at in np.flatnonzero(step > GAP_FACTOR * usual_us).tolist():
            yield _Hole(
                int(place[at]),
                int(place[at + 1]),
                max(1, round(step[at] / usual_us) - 1),
                float(step[at] - usual_us) * 1e-6,
                float(session.seconds(t_us[at : at + 1])[0]),
            )


def _damaged(stream: Stream, holes: list[_Hole]) -> Iterator[Loss]:
    """Yield the bytes in no envelope; the first in a hole carries its frames."""
    before = np.array([hole.before for hole in holes], np.int64)
    taken: set[int] = set()
    for start, stop in stream.bad:
        loss = Loss("radio_damaged", start, stop - start, frames=0, seconds=0.0)
        at = int(np.searchsorted(before, start, side="right")) - 1
        if at >= 0 and start < holes[at].behind and at not in taken:
            taken.add(at)
            hole = holes[at]
            loss = replace(loss, frames=hole.frames, seconds=hole.seconds, t_s=hole.t_s)
        yield loss


def _unused(stream: Stream, store: FrameStore) -> Iterator[Loss]:
    """Yield frames that arrived whole and cannot be read."""
    yield from _envelopes(stream, "unread", stream.unfit)
    others = stream.blocks.take(stream.blocks.schema_hash != store.schema.hash)
    yield from _envelopes(stream, "other_schema", others.position)


def _envelopes(stream: Stream, cause: str, places: NDArray[np.int64]) -> Iterator[Loss]:
    octets = np.frombuffer(stream.data, np.uint8)
    if len(places):
        length = int(octets[places + 2].sum(dtype=np.int64))
        length += len(places) * (HEAD_BYTES + TAIL_BYTES)
        yield Loss(cause, int(places[0]), length, 0, 0, 0.0, ranges=len(places))


def _ended(store: FrameStore) -> bool:
    """Tell whether the last event that begins or ends a session ends it."""
    events = store["event"].data["code"]
    numbers = store.schema.enums["event"]
    edges = [numbers.get("session_start"), numbers["session_end"]]
    turns = events[np.isin(events, [edge for edge in edges if edge is not None])]
    return bool(len(turns)) and int(turns[-1]) == edges[1]


def _not_sent(session: Session) -> int:
    """Return how many frames the radio had no room for, by its counter, during the stream."""
    system, _ = session.slow("system")
    if not len(system) or "telemetry_dropped" not in (system.dtype.names or ()):
        return 0
    return int(system["telemetry_dropped"][-1]) - int(system["telemetry_dropped"][0])


def _shortened(losses: list[Loss]) -> Iterator[Loss]:
    """Yield the losses; beyond `_LISTED` of a cause the rest as one."""
    seen: dict[str, int] = {}
    rest: dict[str, Loss] = {}
    for loss in losses:
        seen[loss.cause] = seen.get(loss.cause, 0) + 1
        if seen[loss.cause] <= _LISTED:
            yield loss
        elif loss.cause in rest:
            rest[loss.cause] = rest[loss.cause].joined(loss)
        else:
            rest[loss.cause] = loss
    yield from rest.values()
