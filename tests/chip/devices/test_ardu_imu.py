"""The ArduIMU as master of the bus sends the packets of the schema, and its faults are as named."""

from __future__ import annotations

import binascii
import struct

import pytest
from devices.ardu_imu import ArduImu, ImuSample, MasterDeath
from simavr_bench import cycles
from simavr_bench.testing import MakeChip, run_until_value

PACKET = struct.Struct("<4BIH12hH")  # typed by hand, to fail when the schema moves


def test_imu_sends_sequenced_packets_with_crc(make_chip: MakeChip) -> None:
    chip = make_chip("twi_slave")
    imu = ArduImu(chip, rate_hz=200.0, scl_hz=400_000.0, clock_ppm=3000.0)
    imu.source = lambda time_s: ImuSample(rates=(int(time_s * 1000), -1, 2))
    imu.start(at_cycle=cycles(1e-3))
    run_until_value(chip, "packets", 100)
    assert chip.time_s == pytest.approx(0.001 + 99 / 200 / 1.003 + 0.001, abs=0.001)
    done = 100
    raw = bytes(chip.read_array("bytes", "u1")[: PACKET.size])
    assert binascii.crc_hqx(raw[:-2], 0xFFFF) == struct.unpack("<H", raw[-2:])[0]
    fields = PACKET.unpack(raw)
    assert fields[:2] == (0xA6, (done - 1) & 0xFF)
    last = imu.sent[done - 1]
    assert fields[6:9] == last.sample.rates
    assert fields[4] == pytest.approx((last.cycle - cycles(1e-3)) / 16 * 1.003, abs=2)
    assert chip.twi_results()[last.packets[0]] == PACKET.size


def test_imu_sends_the_original_pair(make_chip: MakeChip) -> None:
    chip = make_chip("twi_slave")
    imu = ArduImu(chip, original=True, rate_hz=50.0)
    imu.source = lambda _: ImuSample(specific_force=(100, 200, -8192))
    imu.start()
    chip.run_s(0.099)
    assert chip.read("packets") == 10
    assert chip.read("last_sla") == 27
    floats = struct.unpack("<8f", chip.read_array("bytes", "u1")[:32].tobytes())
    assert floats[0] == 8192.0  # minus specific force
    assert all(count == 32 for count in chip.twi_results().values())


def test_imu_faults_are_what_they_say(make_chip: MakeChip) -> None:
    chip = make_chip("twi_slave")
    imu = ArduImu(chip, rate_hz=200.0, scl_hz=400_000.0)
    imu.flip_fraction, imu.short_fraction = 0.2, 0.2
    imu.start()
    chip.run_s(1.0)
    spoilt = sum(sample.spoilt for sample in imu.sent)
    assert 40 < spoilt < 110
    results = chip.twi_results()
    short = sum(results[s.packets[0]] < PACKET.size for s in imu.sent if s.packets[0] in results)
    assert 10 < short < 60
    imu.die(MasterDeath.HOLDS_SDA, after_bytes=9)
    chip.run_s(0.1)
    packets = chip.read("packets")
    chip.run_s(0.1)
    assert chip.read("packets") == packets
    imu.revive()
    chip.run_s(0.1)
    assert chip.read("packets") >= packets + 15
