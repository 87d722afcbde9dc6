"""The radio of the recorder on this computer: the bytes it sends while a flight goes on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from host.twin.recorder import sitl
from host.twin.recorder.flight_card_line import eeprom_with_card
from host.twin.recorder.recorder_build import recorder_library
from host.twin.recorder.sitl_library import Port, Sitl
from host.twin.recorder.stimuli import Stimuli
from host.twin.sensors.mega_clock import TICKS_PER_S

_STEP_S = 0.02
_BLOCKS_PER_S = 40


@dataclass(frozen=True, slots=True)
class Sent:
    """What the radio sent up to an instant.

    Parameters
    ----------
    t_s : float
        Seconds since power-on.
    data : bytes
    """

    t_s: float
    data: bytes


def radio(
    given: Stimuli,
    *,
    rate_hz: int,
    aircraft: str,
    flight_card: bytes = b"",
    step_s: float = _STEP_S,
) -> Iterator[Sent]:
    """Run the recorder through a flight and yield the bytes it sends, portion by portion.

    Parameters
    ----------
    given : Stimuli
    rate_hz : int
        One of `sitl.RATES_HZ`.
    aircraft : str
        Name for the log's configuration.
    flight_card : bytes
        In its EEPROM; empty for none.
    step_s : float
        Simulated time between two portions.

    Yields
    ------
    Sent
        Portions come as fast as they are taken; for real time the caller waits between them.

    Raises
    ------
    UsageError
        No library, or the flight is over before the recorder starts.
    """
    sitl.check_duration(given)
    blocks = round(
        (given.duration / TICKS_PER_S + 30.0) * _BLOCKS_PER_S * max(rate_hz / 100.0, 0.5)
    )
    image = sitl.card_image((), blocks)
    instrument = Sitl(recorder_library())
    instrument.set_file_blocks(blocks)
    try:
        sitl.configure(instrument, rate_hz, aircraft)
        if flight_card:  # before the card is in: a power-on of its own writes it
            instrument.set_eeprom(eeprom_with_card(instrument.eeprom(), flight_card))
        instrument.insert_card(image, sitl.CARD_ID)
        sitl.give_stimuli(instrument, given, given.duration)
        instrument.power_on()
        sent = 0
        for at in range(0, given.duration, round(step_s * TICKS_PER_S)):
            instrument.run_until(at)
            data = instrument.sent(Port.TELEMETRY)
            yield Sent(at / TICKS_PER_S, data[sent:])
            sent = len(data)
    finally:
        instrument.close()
