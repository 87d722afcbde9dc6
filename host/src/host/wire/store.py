"""The frames of one log: read once when small, piece by piece when large."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.wire.blocks import Blocks, Progress
from host.wire.frames import FrameSet, Piece, frame_pieces, join
from host.wire.schema import Schema

FAST = "ident"
# Above this a log's identification frames are read again for each use instead of kept: a 2 GB log
# must become Parquet in less than 1.5 GB of memory.
KEEP_BLOCKS = (256 << 20) // 512
_SAMPLE_BLOCKS, _SAMPLE_PLACES = 64, 16


class FrameStore:
    """Frames of a log by name, with the block each came from.

    Parameters
    ----------
    path : Path
    blocks : Blocks
        The log's blocks in order.
    schema : Schema
    progress : callable, optional
        Called with blocks done and blocks in all.
    """

    def __init__(
        self, path: Path, blocks: Blocks, schema: Schema, progress: Progress | None = None
    ) -> None:
        self.path = path
        self.blocks = blocks
        self.schema = schema
        self.unread_bytes = 0
        self._progress = progress
        self._frames: dict[str, FrameSet] | None = None

    @property
    def in_memory(self) -> bool:
        """True if the identification frames are held in memory."""
        return len(self.blocks) <= KEEP_BLOCKS

    def __getitem__(self, name: str) -> FrameSet:
        """Return all frames of one kind."""
        frames = self._loaded()
        if name == FAST and FAST not in frames:
            return join(self.schema, FAST, list(self.fast_pieces()))
        return frames[name]

    def fast_pieces(self, span: tuple[int, int] | None = None) -> Iterator[FrameSet]:
        """Yield identification frames in order, of all blocks or of a span of them.

        One set where they are held in memory, else one per 2 MiB of log.
        """
        first, last = span or (0, len(self.blocks))
        frames = self._loaded()
        if FAST in frames:
            whole = frames[FAST]
            low, high = np.searchsorted(whole.block, (first, last))
            yield FrameSet(whole.data[low:high], whole.block[low:high])
            return
        for piece in self._pieces([FAST], (first, last)):
            self._report(piece)
            yield piece.frames[FAST]

    @cached_property
    def sample(self) -> NDArray[Any]:
        """Identification frames from evenly spread places, for decisions on a whole log."""
        last = max(0, len(self.blocks) - _SAMPLE_BLOCKS)
        starts = np.unique(np.linspace(0, last, _SAMPLE_PLACES).astype(int))
        parts = [
            part.data
            for start in starts.tolist()
            for part in self.fast_pieces((start, start + _SAMPLE_BLOCKS))
        ]
        empty = np.empty(0, self.schema.by_name[FAST].dtype)
        return np.concatenate(parts) if parts else empty

    def _loaded(self) -> dict[str, FrameSet]:
        if self._frames is None:
            slow: dict[str, list[FrameSet]] = {
                name: [] for name in self.schema.by_name if name != FAST
            }
            if self.in_memory and FAST in self.schema.by_name:
                size = self.schema.by_name[FAST].size_bytes
                most = int(self.blocks.used.sum(dtype=np.int64)) // size + 1
                fast = join(self.schema, FAST, self._sorted_out([*slow, FAST], slow), most)
                self._frames = {FAST: fast}
            else:
                for _ in self._sorted_out(list(slow), slow):
                    pass
                self._frames = {}
            for name in list(slow):  # one at a time, so that only one is held twice
                self._frames[name] = join(self.schema, name, slow.pop(name))
        return self._frames

    def _sorted_out(self, names: list[str], slow: dict[str, list[FrameSet]]) -> Iterator[FrameSet]:
        """Read the log once; collect slower frames in `slow`, yield identification frames."""
        for piece in self._pieces(names, None):
            self.unread_bytes += piece.unread_bytes
            self._report(piece)
            for name, frames in piece.frames.items():
                if name == FAST:
                    yield frames
                else:
                    slow[name].append(frames)

    def _pieces(self, names: Collection[str], span: tuple[int, int] | None) -> Iterator[Piece]:
        return frame_pieces(self.path, self.blocks, self.schema, names, span)

    def _report(self, piece: Piece) -> None:
        if self._progress is not None:
            self._progress(piece.done, len(self.blocks))


class Frames(Mapping[str, NDArray[Any]]):
    """Raw frames by name: structured arrays of all fields, in the order of the log."""

    def __init__(self, store: FrameStore) -> None:
        self._store = store

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return the frames called `name`; KeyError if the log's schema has none."""
        if name not in self._store.schema.by_name:
            raise KeyError(name)
        return self._store[name].data

    def __iter__(self) -> Iterator[str]:
        return iter(self._store.schema.by_name)

    def __len__(self) -> int:
        return len(self._store.schema.by_name)
