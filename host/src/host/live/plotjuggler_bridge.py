"""The rows as JSON datagrams: for PlotJuggler's UDP server, protocol JSON."""

from __future__ import annotations

import contextlib
import json
import math
import socket

from host.live.live_sample import LiveUpdate
from host.live.live_session import LiveSession
from host.live.udp_place import udp_address

_DIGITS = 9  # of a number: more than any channel has, and t_s to a microsecond after 15 minutes


class PlotJugglerBridge:
    """Sends each row as one JSON object, ``timestamp`` in s and the page's channels by name.

    Nothing is ever read. A channel without a valid value is left out of its row.

    Parameters
    ----------
    session : LiveSession
        Subscribed to; the bridge works in its thread.
    place : str
        ``udpout:HOST:PORT``.

    Raises
    ------
    UsageError
        If the place is none.
    """

    def __init__(self, session: LiveSession, place: str) -> None:
        self._address = udp_address("--plotjuggler", place)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        session.stream.subscribe(self._take)

    def close(self) -> None:
        """Say no more."""
        self._socket.close()

    def _take(self, update: LiveUpdate) -> None:
        for k in range(len(update)):
            row = {name: float(column[k]) for name, column in update.rows.items()}
            numbers = {n: float(f"{v:.{_DIGITS}g}") for n, v in row.items() if math.isfinite(v)}
            said = {"timestamp": numbers.pop("t_s", 0.0), **numbers}
            with contextlib.suppress(OSError):  # nobody listens, or not now: the flight goes on
                self._socket.sendto(json.dumps(said).encode(), self._address)
