"""A virtual flight received as it is flown: the recorder's own program in real time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Self

from host.compiled import say_if_slow
from host.live.live_sources import Tell, silence
from host.twin.flight.fly import FlightRecord, fly
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import sitl
from host.twin.recorder.logger_flight import logger_flight
from host.twin.recorder.recorder_build import recorder_library
from host.twin.recorder.sitl_radio import radio
from host.twin.recorder.stimuli import Stimuli, stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard import cards

_A_WAIT_S = 30.0  # what is said of a flight that takes longer


@dataclass(slots=True)
class SimulatedSource:
    """The radio of a virtual flight.

    Parameters
    ----------
    card : str
        Name or file, as `host simulate` takes it.
    seed : int
    flight_card : bytes
        In the logger's EEPROM: it flies the inputs of the card itself; empty for none.
    """

    card: str
    seed: int = 0
    flight_card: bytes = b""
    baud: int = 0
    recorded: bool = False

    @property
    def name(self) -> str:
        """As on the command line."""
        return f"sim:{self.card}"

    calibration_text: str = ""
    aircraft: str = ""
    _flight: tuple[FlightRecord, Stimuli] | None = None

    def open(self, tell: Tell) -> Self:
        """Fly the card, before anything is made for it; its instrument's calibration is known then.

        Raises
        ------
        HostError
            If the card cannot be flown, the flight card is not of it, or there is no recorder.
        """
        card = cards.load(self.card)
        say_if_slow()
        recorder_library()
        tell(f"flying {self.card}")
        if self.flight_card:
            record, given, _ = logger_flight(
                self.flight_card, card, seed=self.seed, recorder=self._recorded
            )
        else:
            record = fly(card, seed=self.seed, progress=_time_left(tell))
            given = stimuli(record, air_data(record))
        self.calibration_text = calibration(record.aircraft, record.draws.errors)
        self.aircraft = record.aircraft.name
        self._flight = record, given
        return self

    def _recorded(self, record: FlightRecord, given: Stimuli) -> sitl.Recording:
        """Let the recorder live through a round of a flight whose inputs it flies."""
        return sitl.record(
            given,
            rate_hz=sitl.recorder_rate_hz(record.card.flight.rate_hz),
            aircraft=record.aircraft.name,
            seed=self.seed,
            flight_card=self.flight_card,
        )

    def portions(self, tell: Tell) -> Iterator[bytes]:
        """Yield what the radio sends, in real time."""
        if self._flight is None:
            self.open(tell)
        assert self._flight is not None
        record, given = self._flight
        rate_hz = sitl.recorder_rate_hz(record.card.flight.rate_hz)
        start_s = time.monotonic()
        for sent in radio(
            given, rate_hz=rate_hz, aircraft=record.aircraft.name, flight_card=self.flight_card
        ):
            yield from silence(start_s + sent.t_s)
            yield sent.data
        tell(f"the flight of {self.card} is over")


def _time_left(tell: Tell) -> Callable[[float], None]:
    """Return what says once, after the first part of a flight, how long the rest takes."""
    began_s, said = time.monotonic(), False

    def progress(share: float) -> None:
        nonlocal said
        left_s = (time.monotonic() - began_s) * (1.0 - share) / share
        if not said and left_s > _A_WAIT_S:
            tell(f"about {left_s / 60.0:.0f} min of work left; Ctrl-C ends")
        said = True

    return progress
