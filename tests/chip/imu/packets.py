"""Packets of the IMU as they went over the bus, and what each must be (protocol/frames.toml)."""

from __future__ import annotations

import binascii
import struct
from dataclasses import dataclass

from devices.ardu_imu import FIRST_ADDRESS, SECOND_ADDRESS, SEQUENCED, SEQUENCED_ADDRESS
from simavr_bench import I2cBus

STATUS_AUX = 2


@dataclass(frozen=True, slots=True)
class ImuPacket:
    """One packet `imu`; raw numbers."""

    start: int  # cycle of the IMU's clock at START
    seq: int
    flags: int
    aux_kind: int
    t_us: int
    age_us: int
    rates: tuple[int, int, int]
    force: tuple[int, int, int]
    angles_cdeg: tuple[int, int, int]
    aux: tuple[int, int, int]


def imu_packets(bus: I2cBus) -> list[ImuPacket]:
    """Give every whole packet written since the bus logs bytes.

    Raises
    ------
    AssertionError
        If one has the wrong length, kind or CRC.
    """
    packets = []
    for transfer in bus.writes():
        if transfer.address != SEQUENCED_ADDRESS or not transfer.whole:
            continue
        data = transfer.data
        if len(data) != SEQUENCED.size:
            raise AssertionError(f"a packet of {len(data)} bytes, expected {SEQUENCED.size}")
        if binascii.crc_hqx(data[:-2], 0xFFFF) != int.from_bytes(data[-2:], "little"):
            raise AssertionError("a packet whose CRC is wrong")
        kind, seq, flags, aux_kind, t_us, age, *v = SEQUENCED.unpack(data)
        if kind != 0xA6:
            raise AssertionError(f"a packet of kind {kind:#x}, expected 0xa6")
        packets.append(
            ImuPacket(
                transfer.start, seq, flags, aux_kind, t_us, 4 * age,
                (v[0], v[1], v[2]), (v[3], v[4], v[5]), (v[6], v[7], v[8]), (v[9], v[10], v[11]),
            )
        )  # fmt: skip
    return packets


def original_packets(bus: I2cBus) -> list[tuple[float, ...]]:
    """Give every pair of original packets as sixteen numbers."""
    pairs = []
    first: tuple[float, ...] | None = None
    for transfer in bus.writes():
        if len(transfer.data) != 32 or not transfer.whole:
            continue
        values = struct.unpack("<8f", transfer.data)
        if transfer.address == FIRST_ADDRESS:
            first = values
        elif transfer.address == SECOND_ADDRESS and first is not None:
            pairs.append((*first, *values))
            first = None
    return pairs
