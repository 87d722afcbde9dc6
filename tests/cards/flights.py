"""Flight files in every state in which the recorder, a PC or a pulled battery leaves them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import lru_cache

import numpy as np

from tests.cards.sparse import BLOCK, END, SparseCard
from tests.protocol.log_writer import KIND_FRAMES, LogWriter, block

FILE_BLOCKS = 131_072  # 64 MiB, as the recorder prepares


class State(Enum):
    """How a file was left."""

    CLOSED = "closed"  # cut to its used length
    OPEN = "open"  # its full size, the flight never ended
    BLANK = "blank"  # prepared, block 0 only
    CUT_CHAIN_FIRST = "cut in closing, chain freed first"  # images before: size beyond the chain
    CUT_SIZE_FIRST = "cut in closing, size written first"  # chain beyond the size


@dataclass(frozen=True, slots=True)
class FlightFile:
    """A flight on a card.

    Attributes
    ----------
    number, state : int, State
        Number of the name, and how it was left.
    first, clusters : int
        Its run: first cluster, and as many as its chain holds.
    used : int
        Blocks recorded.
    entry : int
        Byte of its directory entry in the image.
    """

    number: int
    state: State
    first: int
    clusters: int
    used: int
    entry: int


@lru_cache(maxsize=32)
def flight_blocks(session: int, blocks: int, *, ended: bool) -> bytes:
    """Write a flight of so many blocks; block 0 belongs to the schema, as in a prepared file."""
    writer = LogWriter(session=session, card_block=1000 * session, keep_truth=False)
    writer.begin(t_us=1_000_000)
    writer.put("event", t_us=1_000_000 + 10_000 * writer.sequence, code=24)
    writer.flush()
    # An event in each of the others: as put() and flush() would write them, in a tenth of the time.
    sequences = range(writer.sequence, blocks - ended)
    rows = np.zeros(len(sequences), writer.layouts["event"])
    rows["id"], rows["code"] = writer.ids["event"], 24
    rows["t_us"] = 1_000_000 + 10_000 * np.array(sequences)
    for sequence, row in zip(sequences, rows, strict=True):
        content = block(
            row.tobytes(), file_id=writer.file_id, session=session, sequence=sequence,
            schema_hash=writer.schema_hash, dropped=0, kind=KIND_FRAMES,
        )  # fmt: skip
        writer.tail(content)
    writer.sequence += len(sequences)
    if ended:
        writer.end(t_us=1_000_000 + 10_000 * blocks)
    return writer.data()[: blocks * BLOCK]


def add_flight(
    card: SparseCard,
    number: int,
    first: int,
    state: State,
    *,
    used: int = 40,
    file_blocks: int = FILE_BLOCKS,
    freed_clusters: int | None = None,
) -> FlightFile:
    """Put a flight on a card.

    Parameters
    ----------
    card : SparseCard
        The card; `first` and what follows is free.
    number, first, state : int, int, State
        Number of the name, first cluster, how it was left.
    used : int
        Blocks recorded.
    file_blocks : int
        Room it was prepared with.
    freed_clusters : int
        Cut in closing: clusters whose entries the power let be freed, from the flight's end on.
    """
    room = -(-file_blocks // card.cluster_blocks)
    needed = -(-used // card.cluster_blocks)
    recorded = 1 if state is State.BLANK else used
    ended = state not in (State.OPEN, State.BLANK)
    blocks = flight_blocks(number, used, ended=ended)
    card.write(card.lba(first), blocks[: recorded * BLOCK])
    short = state in (State.CLOSED, State.CUT_SIZE_FIRST)
    entry = card.add_entry(f"FLT{number:05d}.BIN", first, (used if short else file_blocks) * BLOCK)
    clusters = needed if state is State.CLOSED else room
    card.chain(first, clusters)
    if state in (State.CUT_CHAIN_FIRST, State.CUT_SIZE_FIRST) and freed_clusters != 0:
        freed = room - needed if freed_clusters is None else min(freed_clusters, room - needed)
        card.set_fat(first + needed - 1, [END, *(0 for _ in range(freed))])
        clusters = needed
    return FlightFile(number, state, first, clusters, used, entry)
