"""The release of an autopilot: which ones were read, and what theirs call a parameter."""

from __future__ import annotations

import re

from host.control.autopilots import parameter_table
from host.control.control_error import ControlError

Release = tuple[int, int]


def release_of(text: str) -> Release:
    """Return major and minor number of a release as somebody types it.

    Raises
    ------
    ControlError
        It does not begin with a number.
    """
    found = re.match(r"[vV]?(\d+)(?:\.(\d+))?(?![\w])", text)
    if found is None:
        raise ControlError(f"release '{text}', expected a number such as 4.5")
    return int(found[1]), int(found[2] or 0)


def release_in(firmware: str) -> str:
    """Return the release that a log's line names: ``4.5`` of ``ArduPlane V4.5.7 (0a1b2c3d)``.

    Empty where it names none; a number in the name of somebody's branch is no release.
    """
    found = re.search(r"(?:(?<![\w.])[vV]|release/)(\d+\.\d+)", firmware)
    return found[1] if found else ""


def release_note(autopilot: str, release: str) -> str:
    """Return a sentence where a release is newer than what was read, else nothing.

    Raises
    ------
    ControlError
        It is older: another law flies, or it was not read; or the autopilot has no releases.
    """
    named = release_of(release)
    if not (read := parameter_table.releases(autopilot)):
        raise ControlError(f"release {release}: {autopilot} has none, leave it out")
    oldest, newest = map(release_of, read)
    if named < oldest:
        raise ControlError(
            f"{autopilot} {release}: before {read[0]} another law flies, or nobody read it here;"
            " update it, and save its parameters again"
        )
    if named <= newest:
        return ""
    return f"{autopilot} {release} is newer than {read[1]}, whose law and names these are"


def called(autopilot: str, name: str, release: str) -> str:
    """Return what a release calls a parameter; today's name without a release."""
    older, since = parameter_table.renamed(autopilot).get(name, (name, ""))
    return older if release and since and release_of(release) < release_of(since) else name
