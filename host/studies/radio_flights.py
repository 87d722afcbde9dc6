"""Virtual flights as a ground station receives them: the recorder's radio, with losses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from host.twin.flight.fly import FlightRecord, fly
from host.twin.outcome.truth_files import maneuvers
from host.twin.outcome.virtual_calibration import calibration
from host.twin.recorder import sitl
from host.twin.recorder.sitl_radio import Sent, radio
from host.twin.recorder.stimuli import Stimuli, stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard.cards import Card
from host.wire.framing import EnvelopeReader, envelope

BURST = 6.0  # envelopes lost one behind the other, mean: a quarter of a second
_STEP_S = 0.1


@dataclass(frozen=True, slots=True)
class RadioFlight:
    """A flight and what its radio sent.

    Attributes
    ----------
    record : FlightRecord
    truth : list of dict
        Maneuvers, as in a truth file.
    calibration : str
        TOML of its instrument.
    sent : tuple of Sent
        Portions, in s since power-on.
    given : Stimuli
        What the recorder saw, for `card_log`.
    """

    record: FlightRecord
    truth: list[dict[str, Any]]
    calibration: str
    sent: tuple[Sent, ...]
    given: Stimuli

    @property
    def sizes(self) -> tuple[float, float, float, float, float]:
        """Mass (kg), Ixx, Iyy, Izz and Ixz (kg m2) as flown."""
        frame = self.record.frame
        return (frame.mass_kg, frame.ixx_kgm2, frame.iyy_kgm2, frame.izz_kgm2, frame.ixz_kgm2)

    def card_log(self, seed: int) -> bytes:
        """Return the log that the same recorder wrote to its card."""
        card = self.record.card
        rate = sitl.recorder_rate_hz(card.flight.rate_hz)
        return sitl.record(
            self.given, rate_hz=rate, aircraft=self.record.aircraft.name, faults=(), seed=seed
        ).log


def radio_flight(card: Card, seed: int) -> RadioFlight:
    """Fly a card and listen to its radio."""
    record = fly(card, seed=seed)
    data = air_data(record)
    given = stimuli(record, data)
    rate = sitl.recorder_rate_hz(card.flight.rate_hz)
    sent = tuple(radio(given, rate_hz=rate, aircraft=record.aircraft.name, step_s=_STEP_S))
    text = calibration(record.aircraft, record.draws.errors)
    return RadioFlight(record, maneuvers(record, data), text, sent, given)


def lost_in_bursts(sent: Sequence[Sent], share: float, seed: int) -> list[Sent]:
    """Return the stream without a share of its envelopes, lost in bursts of `BURST` in the mean.

    Two states, each left at random (Gilbert's channel).
    """
    rng = np.random.default_rng([seed, 4])
    reader, lost, kept = EnvelopeReader(), False, []
    for portion in sent:
        frames = []
        for frame in reader.feed(portion.data):
            leave = 1.0 / BURST if lost else share / (1.0 - share) / BURST
            lost = lost != (rng.random() < leave)
            if not lost:
                frames.append(envelope(frame))
        kept.append(Sent(portion.t_s, b"".join(frames)))
    return kept


def after_each_point(
    sent: Sequence[Sent], truth: Sequence[dict[str, Any]], behind_s: float
) -> Iterator[bytes]:
    """Yield all bytes that came until some time behind the input of each surface's test point."""
    for point in truth:
        if "throttle" not in point["axes"]:
            until_s = point["input_end_s"] + behind_s
            yield b"".join(s.data for s in sent if s.t_s <= until_s)
