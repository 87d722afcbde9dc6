"""`pio run -e arduimu -t upload` as a user runs it, into the board's real bootloader (Debian's)."""

from __future__ import annotations

import ctypes
from pathlib import Path

from devices.ardu_imu import SEQUENCED
from flight.images import upload
from imu.packets import imu_packets
from imu.record import ImuRecord, read_record
from imu.rig import BOOTLOADER
from simavr_bench import Chip, I2cBus, Mpu6000, ResetCause, read_image
from simavr_bench.pty_bridge import PtyBridge

BOOT_SECTION = 0x7800


def test_uploaded_flash_sends_samples_and_keeps_the_offsets(imu_elf: Path) -> None:
    kept = ImuRecord(rate_offset=(11, -22, 33), declination_cdeg=-70, offsets_valid=1)
    with Chip(model="atmega328p", bootloader=True, startup_s=0.065) as chip:
        chip.load(BOOTLOADER)
        ctypes.memset(chip.library.bench_flash(chip.handle), 0xFF, BOOT_SECTION)
        chip.load(kept.image())
        bus = I2cBus(chip)
        bus.listen(SEQUENCED.address)
        bus.log_bytes()
        Mpu6000(chip)
        chip.power_on()
        chip.run_s(0.1)
        assert chip.pc >= BOOT_SECTION
        with PtyBridge(chip, 0, baud=57_600.0, reset_on_open=True) as bridge:
            said = upload("arduimu", bridge)
        assert "verified" in said
        for address, piece in read_image(imu_elf).flash.items():
            assert chip.flash(address, len(piece)) == piece
        chip.run_s(3.0)
        assert chip.pc < BOOT_SECTION
        before = len(imu_packets(bus))
        chip.run_s(0.5)
        assert 95 <= len(imu_packets(bus)) - before <= 101
        assert read_record(chip) == kept
        # In flight too a reset passes the bootloader, and costs the time it waits for an upload.
        chip.reset(ResetCause.BROWN_OUT)
        chip.run_s(4.0)
        assert chip.pc < BOOT_SECTION
        assert read_record(chip) == kept
