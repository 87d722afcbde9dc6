"""Debian's real Mega bootloader takes an upload from avrdude over a pseudo-terminal."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
import time
from pathlib import Path
from types import ModuleType

import pytest
from simavr_bench import Chip, read_image
from simavr_bench.pty_bridge import PtyBridge

BOOTLOADER = Path(
    "/usr/share/arduino/hardware/arduino/avr/bootloaders/stk500v2/stk500boot_v2_mega2560.hex"
)


def bootloader_chip() -> Chip:
    chip = Chip(bootloader=True)
    chip.load(BOOTLOADER)
    return chip


def test_bootloader_starts_an_application_after_its_wait(build: ModuleType) -> None:
    with bootloader_chip() as chip:
        chip.load(build.build_program("reset"))
        chip.watch("PA5")
        chip.drive("PK0", True)
        chip.power_on()
        chip.run_s(0.06)
        assert chip.pc >= 0x3E000
        chip.run_s(3.0)
        assert chip.read("finished") == 1
        assert chip.pc < 0x3E000


def test_blank_chip_stays_in_the_bootloader(build: ModuleType) -> None:
    with bootloader_chip() as chip:
        chip.power_on()
        chip.run_s(3.0)
        assert chip.pc >= 0x3E000
        assert chip.flash(0, 256) == b"\xff" * 256


def test_chip_waits_for_a_program_that_stands_still() -> None:
    with bootloader_chip() as chip:
        chip.power_on()
        chip.run_s(0.1)
        with PtyBridge(chip, 0, reset_on_open=True) as bridge:
            terminal = os.open(bridge.path, os.O_RDWR | os.O_NOCTTY)
            began_s, from_s = time.monotonic(), chip.time_s
            try:
                bridge.serve(lambda: time.monotonic() - began_s > 1.0)
            finally:
                os.close(terminal)
            waited_s = time.monotonic() - began_s
        started_s = 0.1  # after the reset of an opened terminal
        passed_s = chip.time_s - from_s - started_s
        assert passed_s <= bridge.BUSY_S + bridge.WAITING * waited_s + 2.0 * bridge.SLICE_S


@pytest.mark.parametrize("program", ["everything"])
def test_avrdude_uploads_through_the_bootloader(
    build: ModuleType, tmp_path: Path, program: str
) -> None:
    elf = build.build_program(program)
    image = read_image(elf)
    hex_file = tmp_path / "upload.hex"
    subprocess.run(["avr-objcopy", "-O", "ihex", elf, hex_file], check=True)
    with bootloader_chip() as chip:
        chip.power_on()
        chip.run_s(0.1)
        with PtyBridge(chip, 0, reset_on_open=True) as bridge:
            avrdude = subprocess.Popen(
                ["avrdude", "-p", "atmega2560", "-c", "wiring", "-P", bridge.path,
                 "-b", "115200", "-D", "-U", f"flash:w:{hex_file}:i"],
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            )  # fmt: skip
            stopped: list[threading.Timer] = []

            def done() -> bool:
                """A busy computer: in mid-upload avrdude stands still for longer than a second."""
                if not stopped and chip.flash(0, 2) != b"\xff\xff":
                    avrdude.send_signal(signal.SIGSTOP)
                    stopped.append(threading.Timer(1.5, avrdude.send_signal, [signal.SIGCONT]))
                    stopped[0].start()
                return avrdude.poll() is not None

            try:
                bridge.serve(done, limit_s=240.0)
            finally:
                avrdude.kill()
            text = avrdude.communicate()[0]
        assert stopped
        assert avrdude.returncode == 0, text
        for address, piece in image.flash.items():
            assert chip.flash(address, len(piece)) == piece
        chip.symbols.update(image.symbols)
        chip.run_s(2.0)
        assert chip.read("ticks") > 100
