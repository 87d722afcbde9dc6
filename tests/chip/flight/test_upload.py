"""`pio run -t upload` as a user runs it, into Debian's real bootloader; what arrived records."""

from __future__ import annotations

import ctypes
from pathlib import Path

import pytest
from flight.images import upload
from flight.rig import CRUISE_US, FlightRig, check_card, make_card, take_log
from simavr_bench import read_image
from simavr_bench.pty_bridge import PtyBridge

import host

BOOT_SECTION = 0x3E000


def test_uploaded_flash_boots_and_records(flight_elf: Path, tmp_path: Path) -> None:
    card = make_card(tmp_path / "card.img")
    rig = FlightRig(flight_elf, card, bootloader=True, ground_s=3600.0)
    chip = rig.chip
    ctypes.memset(chip.library.bench_flash(chip.handle), 0xFF, BOOT_SECTION)
    rig.power_on()
    chip.run_s(0.1)
    assert chip.pc >= BOOT_SECTION
    with PtyBridge(chip, 0, reset_on_open=True) as bridge:
        said = upload("mega2560", bridge)
    assert "verified" in said
    for address, piece in read_image(flight_elf).flash.items():
        assert chip.flash(address, len(piece)) == piece

    chip.run_s(11.0)
    assert chip.pc < BOOT_SECTION
    assert any("mega2560" in line for line in rig.status_lines())
    rig.receiver.width_us[3] = CRUISE_US
    chip.run_s(4.0)
    rig.land()
    check_card(card)
    log = host.read_log(take_log(card, tmp_path / "flight.bin"))
    assert not log.loss.any
    assert len(log.frames["ident"]) == pytest.approx(260, abs=60)
    assert log.frames["identity"]["board"][0] == b"mega2560"
