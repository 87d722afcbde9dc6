"""A scripted flight: stimuli on every channel at full rate and over its full range.

Each channel is a triangle with a period of its own, so that no two agree for long: a swap, a sign
or a shift by one sample is seen. Times are ticks of 0.5 us since power-on.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

import numpy as np
from host.twin.recorder.sitl_library import TICKS_PER_S, Sitl
from host.twin.sensors.ubx import packet as ubx
from host.wire.packets import packet
from host.wire.schema_text import packed_schema
from numpy.typing import NDArray

Integers = NDArray[np.int64]

RC = ("rc_aileron", "rc_elevator", "rc_rudder", "rc_throttle", "rc_switch")
IMU = ("p", "q", "r", "ax", "ay", "az", "phi", "theta", "psi")
ANALOG = (
    "alpha_a", "alpha_b", "beta_a", "beta_b", "dp_a", "dp_b",
    "pot_elevator", "pot_aileron_left", "pot_aileron_right", "pot_rudder",
)  # fmt: skip
GPS = (
    "itow_ms", "week", "latitude", "longitude", "height", "v_north", "v_east", "v_down",
    "ground_speed", "course", "h_accuracy", "v_accuracy", "s_accuracy", "fix", "satellites",
)  # fmt: skip

# Primes, so that no two channels come back together within two minutes.
RC_PERIODS = (97, 113, 131, 149, 167)  # receiver frames
IMU_PERIODS = (401, 443, 487, 523, 571, 613, 659, 709, 761)  # packets
ANALOG_PERIODS_MS = (4001, 4507, 5003, 5501, 6007, 6521, 7001, 7507, 8009, 8513, 9001)

LEVEL = (3, -2, 1, 40, -30, -8190, 12, -9, 4500)
IMU_RANGES = (32767, 32767, 32767, 32767, 32767, 32767, 18000, 9000, 18000)
GRID_TICKS = 2000  # analogue: 1 ms
PRESSURE_TICKS = 20_000  # 10 ms
STILL_AIR = (27_898, 4 * 23_843)
COEFFICIENTS = (408, -72, -14383, 32741, 32757, 23153, 6190, 4, -32768, -8711, 2868)

IMU_ADDRESS = packet("imu").address
ORIGINAL_1, ORIGINAL_2 = (packet(f"original_imu_{n}").address for n in (1, 2))
IMU_FLAGS = sum(
    packed_schema().bit("imu_flags", word)
    for word in ("attitude_valid", "mag_valid", "offsets_valid")
)
MAGNETOMETER, GYRO_BIAS, STATUS = (
    packed_schema().number("imu_aux", word) for word in ("magnetometer", "gyro_bias", "status")
)
PACKET_US = 5000
PACKET_AGE_US = 900


def triangle(index: Integers, period: int, low: float, high: float) -> NDArray[np.float64]:
    """Return a triangle wave of `index` between low and high, both reached."""
    half = period // 2
    phase = np.asarray(index) % period
    share = np.where(phase <= half, phase / half, (period - phase) / (period - half))
    return np.asarray(low + (high - low) * share)


@dataclass(slots=True)
class Receiver:
    """Pulses of five channels.

    Attributes
    ----------
    start, width : (frames, 5) arrays
        Ticks.
    """

    start: Integers
    width: Integers

    def edges(self) -> tuple[Integers, NDArray[np.uint8]]:
        """Return ticks and levels of all edges in order; simultaneous ones become one."""
        rise, fall = self.start.ravel(), (self.start + self.width).ravel()
        mask = np.tile(1 << np.arange(5), len(self.start))
        at = np.concatenate([rise, fall])
        change = np.concatenate([mask, mask])
        order = np.argsort(at, kind="stable")
        levels = np.bitwise_xor.accumulate(change[order])
        last = np.append(np.diff(at[order]) > 0, True)
        return at[order][last], levels[last].astype(np.uint8)


def receiver(
    seconds: float,
    *,
    frame_us: float = 20_000.0,
    simultaneous: bool = False,
    idle_from_s: float | None = None,
    start_s: float = 0.0,
) -> Receiver:
    """Return a receiver's pulses: 900 to 2100 us on the surfaces, throttle 1000 to 2000 us.

    The switch says direct for two seconds, then Mega, over its whole range from 1650 us on.
    Behind `idle_from_s` the throttle is idle.
    """
    count = int((seconds - start_s) * 1e6 / frame_us)
    frame = np.arange(count)
    width = np.empty((count, 5), dtype=np.int64)
    for channel, period in enumerate(RC_PERIODS):
        low, high = (900, 2100) if channel < 3 else (1000, 2000)
        if channel == 4:
            low = 1650
        width[:, channel] = np.round(2 * triangle(frame, period, low, high))
    first = start_s * 1e6 + frame * frame_us
    width[frame * frame_us < 2e6, 4] = 2200
    if idle_from_s is not None:
        width[first >= idle_from_s * 1e6, 3] = 2100
    start = np.repeat(np.round(first * 2).astype(np.int64)[:, None], 5, axis=1) + 2000
    if not simultaneous:
        # One after the other, each when the last has ended and 5 us have passed.
        start[:, 1:] += np.cumsum(width[:, :-1] + 10, axis=1)
    return Receiver(start, width)


@dataclass(slots=True)
class Imu:
    """Packets of the new kind.

    Attributes
    ----------
    start : (n,) array
        Ticks of the START.
    raw : (n, 9) array
        As in frame `ident`.
    aux_kind : (n,) array
    aux : (n, 3) array
    age : (n,) array
        Steps of 4 us.
    """

    start: Integers
    raw: Integers
    aux_kind: Integers
    aux: Integers
    age: Integers
    t_us: Integers

    def packets(self) -> list[bytes]:
        """Return the bytes of every packet."""
        rows = packet("imu").rows(len(self.start))
        rows["seq"] = np.arange(len(rows)) & 0xFF
        rows["flags"] = IMU_FLAGS
        for name in ("aux_kind", "t_us", "age", "aux"):
            rows[name] = getattr(self, name)
        for column, name in enumerate(IMU):
            rows[name] = self.raw[:, column]
        return packet("imu").sealed(rows)


def imu(seconds: float, *, still_from_s: float | None = None) -> Imu:
    """Return packets at 200 Hz: attitude 100 Hz of magnetometer, bias and status between them.

    Behind `still_from_s` it lies level on the ground.
    """
    index = np.arange(int(seconds * 1e6 / PACKET_US) - 4)
    raw = np.empty((len(index), 9), dtype=np.int64)
    for channel, (period, limit) in enumerate(zip(IMU_PERIODS, IMU_RANGES, strict=True)):
        raw[:, channel] = np.round(triangle(index, period, -limit, limit))
    if still_from_s is not None:
        raw[index * PACKET_US >= still_from_s * 1e6] = LEVEL
    kind = np.select([index % 12 == 4, index % 12 == 8], [GYRO_BIAS, STATUS], MAGNETOMETER)
    aux = np.empty((len(index), 3), dtype=np.int64)
    for k in range(3):
        values = triangle(index + 50 * k, 307 + 40 * k, -2047, 2047)
        bias = triangle(index + 70 * k, 353 + 30 * k, -32767, 32767)
        aux[:, k] = np.round(np.where(kind == GYRO_BIAS, bias, values))
    status = np.stack([triangle(index, 911, -4000, 8500), np.full(len(index), 0x54 + 256 * 3),
                       np.full(len(index), 7)], axis=1)  # fmt: skip
    aux = np.where((kind == STATUS)[:, None], np.round(status), aux).astype(np.int64)
    age = np.round((PACKET_AGE_US + 40 * (index % 5)) / 4).astype(np.int64)
    start = (index * PACKET_US + 3000 + 10 * (index % 7)) * 2
    t_us = (start // 2 - age * 4 + 1_000_000) & 0xFFFFFFFF
    return Imu(start, raw, kind, aux, age, t_us)


@dataclass(slots=True)
class Gps:
    """Epochs of a u-blox 6 at 5 Hz.

    Attributes
    ----------
    start : (n,) array
        Ticks of the first byte of the first message.
    values : dict of str to (n,) array
        Fields of frame `gps`.
    """

    start: Integers
    values: dict[str, Integers]

    def stream(self) -> tuple[Integers, NDArray[np.uint8]]:
        """Return ticks and bytes of all messages at 38400 baud."""
        at, data = [], bytearray()
        for i, first in enumerate(self.start):
            v = {name: int(value[i]) for name, value in self.values.items()}
            message = ubx(0x02, struct.pack("<IiiiiII", v["itow_ms"], v["longitude"],
                          v["latitude"], v["height"] + 15000, v["height"],
                          10 * v["h_accuracy"], 10 * v["v_accuracy"]))  # fmt: skip
            message += ubx(0x06, struct.pack("<I4xHBB35xB4x", v["itow_ms"], v["week"], v["fix"],
                           0x0D, v["satellites"]))  # fmt: skip
            message += ubx(0x12, struct.pack("<IiiiIIiII", v["itow_ms"], v["v_north"],
                           v["v_east"], v["v_down"], 0, v["ground_speed"], 1000 * v["course"],
                           v["s_accuracy"], 0))  # fmt: skip
            at.append(first + np.round(np.arange(len(message)) * 10 / 38400 * TICKS_PER_S))
            data += message
        return np.concatenate(at).astype(np.int64), np.frombuffer(bytes(data), dtype=np.uint8)


def gps(seconds: float, *, still_from_s: float | None = None) -> Gps:
    """Return epochs over the full range of every field; a slow one behind `still_from_s`."""
    index = np.arange(int(seconds * 5) - 1)

    def wave(period: int, low: float, high: float) -> Integers:
        return np.round(triangle(index, period, low, high)).astype(np.int64)

    values = {
        "itow_ms": 604_800_000 - 40_000 + index * 200,
        "week": np.full(len(index), 2400),
        "latitude": wave(101, -900_000_000, 900_000_000),
        "longitude": wave(127, -1_800_000_000, 1_800_000_000),
        "height": wave(139, -500_000, 50_000_000),
        "v_north": wave(151, -32767, 32767),
        "v_east": wave(163, -32767, 32767),
        "v_down": wave(173, -32767, 32767),
        "ground_speed": wave(181, 0, 65534),
        "course": wave(191, 0, 35999),
        "h_accuracy": wave(193, 0, 65534),
        "v_accuracy": wave(197, 0, 65534),
        "s_accuracy": wave(199, 0, 65534),
        "fix": np.where(index % 7 == 3, 2, 3),
        "satellites": wave(23, 4, 12),
    }
    if still_from_s is not None:
        values["ground_speed"][index * 0.2 >= still_from_s] = 30
    late = values["itow_ms"] >= 604_800_000  # the week ends in flight
    values["itow_ms"] = np.where(late, values["itow_ms"] - 604_800_000, values["itow_ms"])
    values["week"] = values["week"] + late
    return Gps((index * 200_000 + 111_000) * 2, values)


@dataclass(slots=True)
class Script:
    """Everything that reaches the pins, and what the frames must therefore hold."""

    seconds: float
    receiver: Receiver
    imu: Imu
    gps: Gps
    analog: NDArray[np.float64] = field(repr=False)
    pressure: NDArray[np.float64] = field(repr=False)

    def give(self, sitl: Sitl) -> None:
        """Hand all stimuli to the instrument."""
        sitl.add_edges(*self.receiver.edges())
        sitl.add_packets(self.imu.start, IMU_ADDRESS, self.imu.packets())
        sitl.add_gps(*self.gps.stream())
        sitl.set_analog(0, GRID_TICKS, self.analog)
        sitl.set_pressure(COEFFICIENTS, 0, PRESSURE_TICKS, self.pressure)


def script(
    seconds: float,
    *,
    frame_us: float = 20_000.0,
    simultaneous: bool = False,
    idle_from_s: float | None = None,
) -> Script:
    """Write the script of a flight that stands on the ground from `idle_from_s` on."""
    return Script(
        seconds,
        receiver(seconds, frame_us=frame_us, simultaneous=simultaneous, idle_from_s=idle_from_s),
        imu(seconds, still_from_s=idle_from_s),
        gps(seconds, still_from_s=idle_from_s),
        analog(seconds, still_from_s=idle_from_s),
        pressure(seconds, still_from_s=idle_from_s),
    )


def analog(seconds: float, *, still_from_s: float | None = None) -> NDArray[np.float64]:
    """Return counts of the eleven channels, from 0 to the end of the last count.

    Behind `still_from_s` the pitots stand at their zero.
    """
    index = np.arange(int(seconds * TICKS_PER_S / GRID_TICKS) + 2)
    counts = np.stack(
        [triangle(index, period, 0.0, 1023.99) for period in ANALOG_PERIODS_MS], axis=1
    )
    if still_from_s is not None:
        still = index * GRID_TICKS >= still_from_s * TICKS_PER_S
        counts[still, ANALOG.index("dp_a")] = counts[still, ANALOG.index("dp_b")] = 511.5
    return counts


def pressure(seconds: float, *, still_from_s: float | None = None) -> NDArray[np.float64]:
    """Return UT from -20 to 55 degC, and UP over 19 bits: partly beyond what is possible.

    Behind `still_from_s` they are the datasheet's example.
    """
    index = np.arange(int(seconds * TICKS_PER_S / PRESSURE_TICKS) + 2)
    raw = np.stack(
        [triangle(index, 4703, 24342, 33315), triangle(index, 3301, 40_000, 524_287)], axis=1
    )
    if still_from_s is not None:
        raw[index * PRESSURE_TICKS >= still_from_s * TICKS_PER_S] = STILL_AIR
    return raw
