"""Fly both images on one bus: every sample of the IMU against the decoded log of the Mega.

    make imu-bench                              ten simulated minutes at 200 Hz
    make imu-bench IMU_BENCH="--minutes 1"

Simulation only: cycles and bytes are those of the images, times those of the models.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from compilers import TESTED
from flight.bench.report import built_by
from flight.bench.table import Table
from flight.images import build_image
from flight.rig import make_card
from image_hash import image_hash
from imu.link import Link, run_link
from imu.rig import PairRig
from simavr_bench import Chip
from stack_depth import analyse, room_bytes

FLASH_LIMIT_BYTES = 30_720  # of 32 768; 2 KiB hold the bootloader
CPU_LIMIT_PERCENT = 60.0
INSTANT_LIMIT_US = 50.0
UNTOUCHED_BYTES = 300
VECTORS = {
    1: "INT0 data-ready",
    11: "TIMER1 wake",
    13: "TIMER1 overflow",
    14: "TIMER0 1 ms",
    18: "USART RX",
    24: "TWI",
}


def image_rows(table: Table, elf: Path) -> int:
    """Print flash, RAM and the computed depth of the stack; give that depth in bytes."""
    size = subprocess.run(["avr-size", str(elf)], capture_output=True, text=True, check=True)
    text, data, bss = map(int, size.stdout.splitlines()[1].split()[:3])
    depth = analyse(elf, chip="atmega328p").total_bytes
    table.head(f"IMU image {image_hash(elf):08x}, {built_by(elf)}, on an ATmega328P")
    table.at_most("flash", text + data, FLASH_LIMIT_BYTES, "B")
    table.row("static RAM", f"{data + bss} B of 2048 B")
    room = room_bytes(elf, chip="atmega328p")
    table.at_most("stack: computed worst case", depth, room, "B")
    return depth


def link_rows(table: Table, link: Link, depth_bytes: int) -> None:
    """Print what a flight of both images gave."""
    table.at_most("CPU load at 200 Hz", 100 * link.imu_load, CPU_LIMIT_PERCENT, "%", 1)
    seen_bytes = link.stack_room - link.stack_untouched
    table.at_least("stack never touched", link.stack_untouched, UNTOUCHED_BYTES, "B")
    table.row("stack: seen, computed", f"{seen_bytes}, {depth_bytes} B", "seen <= computed",
              ok=seen_bytes <= depth_bytes)  # fmt: skip
    seen = link.match
    table.row("samples made, once in the log", f"{seen.made}, {seen.once}", "each once",
              ok=seen.made == seen.once)  # fmt: skip
    table.none_of("rows that are no sample", seen.foreign)
    table.none_of("frames lost", link.lost_frames)
    table.none_of("packets lost, as the Mega counts", link.imu_lost)
    table.none_of("packets bad, as the Mega counts", link.imu_bad)
    low, middle, high = np.percentile(seen.error_us, [1, 50, 99])
    table.row("instant less truth p1 p50 p99", f"{low:.1f} {middle:.1f} {high:.1f} us")
    most_us = float(np.max(np.abs(seen.error_us)))
    table.at_most("instant, largest error", most_us, INSTANT_LIMIT_US, "us", 1)
    table.row("magnetometer frames", f"{link.field_frames}", "some", ok=link.field_frames > 0)
    table.row("transfers, refused", f"{link.transfers}, {link.refused}")
    table.row("the Mega's CPU load", f"{100 * link.mega_load:.1f} %")
    table.none_of("outside the models", link.faults)


def interrupt_rows(chip: Chip, seconds: float) -> None:
    """Print latency and length of the IMU's interrupts."""
    print(f"  {'interrupt':22} {'per s':>8} {'latency p50 p99 max':>22} {'length max':>12}")
    for number, title in VECTORS.items():
        v = chip.interrupt(number)
        latency = f"{v.latency_p50} {v.latency_p99} {v.latency_max}"
        print(f"  {title:22} {v.count / seconds:8.0f} {latency:>22} {v.length_max:>12}  cycles")


def main() -> int:
    """Print the table; 0 if every limit holds, else 6."""
    parser = argparse.ArgumentParser(
        prog="imu.bench", description="Fly both images on one simulated bus (simulation only)."
    )
    parser.add_argument("--minutes", type=float, default=10.0, help="simulated (default 10)")
    parser.add_argument("--gcc", action="append", choices=TESTED, help="compiler (default both)")
    parser.add_argument("--clock-ppm", type=float, default=3000.0, help="IMU's against the Mega's")
    parser.add_argument("--mpu-ppm", type=float, default=-8000.0, help="sensor's against the IMU's")
    asked = parser.parse_args()
    if not 0.05 <= asked.minutes <= 60:
        parser.error(f"--minutes {asked.minutes:g}: expected 0.05 to 60")
    table = Table()
    try:
        pairs = [
            (build_image("arduimu", gcc), build_image("mega2560", gcc))
            for gcc in asked.gcc or TESTED
        ]
    except RuntimeError as error:
        print(error, file=sys.stderr)
        return 6
    for imu_elf, mega_elf in pairs:
        fly_pair(table, imu_elf, mega_elf, asked)
    if table.missed:
        print(f"\nmissed: {', '.join(table.missed)}")
        return 6
    print("\nevery limit holds")
    return 0


def fly_pair(table: Table, imu_elf: Path, mega_elf: Path, asked: argparse.Namespace) -> None:
    """Fly both images of one compiler and print what is asked of them."""
    depth_bytes = image_rows(table, imu_elf)
    with tempfile.TemporaryDirectory() as name:
        card = make_card(Path(name) / "card.img")
        rig = PairRig(mega_elf, imu_elf, card, clock_ppm=asked.clock_ppm, mpu_ppm=asked.mpu_ppm)
        link = run_link(rig, asked.minutes * 60, Path(name))
        table.head(
            f"on one bus with the Mega, 200 Hz, {asked.minutes:g} min; clock of the IMU "
            f"{asked.clock_ppm:+g} ppm, of its sensor {asked.mpu_ppm:+g} ppm"
        )
        link_rows(table, link, depth_bytes)
        interrupt_rows(rig.board.chip, asked.minutes * 60)
        rig.close()


if __name__ == "__main__":
    sys.exit(main())
