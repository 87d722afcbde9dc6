"""What a log holds against the script of its flight: the largest difference of every channel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from host.twin.recorder.sitl_library import byte_ticks
from host.twin.sensors import bmp085
from numpy.typing import NDArray

from tests.sitl import script as scripted
from tests.sitl.script import Integers, Script

Frames = Mapping[str, NDArray[np.void]]

NAMES = ("ident", "mag", "attitude", "baro", "gps")
CONVERSION_TICKS = 208
HOLD_TICKS = 24
ROUNDS, SLOTS = 4, 11
# A pulse is accepted once its line has been low for 300 us and the main loop has come by; a frame
# takes it at the first turn behind its t_us, and a turn with card traffic lasts 0.1 ms.
ACCEPT_TICKS = (600 - 200, 600 + 2000)


@dataclass(frozen=True, slots=True)
class Difference:
    """How far a channel of the log is from its script.

    Attributes
    ----------
    channel : str
    samples : int
        Compared.
    low, high : int
        Range of the script over them, raw.
    largest : int
        Largest difference, raw.
    allowed : int
        Largest difference allowed: one step of the quantity's own resolution.
    """

    channel: str
    samples: int
    low: int
    high: int
    largest: int
    allowed: int

    @property
    def good(self) -> bool:
        """True if the channel agrees and there was something to agree on."""
        return self.samples > 0 and self.largest <= self.allowed


def compare(recorded: Frames, script: Script, *, clock_us: int = 0) -> list[Difference]:
    """Compare every channel of a log with its script, raw counts with raw counts.

    Parameters
    ----------
    recorded : mapping of str to structured array
        Frames of one session.
    script : Script
    clock_us : int
        What the Mega's clock showed, or would have shown, at time zero of the script.
    """
    frames = {name: _shifted(recorded[name], clock_us) for name in NAMES}
    ident = frames["ident"]
    ticks = unwrap(ident["t_us"]) * 2
    out = [*_imu(ident, ticks, script), *_analog(ident, ticks, script)]
    out += [*_receiver(ident, ticks, script), *_servos(ident)]
    out += [*_mag(frames["mag"], script), *_attitude(frames["attitude"], script)]
    return [*out, *_baro(frames["baro"], script), *_gps(frames["gps"], script)]


def _shifted(frame: NDArray[np.void], clock_us: int) -> NDArray[np.void]:
    out = frame.copy()
    out["t_us"] -= np.uint32(clock_us % 2**32)
    return out


def unwrap(t_us: NDArray[np.uint32]) -> Integers:
    """Undo the wraps of 32-bit microseconds by the signed difference to the previous frame."""
    steps = np.diff(t_us, prepend=np.uint32(0)).view(np.int32)
    return np.cumsum(steps, dtype=np.int64)


def _difference(
    channel: str, found: NDArray[Any], expected: NDArray[Any], allowed: int = 0
) -> Difference:
    want = np.asarray(expected, dtype=np.int64)
    error = np.abs(np.asarray(found, dtype=np.int64) - want)
    if not len(want):
        return Difference(channel, 0, 0, 0, 0, allowed)
    return Difference(
        channel, len(want), int(want.min()), int(want.max()), int(error.max()), allowed
    )


def _imu(ident: NDArray[np.void], ticks: Integers, script: Script) -> list[Difference]:
    imu = script.imu
    # A packet counts from its STOP on, behind the address and 36 bytes.
    arrived = imu.start + 37 * byte_ticks()
    packet = np.searchsorted(arrived, ticks, side="right") - 1
    out = [_difference("imu_seq", ident["imu_seq"], packet & 0xFF)]
    age = imu.age[packet] + (ticks - imu.start[packet]) // 8
    out.append(_difference("imu_age", ident["imu_age"], age, allowed=1))
    out += [
        _difference(name, ident[name], imu.raw[packet, channel])
        for channel, name in enumerate(scripted.IMU)
    ]
    return out


def _analog(ident: NDArray[np.void], ticks: Integers, script: Script) -> list[Difference]:
    out = []
    grid = np.arange(len(script.analog)) * scripted.GRID_TICKS
    for slot, name in enumerate(scripted.ANALOG):
        total = np.zeros(len(ticks), dtype=np.int64)
        for turn in range(ROUNDS):
            when = ticks + HOLD_TICKS + (turn * SLOTS + slot) * CONVERSION_TICKS
            count = np.interp(when, grid, script.analog[:, slot])
            total += np.floor(np.clip(count, 0, 1023)).astype(np.int64)
        out.append(_difference(name, ident[name], total, allowed=1))
        usable = (total >= 8) & (total <= 4084)
        flagged = (ident["valid"] >> slot) & 1
        out.append(_difference(f"valid {name}", flagged, usable))
    return out


def _receiver(ident: NDArray[np.void], ticks: Integers, script: Script) -> list[Difference]:
    out = []
    for channel, name in enumerate(scripted.RC):
        width = script.receiver.width[:, channel]
        fall = script.receiver.start[:, channel] + width
        last, first = (np.searchsorted(fall + late, ticks, side="right") - 1
                       for late in ACCEPT_TICKS)  # fmt: skip
        found = ident[name].astype(np.int64)
        newest, before = width[np.maximum(last, 0)], width[np.maximum(first, 0)]
        nearest = np.where(np.abs(found - before) < np.abs(found - newest), before, newest)
        # Behind the first three pulses; each differs from the one before it.
        known = first >= 3
        out.append(_difference(name, found[known], nearest[known]))
    return out


def _servos(ident: NDArray[np.void]) -> list[Difference]:
    """The Mega repeats what it accepted, or is silent."""
    out = []
    for name in scripted.RC[:4]:
        servo = ident[name.replace("rc_", "servo_")]
        driving = servo > 0
        out.append(_difference(name.replace("rc_", "servo_"), servo[driving], ident[name][driving]))
    return out


def _mag(mag: NDArray[np.void], script: Script) -> list[Difference]:
    row = _packet_at(mag, script)
    kept = script.imu.aux_kind[row] == scripted.MAGNETOMETER
    return [
        _difference(name, mag[name][kept], script.imu.aux[row[kept], k])
        for k, name in enumerate(("mx", "my", "mz"))
    ]


def _attitude(attitude: NDArray[np.void], script: Script) -> list[Difference]:
    imu = script.imu
    row = _packet_at(attitude, script)
    out = [
        _difference("imu_t_us", attitude["imu_t_us"], imu.t_us[row]),
        _difference("attitude imu_seq", attitude["imu_seq"], row & 0xFF),
    ]
    bias = _last_of(imu.aux_kind == scripted.GYRO_BIAS, row)
    status = _last_of(imu.aux_kind == scripted.STATUS, row)
    out += [
        _difference(name, attitude[name], imu.aux[bias, k])
        for k, name in enumerate(("bias_p", "bias_q", "bias_r"))
    ]
    out.append(_difference("temperature", attitude["temperature"], imu.aux[status, 0]))
    out.append(_difference("product_id", attitude["product_id"], imu.aux[status, 1] & 0xFF))
    out.append(_difference("dlpf", attitude["dlpf"], imu.aux[status, 1] >> 8))
    return out


def _packet_at(frame: NDArray[np.void], script: Script) -> Integers:
    """Return the packet whose START is at the frame's time."""
    start = unwrap(frame["t_us"]) * 2
    row = np.searchsorted(script.imu.start, start + 2000) - 1
    return np.asarray(row, dtype=np.int64)


