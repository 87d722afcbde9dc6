"""The radio stream of a virtual preflight walk, in its own time: for practice and for tests."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

from host.aircraft.file import Aircraft, load
from host.errors import UsageError
from host.live.live_sources import SPEED, Tell, silence
from host.near_names import like
from host.twin.ground.ground_fault import GroundFault
from host.twin.ground.ground_faults import GROUND_FAULTS, broken_walk
from host.twin.ground.ground_instrument import START_US, ground_frames
from host.twin.ground.ground_walk import STEP_S, ground_walk
from host.twin.outcome.virtual_calibration import calibration

WALK = "sim:walk"
USUAL = "ultrastick25e"


@dataclass(slots=True)
class WalkSource:
    """The radio of a virtual walk, with or without a fault.

    Parameters
    ----------
    aircraft : Aircraft
    fault : str
        Of `GROUND_FAULTS`, empty for none.
    seed : int
    speed : float
        Seconds of the walk per second.
    """

    aircraft: Aircraft
    fault: str = ""
    seed: int = 0
    speed: float = 1.0
    baud: int = 0
    recorded: bool = False

    @property
    def name(self) -> str:
        """As on the command line."""
        return f"{WALK}{'/' if self.fault else ''}{self.fault}"

    @property
    def calibration_text(self) -> str:
        """The calibration of the virtual instrument."""
        return calibration(self.aircraft)

    def portions(self, tell: Tell) -> Iterator[bytes]:
        """Yield what the radio sends, in its time."""
        walk = ground_walk(self.aircraft, self.seed)
        _, frames = broken_walk(GROUND_FAULTS.get(self.fault, _NONE), walk, ground_frames)
        windows = [(START_US + a * STEP_S * 1e6, item) for item, a, _ in walk.windows]
        begin_s = time.monotonic()
        for at_us, data in frames.timed():
            while windows and at_us >= windows[0][0]:
                tell(f"the hands: {windows.pop(0)[1].replace('_', ' ')}")
            yield from silence(begin_s + (at_us - START_US) * 1e-6 / self.speed)
            yield data
        tell("the walk is over")


_NONE = GroundFault("")


def walk_source(text: str, aircraft: Aircraft, seed: int) -> WalkSource:
    """Return the source of ``sim:walk``, ``sim:walk/FAULT``, ``...@4x``.

    Raises
    ------
    UsageError
        Of an unknown fault, or another virtual flight.
    """
    found = SPEED.fullmatch(text)
    speed = 1.0
    if found:
        text = found[1]
        speed = 1e3 if found[2].lower() == "max" else float(found[2])
    name, _, fault = text.partition("/")
    if name != WALK or not speed > 0.0:
        raise UsageError(f"{text}: a preflight is practised with {WALK} or {WALK}/FAULT")
    if fault and fault not in GROUND_FAULTS:
        raise UsageError(
            f"{text}: no such fault{like(fault, GROUND_FAULTS)}; known: {', '.join(GROUND_FAULTS)}"
        )
    return WalkSource(_with_travel(aircraft), fault, seed, speed)


def _with_travel(aircraft: Aircraft) -> Aircraft:
    """Give surfaces whose travel nobody measured that of the usual virtual aircraft."""
    usual = {
        name: value
        for name, value in load(USUAL).scalars.items()
        if name.startswith("surfaces.") and not aircraft.scalars.get(name)
    }
    return replace(aircraft, scalars={**aircraft.scalars, **usual})
