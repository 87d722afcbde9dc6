"""MAVLink telemetry log: each frame behind the time it came in, packed by pymavlink."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any


class TlogWriter:
    """Collects messages with their times and writes them in order.

    Parameters
    ----------
    system, component : int
        Who sends them.
    """

    def __init__(self, system: int = 1, component: int = 1) -> None:
        from pymavlink.dialects.v20 import ardupilotmega

        self.dialect: Any = ardupilotmega
        self._link = ardupilotmega.MAVLink(None, srcSystem=system, srcComponent=component)
        self._frames: list[tuple[float, Any]] = []

    def add(self, times_s: Iterable[float], messages: Iterable[Any]) -> None:
        """Add messages of the dialect, each at its time (s since the epoch)."""
        self._frames += zip(times_s, messages, strict=True)

    def write(self, path: Path) -> None:
        """Write all of them.

        Raises
        ------
        OSError
            The file cannot be written.
        """
        parts = []
        for number, (at_s, message) in enumerate(sorted(self._frames, key=lambda f: f[0])):
            self._link.seq = number % 256
            parts += [struct.pack(">Q", round(at_s * 1e6)), message.pack(self._link)]
        path.write_bytes(b"".join(parts))
