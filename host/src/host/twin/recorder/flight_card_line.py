"""`host card write` and the recorder at the two ends of one simulated USB line."""

from __future__ import annotations

from host.link.card_console import CardConsole
from host.twin.recorder.recorder_build import recorder_library
from host.twin.recorder.sitl_library import TICKS_PER_S, Port, Sitl

GROUND_S = 20.0  # with a single sensor the recorder is sure of the ground after 18 s
STEP_S = 0.02


class SitlLine:
    """The USB line of an instrument in simulated time: bytes sent arrive a millisecond later."""

    device = "sitl"

    def __init__(self, sitl: Sitl) -> None:
        self._sitl, self._read = sitl, 0

    def now_s(self) -> float:
        """Return the simulated time."""
        return self._sitl.now() / TICKS_PER_S

    def data(self) -> bytes:
        """Return the bytes that the instrument sends in the next millisecond."""
        self._sitl.run_for(STEP_S)
        sent = self._sitl.sent(Port.USB)
        new, self._read = sent[self._read :], len(sent)
        return new

    def send(self, data: bytes) -> None:
        """Send bytes to the instrument."""
        at = self._sitl.now() + TICKS_PER_S // 1000
        self._sitl.add_usb([at] * len(data), list(data))


def eeprom_with_card(settings: bytes, flight_card: bytes) -> bytes:
    """Return the EEPROM (4096 bytes) after `host card write` of a flight card.

    Parameters
    ----------
    settings : bytes
        EEPROM before.
    flight_card : bytes
        File of `host plan --card`.

    Raises
    ------
    CardError
        The recorder refuses the card.
    """
    sitl = Sitl(recorder_library())
    try:
        sitl.set_eeprom(settings)
        sitl.power_on()
        sitl.run_for(GROUND_S)
        line = SitlLine(sitl)
        CardConsole(line, line.now_s).write(flight_card)
        return sitl.eeprom()
    finally:
        sitl.close()
