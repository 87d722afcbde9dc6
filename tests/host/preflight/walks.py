"""A walk round a drawn aircraft, fed to a preflight as the radio brings it."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from host.aircraft.file import Aircraft
from host.aircraft.linear_aircraft import load
from host.live.live_stream import LiveStream
from host.physical.calibration import Calibration, calibration_of_text
from host.preflight.check import State
from host.preflight.check_list import CheckListInputs
from host.preflight.guided_list import Preflight
from host.twin.ground.ground_fault import GroundFault
from host.twin.ground.ground_faults import GROUND_FAULTS, broken_walk
from host.twin.ground.ground_instrument import START_US, GroundFrames, ground_frames
from host.twin.ground.ground_walk import STEP_S, GroundWalk, ground_walk
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder.recorded_walk import Prepare, recorded_walk


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
    """Do each item in its window, to the last."""
    return heard(frames.stream(walk.windows), last, **wanted)


def heard(parts: Iterable[tuple[str, bytes]], last: str = "", **wanted: Any) -> Preflight:
    """Listen to each item's part; a pilot goes on where none turned green or red."""
    stream = LiveStream(lines())
    preflight = Preflight(CheckListInputs(aircraft(), lines(), **wanted), stream)
    for item, data in parts:
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


def by_recorder(
    fault: str, seed: int, last: str = "", prepare: Prepare = lambda _: None
) -> Outcome:
    """Walk round an aircraft whose logger is the recorder's own program."""
    walk = ground_walk(aircraft(), seed)
    item, frames = broken_walk(GROUND_FAULTS.get(fault, GroundFault("")), walk, ground_frames)
    sent = recorded_walk(walk, frames, prepare)

    def windows() -> Iterable[tuple[str, bytes]]:
        for name, _, end in walk.windows:
            data = b""
            for at_us, portion in sent:
                data += portion
                if at_us >= START_US + end * STEP_S * 1e6:
                    break
            yield name, data

    return Outcome(heard(windows(), last or item), item)
