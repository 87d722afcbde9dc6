"""The packets that the IMU sends to the Mega over their bus: layout and check of each."""

from __future__ import annotations

import binascii
import json
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.resources import resource
from host.wire.schema import Field

CRC = "crc"  # name of a packet's last field: CRC-16/CCITT-FALSE over all bytes before it


@dataclass(frozen=True)
class Packet:
    """One kind of packet.

    Attributes
    ----------
    name : str
        As in protocol/frames.toml.
    address : int
        The Mega's, on the bus.
    fields : tuple of Field
    always : dict of str to int
        Fields that hold one value in every packet.
    """

    name: str
    address: int
    fields: tuple[Field, ...]
    always: dict[str, int]

    @cached_property
    def dtype(self) -> np.dtype[Any]:
        """Packed little-endian layout of the whole packet."""
        return np.dtype([(field.name, field.numpy_type) for field in self.fields])

    def scale(self, name: str) -> float:
        """Return one raw step of a field in its unit; KeyError if there is no such field."""
        return {field.name: field.scale for field in self.fields}[name]

    def rows(self, count: int) -> NDArray[np.void]:
        """Return `count` packets of zeros, with the constant fields in place."""
        rows = np.zeros(count, dtype=self.dtype)
        for name, value in self.always.items():
            rows[name] = value
        return rows

    def sealed(self, rows: NDArray[np.void]) -> list[bytes]:
        """Return the bytes of each packet, its CRC put in where the layout has one."""
        size = self.dtype.itemsize
        data = rows.tobytes()
        whole = [data[i : i + size] for i in range(0, len(data), size)]
        if self.fields[-1].name != CRC:
            return whole
        bodies = [packet[:-2] for packet in whole]
        return [body + binascii.crc_hqx(body, 0xFFFF).to_bytes(2, "little") for body in bodies]


@cache
def packet(name: str) -> Packet:
    """Return a kind of packet by its name in protocol/frames.toml; KeyError if there is none."""
    table = json.loads(resource("packets.json").read_text(encoding="ascii"))["packets"][name]
    fields = tuple(
        Field(name=field, type=kind, unit=unit, scale=float(scale))
        for field, kind, unit, scale in table["fields"]
    )
    return Packet(name, table["address"], fields, table["always"])
