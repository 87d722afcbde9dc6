"""Everything that reaches the recorder's pins in one flight, on the recorder's own clock.

The same stimuli go to the recorder on the PC and to the chip simulator. Times are ticks of 0.5 us
of the Mega's clock: true time times one plus the clock's error.
"""

from __future__ import annotations

import binascii
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from host.twin import bmp085, ubx
from host.twin.airdata import AirData
from host.twin.airframe import Array
from host.twin.analog import CHANNELS, analog
from host.twin.delays import dlpf_for
from host.twin.flight import GAP_US, FlightRecord
from host.twin.imu import Imu, imu

Ticks = NDArray[np.int64]
TICKS_PER_S = 2_000_000
IMU_RATE_HZ = 200.0
IMU_ADDRESS = 43
# Sample to START of the transfer: filter turn and packing on the 328P, estimate from hardware
# facts 6.2.
IMU_AGE_S = 0.9e-3
IMU_AGE_JITTER_S = 0.15e-3
I2C_BYTE_S = 9.0 / 400_000.0
GPS_BYTE_S = 10.0 / 38_400.0
RAIL_COUNT = 614.0  # 5.0 V servo rail through a divider of 1.67 on a 5 V reference
SAMPLE_STEP_TICKS = 2_000  # analogue grid: 1 ms
OVERSAMPLING = 3
# Packet "imu" of protocol/frames.toml, without its CRC.
PACKET = np.dtype(
    [("kind", "u1"), ("seq", "u1"), ("flags", "u1"), ("aux_kind", "u1"), ("t_us", "<u4"),
     ("age", "<u2"), ("raw", "<i2", 9), ("aux", "<i2", 3)]
)  # fmt: skip
EDGE = np.dtype([("at", np.int64), ("levels", np.uint8)])


@dataclass(frozen=True, slots=True)
class ImuPacket:
    """One transfer on the IMU's bus, ticks of its START and of its STOP."""

    start: int
    end: int
    address: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Stimuli:
    """What the recorder's pins see.

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


def clock_share(record: FlightRecord) -> float:
    """Return by how much the Mega's clock runs fast."""
    return record.draws.scalar("clock_share") if record.card.sensors.clock_error else 0.0


def ticks(record: FlightRecord, t_s: npt.ArrayLike) -> Ticks:
    """Return Mega ticks of true times."""
    scaled = np.asarray(t_s, dtype=np.float64) * (1.0 + clock_share(record)) * TICKS_PER_S
    return np.asarray(np.round(scaled), dtype=np.int64)


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
    samples, packets = _imu_packets(record, data, rng)
    return Stimuli(
        duration=duration,
        edges=_edges(record),
        packets=packets,
        analog=_analog(record, data, grid_s, rng),
        pressure=_pressure(record, data, grid_s, rng),
        coefficients=tuple(bmp085.EXAMPLE),
        gps=_gps(record, rng),
        imu=samples,
    )


def _edges(record: FlightRecord) -> NDArray[np.void]:
    """Pulses one after the other, as a Futaba receiver of that time sends them."""
    widths_s = record.pulses_us * 1e-6
    starts = record.pulse_starts_s[:, None] + np.concatenate(
        [np.zeros((len(widths_s), 1)), np.cumsum(widths_s[:, :-1] + GAP_US * 1e-6, axis=1)], axis=1
    )
    count = widths_s.shape[1]
    out = np.zeros(2 * widths_s.size, dtype=EDGE)
    out["at"][0::2] = ticks(record, starts.ravel())
    out["at"][1::2] = ticks(record, (starts + widths_s).ravel())
    out["levels"][0::2] = np.tile(1 << np.arange(count), len(widths_s))
    keep = np.ones(len(out), dtype=bool)
    for fault in record.card.faults:
        if fault.kind == "receiver_lost":
            first, last = ticks(record, np.array([fault.at_s, fault.at_s + fault.duration_s]))
            lost = (out["at"][0::2] >= first) & (out["at"][0::2] < last)
            keep &= ~np.repeat(lost, 2)
    return out[keep]


def _analog(record: FlightRecord, data: AirData, grid_s: Array, rng: np.random.Generator) -> Array:
    source = analog(record, data)
    out = np.empty((len(grid_s), len(CHANNELS) + 1))
    for k in range(len(CHANNELS)):
        out[:, k] = np.interp(grid_s, record.t_s, source.counts[:, k])
    # Linear interpolation between grid points averages the noise: on average by sqrt(2/3).
    out[:, :-1] += rng.standard_normal((len(grid_s), len(CHANNELS))) * source.noise_count * 1.5**0.5
    out[:, -1] = RAIL_COUNT
    out[:, :-1] += 0.5  # the converter truncates: half a count puts the mean right
    return np.clip(out, 0.0, 1023.999)


