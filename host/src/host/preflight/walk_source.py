"""The radio stream of a virtual preflight walk, in its own time: for practice and for tests.

With a flight card that holds, the logger is the recorder's own program: it alone knows the proof.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from host.aircraft.file import Aircraft, load
from host.errors import UsageError
from host.live.live_sources import SPEED, Tell, silence
from host.near_names import like
from host.preflight.hold_check import held_surfaces
from host.twin.ground.ground_fault import GroundFault
from host.twin.ground.ground_faults import GROUND_FAULTS, broken_walk
from host.twin.ground.ground_instrument import START_US, ground_frames
from host.twin.ground.ground_walk import STEP_S, ground_walk
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder.recorded_walk import recorded_walk
from host.twin.recorder.recorder_build import recorder_library
from host.wire.flight_card import card_file, read_card

WALK = "sim:walk"
USUAL = "ultrastick25e"


@dataclass(slots=True)
class WalkSource:
    """The radio of a virtual walk, with or without a fault.

    Parameters
    ----------
    aircraft : Aircraft
    fault : str
        One of `GROUND_FAULTS`, empty for none.
    seed : int
    speed : float
        Seconds of the walk per second.
    flight_card : bytes
        The logger's, with `held`, the surfaces that it holds; empty for none.
    """

    aircraft: Aircraft
    fault: str = ""
    seed: int = 0
    speed: float = 1.0
    flight_card: bytes = b""
    held: tuple[str, ...] = ()
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
        walk = ground_walk(self.aircraft, self.seed, self.held)
        _, frames = broken_walk(GROUND_FAULTS.get(self.fault, _NONE), walk, ground_frames)
        timed: Iterable[tuple[float, bytes]] = frames.timed()
        if self.held:
            timed = recorded_walk(walk, frames, flight_card=self.flight_card)
        windows = [(START_US + a * STEP_S * 1e6, item) for item, a, _ in walk.windows]
        begin_s = time.monotonic()
        for at_us, data in timed:
            while windows and at_us >= windows[0][0]:
                tell(f"the hands: {windows.pop(0)[1].replace('_', ' ')}")
            yield from silence(begin_s + (at_us - START_US) * 1e-6 / self.speed)
            yield data
        tell("the walk is over")


_NONE = GroundFault("")


def walk_source(
    text: str, aircraft: Aircraft, seed: int, flight_card: Path | None = None
) -> WalkSource:
    """Return the source of ``sim:walk``, ``sim:walk/FAULT``, ``...@4x``.

    With a flight card that holds, its tilts are walked too.

    Raises
    ------
    UsageError
        A fault is unknown, or another virtual flight; a card that holds and no recorder.
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
    source = WalkSource(_with_travel(aircraft), fault, seed, speed)
    if flight_card is not None:
        source.flight_card = card_file(flight_card)
        source.held = held_surfaces(read_card(source.flight_card))
    if source.held:
        recorder_library()  # what is wrong with it is said before the walk begins
    return source


def _with_travel(aircraft: Aircraft) -> Aircraft:
    """Give surfaces whose travel nobody measured that of the usual virtual aircraft."""
    usual = {
        name: value
        for name, value in load(USUAL).scalars.items()
        if name.startswith("surfaces.") and not aircraft.scalars.get(name)
    }
    return replace(aircraft, scalars={**aircraft.scalars, **usual})
