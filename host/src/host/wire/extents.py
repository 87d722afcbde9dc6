"""Which bytes of a file hold data: holes of a sparse file are skipped, not read."""

from __future__ import annotations

import os
from io import FileIO

BLOCK_BYTES = 512


def data_extents(file: FileIO, size_bytes: int) -> list[tuple[int, int]]:
    """Return the ranges of a file that may hold data, widened to whole blocks.

    Parameters
    ----------
    file : FileIO
    size_bytes : int
        Length of the file.

    Returns
    -------
    list of (int, int)
        Start (a multiple of 512) and end of each range in bytes, ascending, disjoint. The whole
        file where the system cannot tell holes.
    """
    seek_data = getattr(os, "SEEK_DATA", None)
    seek_hole = getattr(os, "SEEK_HOLE", None)
    if seek_data is None or seek_hole is None or size_bytes == 0:
        return [(0, size_bytes)] if size_bytes else []
    extents: list[tuple[int, int]] = []
    position = 0
    descriptor = file.fileno()
    while position < size_bytes:
        try:
            start = os.lseek(descriptor, position, seek_data)
            end = os.lseek(descriptor, start, seek_hole)
        except OSError as error:
            if error.errno == 6:  # ENXIO: only a hole is left
                break
            return [(0, size_bytes)]  # this file system cannot tell
        start -= start % BLOCK_BYTES
        end = min(size_bytes, end + -end % BLOCK_BYTES)
        if extents and start <= extents[-1][1]:
            extents[-1] = (extents[-1][0], end)
        else:
            extents.append((start, end))
        position = end
    return extents
