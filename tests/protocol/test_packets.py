"""The packets' layout as programs read it: bytes, constants, CRC, against a vector made by hand."""

from __future__ import annotations

import struct

import pytest
from host.wire.packets import packet

from tests.protocol.log_writer import crc16


def test_check_value_of_the_crc() -> None:
    assert crc16(b"123456789") == 0x29B1


def test_imu_packet_is_the_vector() -> None:
    imu = packet("imu")
    rows = imu.rows(2)
    rows["seq"], rows["flags"], rows["aux_kind"] = (7, 8), 0x1C, 2
    rows["t_us"], rows["age"] = 123_456_789, 225
    rows["p"], rows["az"], rows["psi"] = -1, -8192, 18_000
    rows["aux"] = (3150, 0x54 + 256 * 3, 1)
    body = struct.pack("<4BIH", 0xA6, 8, 0x1C, 2, 123_456_789, 225)
    body += struct.pack("<12h", -1, 0, 0, 0, 0, -8192, 0, 0, 18_000, 3150, 852, 1)
    assert imu.sealed(rows)[1] == body + struct.pack("<H", crc16(body))
    assert imu.address == 43


def test_original_pair_has_no_check() -> None:
    first, second = packet("original_imu_1"), packet("original_imu_2")
    assert (first.address, second.address) == (42, 27)
    rows = second.rows(1)
    rows[0] = (8192.0, 25.05, 121.5, 30.0, 0.0, 0.0, 1.0, 8.0)
    assert second.sealed(rows) == [struct.pack("<8f", *rows[0])]
    assert first.dtype.itemsize == 32


def test_unknown_packet_is_an_error() -> None:
    with pytest.raises(KeyError):
        packet("nothing")
