"""Where datagrams go: ``udpout:HOST:PORT``."""

from __future__ import annotations

import socket

from host.errors import UsageError


def udp_place(option: str, text: str) -> tuple[str, int]:
    """Return host and port of ``udpout:HOST:PORT``.

    Parameters
    ----------
    option : str
        Whose value it is, such as ``--mavlink``: for messages.
    text : str

    Raises
    ------
    UsageError
        If it is something else.
    """
    kind, _, rest = text.partition(":")
    host, _, port = rest.rpartition(":")
    if kind != "udpout" or not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise UsageError(f"{option} {text}: expected udpout:HOST:PORT, such as"
                         " udpout:127.0.0.1:14550")  # fmt: skip
    return host, int(port)


def udp_address(option: str, text: str) -> tuple[str, int]:
    """Return the same with the host as a number.

    Raises
    ------
    UsageError
        If it is no such place, or nobody knows the host.
    """
    host, port = udp_place(option, text)
    try:
        return socket.gethostbyname(host), port
    except OSError:
        raise UsageError(f"{option} {text}: {host} is not known") from None
