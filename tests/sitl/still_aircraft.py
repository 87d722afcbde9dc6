"""An aircraft that stands still with everything well: what a card must not disturb."""

from __future__ import annotations

import binascii
import struct
from functools import cache

import numpy as np
from host.twin.recorder.sitl_library import TICKS_PER_S, Level, Sitl
from numpy.typing import NDArray

from tests.sitl.script import COEFFICIENTS, IMU_ADDRESS, Receiver

DIRECT_UNTIL_S = 2.0
ENGAGED_BY_S = 3.0
IDLE_US, CRUISE_US, DIRECT_US, MEGA_US = 1050, 1500, 1100, 1900
SERVO_PERIOD_S = 0.020
PULSE_S = 0.0005  # of the time between two pulses, at any output
SERVOS = 4
IMU_HZ = 100


@cache
def _edges(seconds: float, throttle_up_s: float) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    frames = int(seconds * 50)
    at_s = np.arange(frames) / 50
    width_us = np.full((frames, 5), 1500)
    width_us[:, 3] = np.where(at_s < throttle_up_s, IDLE_US, CRUISE_US)
    width_us[:, 4] = np.where(at_s < DIRECT_UNTIL_S, DIRECT_US, MEGA_US)
    start = np.round(at_s * TICKS_PER_S).astype(np.int64)[:, None] + 4500 * np.arange(5)
    return Receiver(start, 2 * width_us).edges()


@cache
def _packets(seconds: float) -> tuple[NDArray[np.int64], list[bytes]]:
    """Packets of an IMU at rest: gravity, no rotation, level."""
    count = int(seconds * IMU_HZ)
    start = np.arange(count) * (TICKS_PER_S // IMU_HZ) + 3000
    packets = []
    for number, tick in enumerate(start):
        body = struct.pack("<BBBBIH9h3h", 0xA6, number & 0xFF, 0x1C, 0, int(tick) // 2, 225,
                           0, 0, 0, 0, 0, -8192, 0, 0, 0, 0, 0, 0)  # fmt: skip
        packets.append(body + struct.pack("<H", binascii.crc_hqx(body, 0xFFFF)))
    return start, packets


def give(sitl: Sitl, seconds: float, *, throttle_up_s: float) -> None:
    """Hand over receiver, IMU, barometer and analogue inputs; the Mega drives from 2 s on."""
    sitl.add_edges(*_edges(seconds, throttle_up_s))
    start, packets = _packets(seconds)
    sitl.add_packets(start, IMU_ADDRESS, packets)
    sitl.set_analog(0, 2000, np.full((1, 11), 500.0))
    sitl.set_pressure(COEFFICIENTS, 0, 20_000, np.array([[27_898.0, 180_000.0]]))


def pilot_noticed(sitl: Sitl) -> list[str]:
    """What the pilot would have noticed: the relay let go, or a servo went without a pulse."""
    noticed = []
    at, level = sitl.levels(Level.RELAY)
    if len(level) != 1 or at[0] > ENGAGED_BY_S * TICKS_PER_S:
        changes = [
            f"{t / TICKS_PER_S:.3f} s {'on' if v else 'off'}"
            for t, v in zip(at, level, strict=True)
        ]
        noticed.append(f"the relay changed at {', '.join(changes) or 'no time'}")
    start, output, _ = sitl.pulses()
    for servo in range(SERVOS):
        mine = start[output == servo]
        mine = np.append(mine[mine > ENGAGED_BY_S * TICKS_PER_S], sitl.now())
        gap_s = float(np.diff(mine).max(initial=0)) / TICKS_PER_S
        if len(mine) < 2 or gap_s > SERVO_PERIOD_S + PULSE_S:
            noticed.append(f"servo {servo} saw no pulse for {1000 * gap_s:.1f} ms")
    return noticed
