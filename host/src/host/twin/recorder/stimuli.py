"""The signals at the recorder's pins in one flight, on the recorder's own clock.

The same stimuli go to the recorder on the PC and to the chip simulator. Times are ticks of 0.5 us
of the Mega's clock: true time times one plus the clock's error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from host.aircraft.airframe import Array
from host.twin.faults import SUPPLY_V
from host.twin.flight.fly import FlightRecord
from host.twin.sensors import bmp085, ubx
from host.twin.sensors.analog import CHANNELS, analog
from host.twin.sensors.imu import Imu
from host.twin.sensors.imu_stream import ImuPacket, imu_packets
from host.twin.sensors.local_flow import AirData
from host.twin.sensors.mega_clock import TICKS_PER_S, clock_share, ticks
from host.twin.sensors.receiver import EDGE, edges

GPS_BYTE_S = 10.0 / 38_400.0
RAIL_COUNT = 512.0  # 5.0 V servo rail through 10 k / 10 k (hw/pin_map.toml) on a 5 V reference
# Analogue grid: 0.58 ms. Two conversions of a channel (1.144 ms apart) share no grid point, and
# from frame to frame they fall elsewhere between two: the noise of a logged sum of four is that of
# independent conversions within 0.6 % at every rate and with every error of both clocks.
SAMPLE_STEP_TICKS = 1_160
OVERSAMPLING = 3


@dataclass(frozen=True, slots=True)
class Stimuli:
    """Signals at the recorder's pins.

    Attributes
    ----------
    duration : int
        Ticks from power-on to the end.
    edges : structured array (at, levels)
        Receiver pins after each edge: bit 0 aileron, elevator, rudder, throttle, switch.
    packets : list of ImuPacket
    analog : (n, 11) array
        Counts of the ten channels and the servo rail, every `SAMPLE_STEP_TICKS`, for a converter
        that truncates; noise included.
    pressure : (n, 2) array
        UT and UP (oversampling 3) of the BMP085 on the same grid.
    coefficients : tuple of int
        Its EEPROM words.
    gps : structured array (at, levels)
        One byte each, in `levels`.
    imu : Imu
        The samples behind the packets.
    """

    duration: int
    edges: NDArray[np.void]
    packets: list[ImuPacket]
    analog: Array
    pressure: Array
    coefficients: tuple[int, ...]
    gps: NDArray[np.void]
    imu: Imu


def stimuli(record: FlightRecord, data: AirData) -> Stimuli:
    """Compute all stimuli of a flight.

    Parameters
    ----------
    record : FlightRecord
    data : AirData

    Returns
    -------
    Stimuli
    """
    rng = np.random.default_rng([record.seed, 11])
    duration = int(ticks(record, float(record.t_s[-1])))
    grid_s = np.arange(0, duration, SAMPLE_STEP_TICKS) / TICKS_PER_S / (1.0 + clock_share(record))
    samples, packets = imu_packets(record, data, rng)
    return Stimuli(
        duration=duration,
        edges=edges(record),
        packets=packets,
        analog=_analog(record, data, grid_s, rng),
        pressure=_pressure(record, data, grid_s, rng),
        coefficients=_coefficients(record),
        gps=_gps(record, rng),
        imu=samples,
    )


def _analog(record: FlightRecord, data: AirData, grid_s: Array, rng: np.random.Generator) -> Array:
    source = analog(record, data)
    out = np.empty((len(grid_s), len(CHANNELS) + 1))
    for k in range(len(CHANNELS)):
        out[:, k] = np.interp(grid_s, record.t_s, source.counts[:, k])
    # What lies between two grid points is the mean of both: on average less noise by sqrt(2/3).
    out[:, :-1] += rng.standard_normal((len(grid_s), len(CHANNELS))) * source.noise_count * 1.5**0.5
    out[:, -1] = RAIL_COUNT
    for fault in record.card.faults:
        # All inputs are ratios of the supply but the servo rail, which has its own.
        inside = fault.inside(grid_s)
        if fault.kind == "rail_drop":
            out[inside, -1] *= fault.amount / SUPPLY_V
        elif fault.kind == "supply_sag":
            out[inside, -1] *= SUPPLY_V / fault.amount
    out[:, :-1] += 0.5  # the converter truncates: half a count puts the mean right
    return np.clip(out, 0.0, 1023.999)


def _pressure(
    record: FlightRecord, data: AirData, grid_s: Array, rng: np.random.Generator
) -> Array:
    # Computed every 10 ms, straight between: the sensor takes 40 ms per value. Held for 10 ms each,
    # a pressure would be 5 ms old on average.
    coarse = grid_s[::17]
    pressure = np.interp(coarse, record.t_s, data.static_pa) + record.draws.scalar("baro_offset_pa")
    if record.card.sensors.noise:
        # Noise as for the voltages: a mean of two grid points has less of it.
        pressure = pressure + rng.normal(0.0, bmp085.NOISE_PA * 1.5**0.5, len(coarse))
    warm = np.interp(coarse, record.t_s, data.temperature_k) - 273.15 + 3.0  # inside the box
    ut = bmp085.raw_temperature(warm)
    up = bmp085.raw_pressure(pressure, ut, OVERSAMPLING)
    out = np.column_stack([np.interp(grid_s, coarse, raw) for raw in (ut, up)])
    for fault in record.card.faults:
        inside = fault.inside(grid_s)
        if fault.kind == "baro_stuck" and inside.any():
            out[inside] = np.floor(out[int(np.argmax(inside))])
    return out


def _coefficients(record: FlightRecord) -> tuple[int, ...]:
    for fault in record.card.faults:
        if fault.kind == "baro_garbage":
            return tuple(bmp085.BLANK if fault.amount else [0] * len(bmp085.BLANK))
    return tuple(bmp085.EXAMPLE)


def _gps(record: FlightRecord, rng: np.random.Generator) -> NDArray[np.void]:
    found = ubx.epochs(record, rng)
    if not found:
        return np.zeros(0, dtype=EDGE)
    parts = []
    for epoch in found:
        part = np.zeros(len(epoch.message), dtype=EDGE)
        part["at"] = ticks(record, epoch.t_s + np.arange(len(epoch.message)) * GPS_BYTE_S)
        part["levels"] = np.frombuffer(epoch.message, dtype=np.uint8)
        parts.append(part)
    return np.concatenate(parts)
