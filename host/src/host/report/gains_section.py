"""Gains of the answer for a named autopilot, as `host tune` prints and draws them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from host.control import AUTOPILOTS, release_in, tune
from host.errors import HostError, UsageError
from host.readers.autopilot_flight import is_autopilot_log, read_autopilot
from host.report.embedded_picture import picture
from host.report.html_text import escaped

if TYPE_CHECKING:
    from host.sysid.pipeline import Identification


def check_gains(autopilot: str, aircraft: str | None) -> None:
    """Refuse gains that cannot be had, before minutes of work.

    Raises
    ------
    UsageError
        An autopilot that is not known, or no aircraft file.
    """
    if autopilot not in AUTOPILOTS:
        raise UsageError(f"--tune {autopilot}, expected {', '.join(AUTOPILOTS)}")
    if not aircraft:
        raise UsageError("--tune needs --aircraft: its file has travel of surfaces and servo")


def gains_section(found: Identification, autopilot: str, aircraft: str, first_source: Path) -> str:
    """Return text and pictures, or the line that says why there are no gains."""
    try:
        log = read_autopilot(first_source).log if is_autopilot_log(first_source) else None
        own = log if log and log.autopilot == autopilot else None
        tuned = tune(
            found,
            aircraft=aircraft,
            autopilot=autopilot,
            parameters=dict(own.parameters) if own else None,
            release=release_in(own.firmware) if own else "",
        )
        drawn = "".join(
            picture(figure, f"{axis}: steps, margins, poles and loop of aircraft drawn")
            for axis, figure in tuned.plot().items()
        )
    except HostError as error:
        return f"<p>{escaped(str(error))}</p>"
    return f"<pre>{escaped(tuned.to_text())}</pre>{drawn}"
