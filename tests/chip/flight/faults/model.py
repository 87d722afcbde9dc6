"""What a fault is, what was seen of it, and what is judged in every row."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from flight.images import ROOT
from numpy.typing import NDArray

if TYPE_CHECKING:
    from flight.rig import FlightRig
    from simavr_bench.card_journal import Journal
    from simavr_bench.heartbeat import Beats

    from host import FlightLog

FAULT_S, AFTER_S = 3.0, 3.0
CLOCK_LATE_US = 10_000  # the Mega's clock starts some ms behind the first instruction
ALL_SERVOS = ("aileron", "elevator", "rudder", "throttle")


@cache
def _schema() -> dict[str, Any]:
    text = (ROOT / "protocol" / "generated" / "schema.json").read_text()
    schema: dict[str, Any] = json.loads(text)["schema"]
    return schema


@cache
def event_names() -> dict[int, str]:
    """Names of the events by number."""
    return {int(number): name for name, number in _schema()["enum"]["event"].items()}


@cache
def valid_bit(name: str) -> int:
    """Mask of a bit of `ident.valid`."""
    return 1 << int(_schema()["bits"]["valid"].index(name))


@dataclass(frozen=True, slots=True)
class Event:
    """One event of the log."""

    t_us: int
    name: str
    arg: int


@dataclass(slots=True)
class Seen:
    """A flight with a fault, after its log was read.

    Attributes
    ----------
    rig : FlightRig
        As it ended.
    log : FlightLog
        Its log.
    begin, end, over : int
        Cycles: the fault began, was undone, the flight ended.
    events : list of Event
        Events of the whole log; times are of the clock of their boot.
    journal : Journal
        What the card programmed.
    """

    rig: FlightRig
    log: FlightLog
    begin: int
    end: int
    over: int
    events: list[Event]
    journal: Journal

    @property
    def ident(self) -> NDArray[np.void]:
        """Identification frames."""
        frames: NDArray[np.void] = self.log.frames["ident"]
        return frames

    @property
    def system(self) -> NDArray[np.void]:
        """Health frames from the begin of the fault on."""
        frames: NDArray[np.void] = self.log.frames["system"]
        return frames[frames["t_us"] > self.begin // 16]

    @property
    def before(self) -> np.void:
        """The last health frame before the fault."""
        frames = self.log.frames["system"]
        last: np.void = frames[frames["t_us"] <= self.begin // 16][-1]
        return last

    def during(self, *, late_s: float = 0.1) -> NDArray[np.void]:
        """Identification frames while the fault lasts, from `late_s` after its begin on."""
        time_us = self.ident["t_us"]
        begin_us, end_us = self.begin // 16 + late_s * 1e6, self.end // 16 - 2 * CLOCK_LATE_US
        inside = (time_us > begin_us) & (time_us < end_us)
        frames: NDArray[np.void] = self.ident[inside]
        return frames

    def after(self, *, late_s: float = 1.5) -> NDArray[np.void]:
        """Identification frames from `late_s` after the fault's end on."""
        frames: NDArray[np.void] = self.ident[self.ident["t_us"] > self.end // 16 + late_s * 1e6]
        return frames

    def events_of(self, name: str) -> list[Event]:
        """Events of one name since the fault began (or since a later boot)."""
        return [e for e in self.events if e.name == name]

    def count(self, counter: str) -> int:
        """Increase of a counter of the health frames since the fault began."""
        return int(self.system[counter][-1]) - int(self.before[counter])


Check = Callable[[Seen], Sequence[str]]


def no_check(_: Seen) -> Sequence[str]:
    """Nothing beyond what every row is judged by."""
    return ()


@dataclass(frozen=True, slots=True)
class Fault:
    """One row: what is done, undone after `fault_s`, and what must come of it.

    Attributes
    ----------
    number : str
        In the list of 25 faults that the recorder was designed against.
    injected, expected : str
        In words.
    begin, end : callable
        Do and undo it.
    events : tuple of str
        Events the log must hold, from the fault on.
    lossless : bool
        Whether no frame may be lost.
    engaged : bool or None
        Whether the Mega still drives at the end; None: either.
    servos : tuple of str
        Servos that must see pulses all the time.
    check : callable
        What else is wrong with the log or the rig.
    recovers : bool
        Whether it records again at the end, with everything valid that was before.
    resets : bool
        Whether the chip starts anew.
    fault_s, after_s : float
        Length of the fault and of the flight behind it.
    """

    number: str
    injected: str
    expected: str
    begin: Callable[[FlightRig], object]
    end: Callable[[FlightRig], object] = lambda rig: None
    events: tuple[str, ...] = ()
    lossless: bool = True
    engaged: bool | None = True
    servos: tuple[str, ...] = ALL_SERVOS
    check: Check = no_check
    recovers: bool = True
    resets: bool = False
    fault_s: float = FAULT_S
    after_s: float = AFTER_S

    @property
    def may_stop(self) -> bool:
        """Whether the Mega may cease to drive meanwhile."""
        return self.engaged is not True or self.resets


@dataclass(slots=True)
class Outcome:
    """What a fault did: the columns of the table."""

    gap_ms: float
    lost: int
    recovered_s: float
    beats: Beats
    wrong: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)


def change(device: object, **values: object) -> None:
    """Set attributes of a device model."""
    for name, value in values.items():
        setattr(device, name, value)


def expect(condition: object, text: str) -> list[str]:
    """Give the text unless the condition holds."""
    return [] if condition else [text]
