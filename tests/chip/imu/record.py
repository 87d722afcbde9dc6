"""The IMU's record in EEPROM (firmware/core/imu/record.h): offsets and what the user chose."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

from simavr_bench import Chip, Image

MAGIC, VERSION = 0x4941, 1
_SETTINGS = struct.Struct("<11h3B")
_SIZE = 4 + _SETTINGS.size + 4


@dataclass(frozen=True, slots=True)
class ImuRecord:
    """Counts in body axes: 65.5 per deg/s, 8192 per g, 1090 per gauss; angles in 0.01 deg."""

    rate_offset: tuple[int, int, int] = (0, 0, 0)
    force_offset: tuple[int, int, int] = (0, 0, 0)
    field_offset: tuple[int, int, int] = (0, 0, 0)
    declination_cdeg: int = 413
    offsets_cdegc: int = 0
    offsets_valid: int = 0
    dlpf: int = 2
    compat: int = 0

    def image(self) -> Image:
        """Give an EEPROM that holds it."""
        body = _SETTINGS.pack(
            *self.rate_offset, *self.force_offset, *self.field_offset,
            self.declination_cdeg, self.offsets_cdegc,
            self.offsets_valid, self.dlpf, self.compat,
        )  # fmt: skip
        record = struct.pack("<HBB", MAGIC, VERSION, len(body)) + body
        return Image(flash={}, eeprom={0: record + struct.pack("<I", zlib.crc32(record))})


def read_record(chip: Chip) -> ImuRecord | None:
    """Give what the chip's EEPROM holds now, or nothing where its check fails."""
    data = chip.eeprom()[:_SIZE]
    if zlib.crc32(data[:-4]) != int.from_bytes(data[-4:], "little"):
        return None
    v = _SETTINGS.unpack(data[4:-4])
    return ImuRecord(v[0:3], v[3:6], v[6:9], *v[9:])
