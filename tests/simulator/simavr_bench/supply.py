"""The 5 V supply as a source of resets: cut, sag, brown-out."""

from __future__ import annotations

from dataclasses import dataclass

from simavr_bench.chip import Chip, ResetCause

POWER_ON_RESET_VOLT = 1.4  # ATmega2560, table 31-4, typical


@dataclass(slots=True)
class Supply:
    """Voltage of the board's rail.

    Parameters
    ----------
    chip : Chip
        What it feeds; the chip must be off.
    brown_out_volt : float
        4.3 with extended fuse 0xFC, 2.7 with 0xFD (what Arduino ships).

    Attributes
    ----------
    volt : float
        Now.
    """

    chip: Chip
    brown_out_volt: float = 2.7
    volt: float = 0.0
    _held: bool = False

    def set(self, volt: float) -> None:
        """Bring the rail to a voltage now; AVCC follows, hysteresis of the detector is 50 mV."""
        was_off = self.volt < POWER_ON_RESET_VOLT
        self.volt = volt
        if volt < POWER_ON_RESET_VOLT:
            if not was_off:
                self.chip.power_off()
            self._held = False
            return
        self.chip.analog_supply(volt)
        if was_off:
            self.chip.power_on()
        if volt < self.brown_out_volt and not self._held:
            self.chip.hold_reset(ResetCause.BROWN_OUT)
            self._held = True
        elif self._held and volt > self.brown_out_volt + 0.05:
            self._held = False
            self.chip.release_reset(ResetCause.BROWN_OUT)

    def set_at(self, cycle: int, volt: float) -> None:
        """Bring the rail to a voltage at a cycle."""
        self.chip.at(cycle, lambda: self.set(volt))
