"""Where a page listens: a port of this computer, and the addresses it has in its networks."""

from __future__ import annotations

import contextlib
import socket
from typing import TYPE_CHECKING

from host.link.serial import DeviceError

if TYPE_CHECKING:
    pass

FIRST_PORT = 8050
_TRIES = 10


def listening_socket(wanted: int | None, *, lan: bool) -> socket.socket:
    """Return a listening socket: of the port asked for, else of the first free one from 8050."""
    host = "0.0.0.0" if lan else "127.0.0.1"
    ports = [wanted] if wanted is not None else range(FIRST_PORT, FIRST_PORT + _TRIES)
    for port in ports:
        listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        if hasattr(socket, "SO_EXCLUSIVEADDRUSE"):  # Windows: nobody else may take it too
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
        else:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((host, port))
        except OSError:
            listener.close()
            continue
        return listener
    raise DeviceError(
        f"{host}: port {ports[0]} is taken, by another `host live`?; name another with --port"
    )


def own_addresses() -> list[str]:
    """Return the addresses of this computer in its networks; asks nobody."""
    found = []
    with contextlib.suppress(OSError):
        found += socket.gethostbyname_ex(socket.gethostname())[2]
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))  # sends nothing: it only picks a way out
        found.append(str(probe.getsockname()[0]))
    return sorted({one for one in found if not one.startswith("127.")})
