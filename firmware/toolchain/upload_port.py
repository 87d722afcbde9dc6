"""Whether there is a board to upload to, asked before anything is built.

PlatformIO takes whatever serial port it finds, a PC's own RS-232 too, and avrdude then tries that
for a minute.
"""

from collections.abc import Iterable


def complaint(vendors: Iterable[int | None]) -> str:
    """Return what to do if no board is plugged in, in one line; empty if one may be.

    Parameters
    ----------
    vendors : iterable of int or None
        USB vendor of each serial port; None for a port that is not on USB.

    Returns
    -------
    str
        One line, or nothing.
    """
    if any(vendor is not None for vendor in vendors):
        return ""
    return (
        "no board found: no serial port on USB. Plug it in with a data cable, or name the port: "
        "pio run -t upload --upload-port PORT"
    )
