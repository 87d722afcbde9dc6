"""The frames of one log: read once when small, piece by piece when large."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.blocks import Blocks, Progress
from host.frames import FrameSet, Piece, frame_pieces, join
from host.schema import Schema

FAST = "ident"
# Above this a log's identification frames are read again for each use instead of kept: a 2 GB log
# must become Parquet in less than 1.5 GB of memory.
KEEP_BLOCKS = (256 << 20) // 512


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
        self._slow_names = [frame.name for frame in schema.frames if frame.name != FAST]
        self._slow: dict[str, FrameSet] | None = None
        self._fast: list[FrameSet] | None = None
        self._joined: FrameSet | None = None

    def __getitem__(self, name: str) -> FrameSet:
        """Return all frames of one kind."""
        if name != FAST:
            return self._loaded()[name]
        if self._joined is None:
            self._joined = join(self.schema, FAST, list(self.fast_pieces()))
            if self._fast is not None:
                self._fast = [self._joined]
        return self._joined

    def fast_pieces(self, span: tuple[int, int] | None = None) -> Iterator[FrameSet]:
        """Yield identification frames in order, of all blocks or of a span of them."""
        first, last = span or (0, len(self.blocks))
        self._loaded()
        if self._fast is None:
            for piece in frame_pieces(self.path, self.blocks, self.schema, [FAST], (first, last)):
                self._report(piece)
                yield piece.frames[FAST]
            return
        for part in self._fast:
            if len(part.data) and part.block[0] < last and part.block[-1] >= first:
                low, high = np.searchsorted(part.block, (first, last))
                yield FrameSet(part.data[low:high], part.block[low:high])

    def sample(self, blocks: int = 64, places: int = 16) -> NDArray[Any]:
        """Return identification frames from evenly spread places, for decisions on a whole log."""
        starts = np.unique(np.linspace(0, max(0, len(self.blocks) - blocks), places).astype(int))
        parts = [
            part.data
            for start in starts.tolist()
            for part in self.fast_pieces((start, start + blocks))
        ]
        empty = np.empty(0, self.schema.by_name[FAST].dtype)
        return np.concatenate(parts) if parts else empty

    def _loaded(self) -> dict[str, FrameSet]:
        if self._slow is None:
            keep = len(self.blocks) <= KEEP_BLOCKS and FAST in self.schema.by_name
            names = [*self._slow_names, FAST] if keep else self._slow_names
            parts: dict[str, list[FrameSet]] = {name: [] for name in names}
            for piece in frame_pieces(self.path, self.blocks, self.schema, names):
                self.unread_bytes += piece.unread_bytes
                for name, frames in piece.frames.items():
                    parts[name].append(frames)
                self._report(piece)
            if keep:
                self._fast = parts.pop(FAST)
            self._slow = {name: join(self.schema, name, part) for name, part in parts.items()}
        return self._slow

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
