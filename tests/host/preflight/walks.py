"""A walk round a drawn aircraft, fed to a preflight as the radio brings it."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from host.aircraft.file import Aircraft
from host.aircraft.linear_aircraft import load
from host.live.live_stream import LiveStream
from host.physical.calibration import Calibration, calibration_of_text
from host.preflight.check import State
from host.preflight.check_list import Wanted
from host.preflight.guided_list import Preflight
from host.twin.ground.ground_faults import GROUND_FAULTS, broken_walk
from host.twin.ground.ground_instrument import GroundFrames, ground_frames
from host.twin.ground.ground_walk import GroundWalk, ground_walk
from host.twin.outcome.instrument import calibration


@cache
def aircraft() -> Aircraft:
    return load("ultrastick25e")


@cache
def lines() -> Calibration:
    return calibration_of_text(calibration(aircraft()), Path("virtual"))


@dataclass
class Outcome:
    """A walked preflight, and where its fault was put."""

    preflight: Preflight
    item: str = ""

    @property
    def reasons(self) -> dict[str, str]:
        """What is not green, and why."""
        checks = self.preflight.checks
        return {check.key: check.reason for check in checks if check.state != State.SEEN}


def walked(walk: GroundWalk, frames: GroundFrames, last: str = "", **wanted: Any) -> Preflight:
    """Do each item in its window, to the last; a pilot goes on where none turned green or red."""
    stream = LiveStream(lines())
    preflight = Preflight(Wanted(aircraft(), lines(), **wanted), stream)
    for item, data in frames.stream(walk.windows):
        stream.feed(data, 0.0)
        if item == "still" and preflight.asked is None:
            preflight.pass_on()
        if preflight.asked is not None and preflight.asked.key == item:
            preflight.pass_on()
        if item == last:
            break
    preflight.end()
    return preflight


def healthy(seed: int, **wanted: Any) -> Outcome:
    walk = ground_walk(aircraft(), seed)
    return Outcome(walked(walk, ground_frames(walk), **wanted))


def broken(fault: str, seed: int) -> Outcome:
    walk = ground_walk(aircraft(), seed)
    item, frames = broken_walk(GROUND_FAULTS[fault], walk, ground_frames)
    asked = any(item == name for name, _, _ in walk.windows)
    return Outcome(walked(walk, frames, item if asked else "supply"), item)
