"""Let the recorder's ELF live through recorded stimuli, the same that the firmware gets on a PC.

All times of a :class:`Stimuli` are ticks of 0.5 us since power-on.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from host.wire.schema_text import packed_schema
from numpy.typing import NDArray
from simavr_bench.barometer import Bmp085
from simavr_bench.chip import Chip
from simavr_bench.core import ResetCause
from simavr_bench.pins import arduino_pin
from simavr_bench.sd_card import SdCard

CYCLES_PER_TICK = 8
ANALOG = (
    *("alpha_a", "alpha_b", "beta_a", "beta_b", "dp_a", "dp_b", "pot_elevator"),
    *("pot_aileron_left", "pot_aileron_right", "pot_rudder", "rail"),
)
RECEIVER = ("rc_0", "rc_1", "rc_2", "rc_3", "rc_4")
SUPPLY_V, BANDGAP_V = 5.0, 1.1
CAUSES = {
    packed_schema().number("reset_cause", word): cause
    for word, cause in (
        ("external", ResetCause.EXTERNAL),
        ("brown_out", ResetCause.BROWN_OUT),
        ("watchdog", ResetCause.WATCHDOG),
    )
}
_AHEAD = 1_600_000  # cycles: stimuli are handed to the chip 0.1 s before their time


@dataclass(frozen=True, slots=True)
class Stimuli:
    """What reaches the recorder's pins.

    Attributes
    ----------
    duration : int
        End.
    edge_at, edge_levels : NDArray, shape (n,)
        Receiver lines after each edge, bit 0 the first.
    packet_start, packet_address, packet_size : NDArray, shape (m,)
        START of each transfer of the IMU, its address, bytes of it that count.
    packet_data : NDArray[np.uint8], shape (m, width)
        The bytes.
    analog : NDArray, shape (k, 11)
        Converter counts of `ANALOG`, every `step` ticks, straight lines between.
    pressure : NDArray, shape (k, 2)
        UT and UP (19 bits) of the BMP085 on the same grid.
    coefficients : NDArray, shape (11,)
        Its calibration words, signed where the datasheet says so.
    gps_at, gps_value : NDArray, shape (g,)
        Each byte of the GPS and when it is complete.
    button_at : NDArray, shape (2 b,)
        The button goes down, up, down, up.
    step : int
        Ticks of the grid.
    scl_hz : float
        Clock of the IMU's bus.
    gps_baud : float
        Its bit rate.
    """

    duration: int
    edge_at: NDArray[np.int64]
    edge_levels: NDArray[np.uint8]
    packet_start: NDArray[np.int64]
    packet_address: NDArray[np.uint8]
    packet_size: NDArray[np.uint8]
    packet_data: NDArray[np.uint8]
    analog: NDArray[np.float64]
    pressure: NDArray[np.float64]
    coefficients: NDArray[np.int64]
    gps_at: NDArray[np.int64]
    gps_value: NDArray[np.uint8]
    button_at: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    step: int = 2000
    scl_hz: float = 400_000.0
    gps_baud: float = 38_400.0


def read_stimuli(path: Path) -> Stimuli:
    """Read stimuli from an ``.npz`` whose arrays are named as the attributes.

    Raises
    ------
    ValueError
        If one is missing or unknown.
    """
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    scalars = {"duration": int, "step": int, "scl_hz": float, "gps_baud": float}
    given = {n: scalars[n](a) if n in scalars else a for n, a in arrays.items()}
    try:
        return Stimuli(**given)
    except TypeError as error:
        raise ValueError(f"{path}: {error}") from error


def signal_pins(pin_map: Path) -> dict[str, str]:
    """Read which pin carries which signal.

    Parameters
    ----------
    pin_map : Path
        ``hw/pin_map.toml``.

    Returns
    -------
    dict[str, str]
        Port and bit by signal name.
    """
    signals = tomllib.loads(pin_map.read_text(encoding="utf-8"))["signal"]
    return {s["name"]: arduino_pin(s["pin"]) for s in signals}


def adc_channel(pin: str) -> int:
    return int(pin[2]) + (8 if pin[1] == "K" else 0)


class Replay:
    """Stimuli on a chip.

    Parameters
    ----------
    chip : Chip
        With the program loaded, not powered.
    stimuli : Stimuli
        What reaches its pins.
    pins : dict[str, str]
        Pin of each signal, as :func:`signal_pins` gives it.
    card : Path
        Image of the card, changed in place.
    busy_s : float
        Busy after each block.

    Attributes
    ----------
    card : SdCard
        The card.
    baro : Bmp085
        The barometer.
    """

    def __init__(
        self, chip: Chip, stimuli: Stimuli, pins: dict[str, str], card: Path, *, busy_s: float
    ) -> None:
        self._chip = chip
        self._given = stimuli
        self._start = chip.cycle
        self._lines = [pins[name] for name in RECEIVER]
        self._button = pins["button"]
        self._next = {"edge": 0, "packet": 0, "gps": 0, "button": 0}
        self._levels = 0
        self.card = SdCard(chip, pins["card_cs"], image=card, busy_s=busy_s)
        self.baro = Bmp085(chip, pins["baro_sda"], pins["baro_scl"])
        self.baro.calibrate(tuple(int(word) for word in stimuli.coefficients))
        self.baro.source = self._pressure
        for line in self._lines:
            chip.drive(line, False)
        grid = self._start + np.arange(len(stimuli.analog)) * stimuli.step * CYCLES_PER_TICK
        for column, name in enumerate(ANALOG):
            volt = stimuli.analog[:, column] * (5.0 / 1024.0)
            chip.analog_profile(adc_channel(pins[name]), grid, volt)

    def change(self, stimuli: Stimuli) -> None:
        """Go on with edges, packets and GPS that are the same up to 0.2 s from now."""
        self._given = stimuli

    def plan(self, kind: str, at_tick: int, value: float = 0.0) -> None:
        """Plan a fault.

        Parameters
        ----------
        kind : str
            ``card_busy`` (value: ms of the next block), ``card_reject`` (blocks refused),
            ``card_removed``, ``card_inserted``, ``baro_off``, ``baro_on``, ``baro_bus_stuck``,
            ``baro_bus_free``, ``reset`` (cause as the log counts them), ``supply`` (V, everything
            analogue in proportion), ``telemetry_flood`` (bytes) or ``card_absent``.
        at_tick : int
            When.
        value : float
            See kind.

        Raises
        ------
        ValueError
            If there is no such fault.
        """
        at = self._cycle(at_tick)
        planned: dict[str, Callable[[], None]] = {
            "card_busy": lambda: self.card.stall(value * 1e-3, at_cycle=at),
            "card_reject": lambda: self.card.reject(int(value), at_cycle=at),
            "card_absent": self.card.remove,
            "card_removed": self.card.remove,
            "card_inserted": self.card.insert,
            "baro_off": lambda: setattr(self.baro, "present", False),
            "baro_on": lambda: setattr(self.baro, "present", True),
            "baro_bus_stuck": lambda: self.baro.hold(sda=True, scl=False),
            "baro_bus_free": lambda: self.baro.hold(sda=False, scl=False),
            "reset": lambda: self._chip.reset(CAUSES[round(value)]),
            "telemetry_flood": lambda: self._chip.uart_send(3, bytes(int(value)), baud=57_600),
            # Only the chip's own reference is no ratio of its supply.
            "supply": lambda: self._chip.analog_supply(
                SUPPLY_V, bandgap_volt=BANDGAP_V * SUPPLY_V / value
            ),
        }
        if kind not in planned:
            raise ValueError(f"no such fault: found {kind!r}, expected one of {sorted(planned)}")
        self._chip.at(at, planned[kind])

    def _pressure(self, cycle: int) -> tuple[int, int]:
        grid = self._given.pressure
        place = min((cycle - self._start) / (self._given.step * CYCLES_PER_TICK), len(grid) - 1.0)
        row = min(int(place), len(grid) - 2)
        raw = grid[row] + (place - row) * (grid[row + 1] - grid[row])
        return round(float(raw[0])), round(float(raw[1]))

    def _cycle(self, tick: int) -> int:
        return self._start + int(tick) * CYCLES_PER_TICK

    def _due(self, name: str, times: NDArray[np.int64], until: int) -> range:
        first = self._next[name]
        last = int(np.searchsorted(times, (until - self._start) // CYCLES_PER_TICK, "right"))
        self._next[name] = max(first, last)
        return range(first, last)

    def _hand_over(self, until: int) -> None:
        given, chip = self._given, self._chip
        for i in self._due("edge", given.edge_at, until):
            at, levels = self._cycle(given.edge_at[i]), int(given.edge_levels[i])
            for bit, line in enumerate(self._lines):
                if (levels ^ self._levels) >> bit & 1:
                    chip.drive(line, bool(levels >> bit & 1), at_cycle=at)
            self._levels = levels
        for i in self._due("packet", given.packet_start, until):
            data = given.packet_data[i, : int(given.packet_size[i])].tobytes()
            at = self._cycle(given.packet_start[i])
            chip.twi_send(int(given.packet_address[i]), data, at_cycle=at, scl_hz=given.scl_hz)
        byte_cycles = round(10 * 16e6 / given.gps_baud)
        for i in self._due("gps", given.gps_at, until):
            at = max(0, self._cycle(given.gps_at[i]) - byte_cycles)
            chip.uart_send(2, bytes([given.gps_value[i]]), baud=given.gps_baud, at_cycle=at)
        for i in self._due("button", given.button_at, until):
            down = i % 2 == 0
            chip.drive(
                self._button, False if down else None, at_cycle=self._cycle(given.button_at[i])
            )

    def run(
        self, until_tick: int | None = None, progress: Callable[[float], None] = lambda share: None
    ) -> None:
        """Run to a tick, or to the end of the stimuli.

        Parameters
        ----------
        until_tick : int or None
            Where to stop.
        progress : callable
            Called with the share done, about ten times per simulated second.
        """
        tick = self._given.duration if until_tick is None else until_tick
        end = self._cycle(tick)
        begun = self._chip.cycle
        while self._chip.cycle < end:
            to = min(end, self._chip.cycle + _AHEAD)
            self._hand_over(to + _AHEAD)
            self._chip.run_until(to)
            progress((to - begun) / max(1, end - begun))
