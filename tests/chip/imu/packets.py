"""Packets of the IMU as they went over the bus, and what each must be (protocol/frames.toml)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from devices.ardu_imu import ANGLES, FIRST, FORCES, RATES, SECOND, SEQUENCED
from host.wire.schema_text import packed_schema
from simavr_bench import I2cBus

MAGNETOMETER, GYRO_BIAS, STATUS = (
    packed_schema().number("imu_aux", word) for word in ("magnetometer", "gyro_bias", "status")
)
ADDRESSES = (SEQUENCED.address, FIRST.address, SECOND.address)


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
        if transfer.address != SEQUENCED.address or not transfer.whole:
            continue
        data = transfer.data
        if len(data) != SEQUENCED.dtype.itemsize:
            raise AssertionError(
                f"a packet of {len(data)} bytes, expected {SEQUENCED.dtype.itemsize}"
            )
        row = np.frombuffer(data, SEQUENCED.dtype)
        if SEQUENCED.sealed(row)[0] != data:
            raise AssertionError("a packet whose CRC is wrong")
        if row["kind"] != SEQUENCED.always["kind"]:
            raise AssertionError(f"a packet of kind {int(row['kind'][0]):#x}")
        rates, force, angles = (
            (int(row[x][0]), int(row[y][0]), int(row[z][0])) for x, y, z in (RATES, FORCES, ANGLES)
        )
        x, y, z = row["aux"][0].tolist()
        seq, flags, aux_kind, t_us, age = (
            int(row[name][0]) for name in ("seq", "flags", "aux_kind", "t_us", "age")
        )
        age_us = round(age * SEQUENCED.scale("age"))
        packets.append(
            ImuPacket(
                transfer.start, seq, flags, aux_kind, t_us, age_us, rates, force, angles, (x, y, z)
            )
        )
    return packets


def original_packets(bus: I2cBus) -> list[tuple[float, ...]]:
    """Give every pair of original packets as sixteen numbers."""
    pairs = []
    first: tuple[float, ...] | None = None
    for transfer in bus.writes():
        if len(transfer.data) != FIRST.dtype.itemsize or not transfer.whole:
            continue
        values = tuple(np.frombuffer(transfer.data, "<f4").tolist())
        if transfer.address == FIRST.address:
            first = values
        elif transfer.address == SECOND.address and first is not None:
            pairs.append((*first, *values))
            first = None
    return pairs
