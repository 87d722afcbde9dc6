"""The input of a check: rows of the stream and slower frames, in order of time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from operator import itemgetter
from typing import Any

from host.live.live_sample import LIVE_UNITS, LiveUpdate
from host.live.slow_readings import slow_reading
from host.preflight.usb_status import status_readings
from host.wire.schema import Schema

_PLACE = {name: at for at, name in enumerate(LIVE_UNITS)}


@dataclass(slots=True)
class Sample:
    """One row: the columns of `LIVE_UNITS`, NaN where a channel has no valid value.

    Attributes
    ----------
    t_s : float
        On the aircraft's clock.
    values : tuple of float
    mega_drives : bool
        The relay's sense line.
    """

    t_s: float
    values: tuple[float, ...]
    mega_drives: bool

    def __getitem__(self, column: str) -> float:
        """Return a column."""
        return self.values[_PLACE[column]]


def columns_of(*names: str) -> Callable[[tuple[float, ...]], tuple[float, ...]]:
    """Return a function that picks some columns from the values of a row."""
    return itemgetter(*(_PLACE[name] for name in names))


@dataclass(slots=True)
class SlowReading:
    """A slower frame in units and words; a status line of the USB line as ``status``.

    Attributes
    ----------
    name : str
    t_s : float
    said : dict
        As `host.live.slow_readings.slow_reading` gives it.
    """

    name: str
    t_s: float
    said: dict[str, Any] = field(default_factory=dict)


def in_order(update: LiveUpdate, schema: Schema | None) -> Iterator[Sample | SlowReading]:
    """Yield the samples and slow readings of a portion of the stream, by time."""
    found: list[Sample | SlowReading] = []
    if len(update):
        columns = [update.rows[name].tolist() for name in LIVE_UNITS]
        drives = update.mega_drives.tolist()
        found += [
            Sample(row[0], row, drive)
            for row, drive in zip(zip(*columns, strict=True), drives, strict=True)
        ]
    if schema is not None:
        found += [
            SlowReading(frame.name, frame.t_s, slow_reading(schema, frame)) for frame in update.slow
        ]
    if update.status is not None:
        t_s = max((one.t_s for one in found), default=0.0)
        found += [
            SlowReading(name, t_s, said)
            for name, said in status_readings(update.status, t_s).items()
        ]
    return iter(sorted(found, key=lambda one: one.t_s))
