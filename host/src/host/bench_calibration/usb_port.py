"""A SOURCE that is the logger itself: its port, or the word `usb`."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from host.bench_calibration.bench_plan import Subject
from host.bench_calibration.usb_channels import UsbChannels
from host.errors import UsageError
from host.link.serial import SerialLink, choose_port, serial_ports

USB = Path("usb")
_PORT = re.compile(r"(?i:COM\d{1,3}|\\\\\.\\COM\d{1,3})|/dev/.+")


def is_port(path: Path) -> bool:
    """Tell whether a source names a port and not a file."""
    return path == USB or (_PORT.fullmatch(str(path)) is not None and not path.is_file())


def open_port(path: Path, say: Callable[[str], None]) -> SerialLink:
    """Open the port that is named, or the one that looks like a Mega; raises HostError."""
    device = choose_port(serial_ports()).device if path == USB else str(path)
    say(f"{device}: opening a Mega's port resets it; on the ground only")
    return SerialLink(device)


def record_port(
    path: Path, subject: Subject, ask: Callable[[str], str], say: Callable[[str], None]
) -> Path:
    """Write what the logger sends into a new file until Enter; return the file.

    Raises
    ------
    UsageError
        If the file cannot be made; DeviceError if the port cannot be read.
    """
    target = next(
        one for k in range(1, 1000) if not (one := Path(f"bench-{subject.name}-{k}.radio")).exists()
    )
    with ExitStack() as stack:
        link = stack.enter_context(open_port(path, say))
        try:
            file = stack.enter_context(target.open("xb"))
        except OSError as error:
            raise UsageError(f"{target}: cannot be made: {error.strerror}") from None
        channels = stack.enter_context(UsbChannels(link, keep=file.write))
        channels.next_rows(1)
        for step in subject.steps_for():
            say(f"  {step}")
        ask(f"{subject.name}: it is being recorded to {target}; Enter when all is done ")
        channels.next_rows(1)  # or say that it went away
    return target
