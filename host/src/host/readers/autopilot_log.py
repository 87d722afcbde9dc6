"""Contents of an autopilot's log in any format: messages by name, parameters, damage."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from host.arrays import Array
from host.errors import CheckError, NotALogError, UsageError

FORMATS = {
    "ulog": "PX4 ULog",
    "dataflash": "ArduPilot DataFlash",
    "dataflash-text": "ArduPilot DataFlash as text",
    "tlog": "MAVLink telemetry log",
}


class NotAutopilotLogError(NotALogError):
    """A file that begins like an autopilot's log and holds none."""


class SensorChoiceError(UsageError):
    """An instance that the log does not have."""


class OutputChoiceError(UsageError):
    """An output that the log does not have, or a surface that nobody has."""


class FlightChoiceError(UsageError):
    """A flight that the log does not have."""


class NothingToIdentifyError(CheckError):
    """A log from which nothing can be identified: no fixed wing, or it never flew."""


@dataclass(frozen=True, slots=True)
class Messages:
    """All messages of one name and instance.

    Attributes
    ----------
    t_s : (m,) array
        Time of each, s since the autopilot started, in order of the log.
    fields : mapping of str to (m,) array
        As the log has them: its names, its units.
    """

    t_s: Array
    fields: Mapping[str, NDArray[Any]]

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.t_s)


def last_time_s(messages: Mapping[str, Mapping[int, Messages]]) -> float:
    """Return the time of the last of all messages, s; 0 without any."""
    return max((float(m.t_s[-1]) for every in messages.values() for m in every.values()), default=0)


@dataclass(frozen=True, slots=True)
class AutopilotLog:
    """A log as it was read.

    Attributes
    ----------
    path : Path
    format : str
        A key of `FORMATS`.
    autopilot : str
        ``px4`` or ``ardupilot``: whose names and signs its outputs have.
    vehicle : str
        Kind of vehicle: ``plane``, ``vtol``, ``copter``, ``rover``, ..., empty if nothing says.
    firmware : str
        As the log says it.
    messages : mapping of str to mapping of int to Messages
        By name and instance.
    parameters : mapping of str to float
        Values by name, the one that stood longest where it changed; `Parameters` has all.
    damage : tuple of str
        A sentence for each loss, error or unproven range.
    lost : int
        Ranges of the file that were lost.
    texts : tuple of str
        As the autopilot said them.
    remarks : tuple of str
        Lines on clocks and senders: what was taken of what the log has twice.
    """

    path: Path
    format: str
    autopilot: str
    vehicle: str
    firmware: str
    messages: Mapping[str, Mapping[int, Messages]]
    parameters: Mapping[str, float]
    damage: tuple[str, ...] = ()
    lost: int = 0
    texts: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    def first(self, *names: str) -> Messages | None:
        """Return the messages of the first of these names that is there, lowest instance."""
        for name in names:
            found = self.messages.get(name)
            if found:
                return found[min(found)]
        return None
