"""How flights are read: the options of each, of arguments that count for all or for one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from host.sysid.checks.data_finding import accepted_checks
from host.sysid.maneuvers.maneuver_selection import TimeSpan
from host.sysid.pipeline.arguments import chosen_stretches, listed, numbers_of, of_each_flight

OfEach = str | Path | Sequence[str | Path | None] | None  # one for all flights, or one of each


@dataclass(frozen=True, slots=True)
class ReadingOptions:
    """Options of reading a flight.

    Attributes
    ----------
    calibration : Path, optional
        Counts to SI of a log.
    mapping : Path, optional
        Foreign names, units and signs of a table.
    maneuvers : tuple of int
        Only these of each flight, counted from 1; all without.
    stretches : tuple of (from, to)
        Spans of time, s, instead of the maneuvers.
    corrections : bool
        Remove sensor errors that the data determine from the columns.
    delays : bool
        Estimate residual delays, and places of sensors that no aircraft file gives.
    also : tuple of str
        Signals to read besides those that are always read.
    equations : tuple of str
        Columns that a model reads: others cut and change nothing. Empty: it may be any.
    accept : frozenset of str
        Checks whose findings change nothing.
    sensors : tuple of (message, instance)
        Instance of a message that is used, in an autopilot's log.
    row_rate_hz : float, optional
        Rows a second of original rows.
    """

    calibration: Path | None = None
    mapping: Path | None = None
    maneuvers: tuple[int, ...] = ()
    stretches: tuple[TimeSpan, ...] = ()
    corrections: bool = True
    delays: bool = True
    also: tuple[str, ...] = ()
    equations: tuple[str, ...] = ()
    accept: frozenset[str] = frozenset()
    sensors: tuple[tuple[str, int | str], ...] = ()
    row_rate_hz: float | None = None


def reading_options(
    flights: int,
    *,
    calibration: OfEach = None,
    mapping: OfEach = None,
    maneuvers: int | Sequence[int] = (),
    stretches: Sequence[Any] | None = None,
    ends: tuple[float | None, float | None] = (None, None),
    corrections: bool = True,
    delays: bool = True,
    also: tuple[str, ...] = (),
    equations: tuple[str, ...] = (),
    accept: str | Iterable[str] = (),
    sensors: Mapping[str, int | str] | None = None,
    row_rate_hz: float | None = None,
) -> list[ReadingOptions]:
    """Return the options of each flight; the arguments are those of `host.identify`.

    Parameters
    ----------
    flights : int
        How many there are.
    ends : tuple
        From and to of one stretch of every flight, s.
    also : tuple of str
        Signals to read besides those that are always read.
    equations : tuple of str
        As `ReadingOptions` has them.

    Raises
    ------
    IdentificationError
        If an argument is not what it should be.
    """
    return [
        ReadingOptions(
            made_by,
            named_by,
            numbers_of("maneuvers", maneuvers),
            spans,
            corrections,
            delays,
            also,
            equations,
            accepted_checks(listed(accept)),
            tuple((sensors or {}).items()),
            row_rate_hz,
        )
        for made_by, named_by, spans in zip(
            of_each_flight("calibration", calibration, flights),
            of_each_flight("mapping", mapping, flights),
            chosen_stretches(stretches, *ends, flights),
            strict=True,
        )
    ]


def joined_stretches(
    sources: Sequence[Any], each: Sequence[ReadingOptions]
) -> tuple[list[int], list[ReadingOptions]]:
    """Return which sources differ, and how each is read: with the stretches of its repetitions.

    A source that is given again with stretches of its own has further stretches. Given again
    without, the same samples would be fitted twice: it stays apart, and is refused.
    """
    kept: list[int] = []
    joined: list[ReadingOptions] = []
    for number, (source, how) in enumerate(zip(sources, each, strict=True)):
        for at, before in zip(kept, joined, strict=True):
            alike = replace(before, stretches=how.stretches) == how
            if alike and before.stretches and how.stretches and _same(sources[at], source):
                spans = dict.fromkeys((*before.stretches, *how.stretches))
                joined[kept.index(at)] = replace(before, stretches=tuple(spans))
                break
        else:
            kept.append(number)
            joined.append(how)
    return kept, joined


def _same(one: Any, other: Any) -> bool:
    paths = isinstance(one, str | Path) and isinstance(other, str | Path)
    return Path(one).resolve() == Path(other).resolve() if paths else one is other
