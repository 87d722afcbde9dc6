"""The flight image with a flight card in its EEPROM, flown by the stimuli of `tests/sitl`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from devices.stimuli import Replay, Stimuli, signal_pins
from flight.rig import HEARTBEAT, SERVOS, THRESHOLDS_VOLT
from numpy.typing import NDArray
from simavr_bench import ChargePumpRelay, Chip
from simavr_bench.log import pulses

from tests.sitl.input_flight import PRESSURE_S, InputFlight
from tests.sitl.script import COEFFICIENTS, IMU_ADDRESS

ROOT = Path(__file__).resolve().parents[3]
TICKS_PER_S = 2_000_000
CYCLES_PER_TICK = 8
GRID_S = 0.005


def stimuli(flight: InputFlight) -> Stimuli:
    """Return a flight as the chip's devices take it; the button is driven by hand."""
    edge_at, edge_levels = flight.edges()
    start, packets = flight.packets()
    gps_at, gps_value = flight.gps_bytes()
    rows = np.arange(len(flight.analog)) * GRID_S / PRESSURE_S
    up = np.interp(rows, np.arange(len(flight.up)), flight.up)
    size = len(packets[0])
    return Stimuli(
        duration=round(flight.seconds * TICKS_PER_S),
        edge_at=edge_at,
        edge_levels=edge_levels,
        packet_start=start,
        packet_address=np.full(len(packets), IMU_ADDRESS, np.uint8),
        packet_size=np.full(len(packets), size, np.uint8),
        packet_data=np.frombuffer(b"".join(packets), np.uint8).reshape(-1, size),
        analog=flight.analog,
        pressure=np.stack([np.full(len(up), 27_898.0), up], axis=1),
        coefficients=np.array(COEFFICIENTS),
        gps_at=gps_at,
        gps_value=gps_value,
        step=round(GRID_S * TICKS_PER_S),
    )


class InputRig:
    """A chip with its relay, powered on and flown as far as a test wants."""

    def __init__(self, elf: Path, card: Path, flight: InputFlight, eeprom: bytes) -> None:
        self.pins = signal_pins(ROOT / "hw" / "pin_map.toml")
        self.chip = Chip(startup_s=0.0)
        self.chip.load(elf)
        self.chip.set_eeprom(eeprom)
        self.flight = flight
        self.replay = Replay(self.chip, stimuli(flight), self.pins, card, busy_s=0.005)
        self.relay = ChargePumpRelay(self.chip, HEARTBEAT, SERVOS, sense="PH6")
        self.relay.on_volt = self.relay.off_volt = THRESHOLDS_VOLT[0]
        self.outputs = [pin for _, pin in SERVOS.values()]
        self.chip.watch(*self.outputs)
        self.zero = self.chip.cycle
        self.chip.power_on()

    def run_to(self, at_s: float) -> None:
        """Fly on to a time since power-on."""
        self.replay.run(round(at_s * TICKS_PER_S))

    def change(self, flight: InputFlight) -> None:
        """Go on with a flight that is the same up to 0.2 s from now."""
        self.flight = flight
        self.replay.change(stimuli(flight))

    def pulses(self) -> tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.uint16]]:
        """Return the Mega's servo pulses as `Sitl.pulses` does: ticks since power-on."""
        found = []
        for output, pin in enumerate(self.outputs):
            seen = pulses(*self.chip.edges(pin)).astype(np.int64)
            start = (seen[:, 0] - self.zero) // CYCLES_PER_TICK
            width = np.round((seen[:, 1] - seen[:, 0]) / CYCLES_PER_TICK).astype(np.int64)
            found.append(np.stack([start, np.full(len(start), output), width], axis=1))
        rows = np.concatenate(found)
        rows = rows[np.argsort(rows[:, 0], kind="stable")]
        return rows[:, 0], rows[:, 1].astype(np.uint8), rows[:, 2].astype(np.uint16)
