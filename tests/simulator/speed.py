"""Print how fast the simulator runs with every device active.

Run from the root of the repository: ``python tests/simulator/speed.py [simulated seconds]``.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from simavr_bench import ChargePumpRelay, Chip, GpsUart, Receiver, SdCard, cycles

from build import build_program


def _send_packets(chip: Chip, number: int = 0) -> None:
    """Send 36 bytes to address 43 on the two-wire bus, 200 times a second."""
    chip.twi_send(43, bytes([number & 0xFF] * 36), at_cycle=chip.cycle + cycles(3e-4), scl_hz=4e5)
    chip.at(chip.cycle + cycles(0.005), lambda: _send_packets(chip, number + 1))


def everything(program: Path) -> Chip:
    """Make a chip that runs a program with all devices at the recorder's rates.

    Parameters
    ----------
    program : Path
        ELF; ``programs/everything.c`` never sleeps.

    Returns
    -------
    Chip
        Powered and ready to run.
    """
    chip = Chip(startup_s=0.0)
    chip.load(program)
    pins = [f"PK{i}" for i in range(5)]
    Receiver(chip, pins, frame_s=0.020, jitter_us=2.0).start()
    _send_packets(chip)
    gps = GpsUart(chip, 2, baud=38400, nmea=False, period_ms=200)
    gps.enabled = {(1, 2), (1, 6), (1, 18)}
    gps.start()
    for channel in range(16):
        chip.analog(channel, 0.3 * channel, noise_lsb=0.5)
    card = SdCard(chip, "PB0", busy_s=0.005)
    for k in range(1, 400):
        card.stall(0.25, at_cycle=k * 48_000_000)
    servos = {"a": ("PK0", "PE4"), "b": ("PK1", "PE5"), "c": ("PK2", "PE3")}
    ChargePumpRelay(chip, "PH5", servos, sense="PH6")
    chip.power_on()
    return chip


def main() -> int:
    """Measure and print."""
    simulated_s = float(sys.argv[1]) if len(sys.argv) > 1 else 20.0
    with everything(build_program("everything")) as chip:
        began, began_cpu = time.perf_counter(), time.process_time()
        chip.run_s(simulated_s)
        wall_s, cpu_s = time.perf_counter() - began, time.process_time() - began_cpu
        ratio = simulated_s / wall_s
        print(f"{simulated_s:.0f} s simulated in {wall_s:.2f} s: {ratio:.1f} x real time")
        print(f"  on a free core {simulated_s / cpu_s:.1f} x ({cpu_s:.2f} s of CPU)")
        for name in ("edges", "packets", "scans", "gps_bytes", "ticks", "next_block", "loops"):
            print(f"  {name:10} {chip.read(name)}")
        print(f"  records    {len(chip.log())}, CPU {100 * chip.load_now().busy_fraction:.1f} %")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