def _pressure(
    record: FlightRecord, data: AirData, grid_s: Array, rng: np.random.Generator
) -> Array:
    # Computed at 100 Hz, straight between: the sensor takes 40 ms per value. Held for 10 ms each, a
    # pressure would be 5 ms old on average.
    coarse = grid_s[::10]
    pressure = np.interp(coarse, record.t_s, data.static_pa) + record.draws.scalar("baro_offset_pa")
    if record.card.sensors.noise:
        # As for the voltages: what lies between two points is the mean of both.
        pressure = pressure + rng.normal(0.0, bmp085.NOISE_PA * 1.5**0.5, len(coarse))
    warm = np.interp(coarse, record.t_s, data.temperature_k) - 273.15 + 3.0  # inside the box
    ut = bmp085.raw_temperature(warm)
    up = bmp085.raw_pressure(pressure, ut, OVERSAMPLING)
    return np.column_stack([np.interp(grid_s, coarse, raw) for raw in (ut, up)])


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


def _imu_packets(
    record: FlightRecord, data: AirData, rng: np.random.Generator
) -> tuple[Imu, list[ImuPacket]]:
    own_clock = 1.0
    if record.card.sensors.clock_error:
        own_clock += record.draws.scalar("imu_clock_share")
    step_s = 1.0 / IMU_RATE_HZ / own_clock
    at = np.arange(0.05, record.t_s[-1] - 0.02, step_s)
    sample = imu(record, data, at, dlpf_for(record.card.flight.rate_hz), rng)
    age = IMU_AGE_S + IMU_AGE_JITTER_S * rng.random(len(at))
    age_steps = np.round(age * own_clock / 4e-6).astype(np.int64)
    start = ticks(record, at + age)
    size = 36
    end = start + round((size + 1) * I2C_BYTE_S * TICKS_PER_S)
    imu_us = np.round(at * own_clock * 1e6).astype(np.int64) & 0xFFFFFFFF
    aux = np.zeros((len(at), 3), dtype=np.int64)
    kinds = np.arange(len(at)) % 12  # magnetometer at 16.7 Hz, bias and status at the same pace
    aux[kinds == 0] = np.round(sample.magnetic_t[kinds == 0] / 9.174311926606e-8)
    aux[kinds == 4] = np.round(sample.bias_radps[kinds == 4] / 2.664624812204e-4)
    aux[kinds == 8] = (3150, 0x54 + 256 * sample.dlpf, 1)
    aux_kind = np.where(kinds == 4, 1, np.where(kinds == 8, 2, 0))
    # Between their turns the magnetometer is repeated, as the IMU keeps its last reading.
    held = np.where(kinds == 0, np.arange(len(at)), 0)
    held = np.maximum.accumulate(held)
    repeat = ~np.isin(kinds, (0, 4, 8))
    aux[repeat] = aux[held[repeat]]
    aux = np.clip(aux, -32768, 32767)
    gyro_full = np.abs(sample.raw[:, :3]).max(axis=1) >= 32767
    accel_full = np.abs(sample.raw[:, 3:6]).max(axis=1) >= 32767
    flags = gyro_full.astype(np.int64) + 2 * accel_full + 4 + 8 + 16
    rows = np.zeros(len(at), dtype=PACKET)
    rows["kind"] = 0xA6
    rows["seq"] = np.arange(len(at)) & 0xFF
    rows["flags"], rows["aux_kind"] = flags, aux_kind
    rows["t_us"], rows["age"] = imu_us, age_steps
    rows["raw"], rows["aux"] = sample.raw, aux
    body = rows.tobytes()
    packets = []
    for i, (first, last) in enumerate(zip(start.tolist(), end.tolist(), strict=True)):
        one = body[i * PACKET.itemsize : (i + 1) * PACKET.itemsize]
        crc = binascii.crc_hqx(one, 0xFFFF)
        packets.append(ImuPacket(first, last, IMU_ADDRESS, one + crc.to_bytes(2, "little")))
    return sample, _damage(record, at, packets, rng)


def _damage(
    record: FlightRecord, at: Array, packets: list[ImuPacket], rng: np.random.Generator
) -> list[ImuPacket]:
    for fault in record.card.faults:
        inside = (at >= fault.at_s) & (at < fault.at_s + fault.duration_s)
        if fault.kind == "imu_off":
            packets = [p for p, out in zip(packets, inside, strict=True) if not out]
            at = at[~inside]
        elif fault.kind == "imu_garbage":
            hit = inside & (rng.random(len(at)) < (fault.value or 0.01))
            for i in np.flatnonzero(hit):
                p = packets[i]
                broken = bytearray(p.data)
                broken[int(rng.integers(len(broken)))] ^= 1 << int(rng.integers(8))
                packets[i] = ImuPacket(p.start, p.end, p.address, bytes(broken))
    return packets