def _last_of(mask: NDArray[np.bool_], row: Integers) -> Integers:
    found = np.flatnonzero(mask)
    return np.asarray(found[np.searchsorted(found, row, side="right") - 1], dtype=np.int64)


def _baro(baro: NDArray[np.void], script: Script) -> list[Difference]:
    # The frame's time is the middle of the pressure conversion of 13.5 ms; the temperature was
    # converted before it, with the read-out of two bytes and two commands between.
    at = unwrap(baro["t_us"]) * 2
    grid = np.arange(len(script.pressure)) * scripted.PRESSURE_TICKS
    up = np.floor(np.interp(at, grid, script.pressure[:, 1])).astype(np.int64) >> 1
    out = [_difference("raw_pressure", baro["raw_pressure"], up, allowed=1)]
    while_ms = np.arange(10.0, 31.0)[:, None]
    ut = np.floor(np.interp(at - while_ms * 2000, grid, script.pressure[:, 0]))
    found = baro["raw_temperature"].astype(np.int64)
    low, high = ut.min(axis=0).astype(np.int64), ut.max(axis=0).astype(np.int64)
    out.append(_difference("raw_temperature", found, np.clip(found, low, high)))
    coefficients = bmp085.Coefficients(*scripted.COEFFICIENTS)
    tenth, pascal = bmp085.compensate(found, baro["raw_pressure"].astype(np.int64), 2, coefficients)
    # Beyond 20 to 120 kPa there is no pressure.
    inside = (pascal > 20_100) & (pascal < 119_900)
    out.append(
        _difference(
            "static_pressure", baro["static_pressure"][inside], 16 * pascal[inside], allowed=16
        )
    )
    out.append(
        _difference("baro temperature", baro["temperature"][inside], 10 * tenth[inside], allowed=10)
    )
    return out


def _gps(gps: NDArray[np.void], script: Script) -> list[Difference]:
    # The first byte is stamped when the main loop takes it, at most 1 ms late.
    epoch = np.searchsorted(script.gps.start, unwrap(gps["t_us"]) * 2 + 2, side="right") - 1
    late = unwrap(gps["t_us"]) - script.gps.start[epoch] // 2
    out = [_difference("gps t_us", late, np.zeros(len(late)), allowed=1000)]
    return out + [_difference(name, gps[name], script.gps.values[name][epoch])
                  for name in scripted.GPS]  # fmt: skip
