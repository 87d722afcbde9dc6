"""Measure the flight image on the simulated chip, every device at its real rate.

    make flight-bench          ten simulated minutes at 100 Hz and at 200 Hz

Simulation only: cycles and bytes are those of the image, times those of the device models.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from flight.rig import FlightRig, build_flight_image, check_card, make_card, sine, take_log
from flight.settings import settings_image
from numpy.typing import NDArray
from simavr_bench import Chip

VECTORS = {
    11: "PCINT2 receiver",
    13: "TIMER2 1 ms",
    29: "ADC",
    39: "TWI",
    50: "TIMER5 overflow",
    51: "USART2 RX",
    52: "USART2 UDRE",
    55: "USART3 UDRE",
}
CPU_LIMIT_PERCENT = {100: 35.0, 200: 50.0}
STALL_MS = {100: 500.0, 200: 250.0}
STACK_LIMIT_BYTES = 600
RAM_LIMIT_BYTES = 6600


def row(name: str, value: str, limit: str = "", ok: bool | None = None) -> None:
    """Print one line of the table."""
    verdict = "" if ok is None else ("ok" if ok else "MISSED")
    print(f"  {name:34} {value:>28}  {limit:16} {verdict}")


def pulse_errors_us(chip: Chip, rig: FlightRig, since: int) -> NDArray[np.float64]:
    """Errors of the servo pulses against the receiver pulses they repeat, shape (n,)."""
    errors: list[float] = []
    for channel, pin in enumerate(("PE4", "PE5", "PB5")):
        sent = np.array([(e - s, e) for c, s, e in rig.receiver.sent if c == channel and e > since])
        at, level = chip.edges(pin)
        starts = at[level == 1].astype(np.int64)
        starts = starts[starts > since + 16_000_000]
        ends = at[level == 0].astype(np.int64)
        ends = ends[np.searchsorted(ends, starts[0]) :]
        for start, end in zip(starts, ends, strict=False):
            last = np.searchsorted(sent[:, 1], start)
            recent = sent[max(0, last - 4) : last, 0]
            errors.append(float(np.min(np.abs(recent - (end - start)))) / 16)
    return np.array(errors)


def measure(elf: Path, rate_hz: int, minutes: float, folder: Path) -> bool:
    """Fly one rate and print its table; True if every limit holds."""
    import host

    card = make_card(folder / f"card{rate_hz}.img")
    rig = FlightRig(elf, card, imu_hz=float(rate_hz))
    rig.chip.load(settings_image(rate_hz=rate_hz))
    sticks = [sine(2.0, 1100, 1900), sine(3.0, 1200, 1800), sine(2.5, 1150, 1850)]
    rig.take_off()
    chip = rig.chip
    chip.watch("PE4", "PE5", "PB5")
    chip.clear_statistics()
    since = chip.cycle
    rng = np.random.default_rng(1)
    stall_s = STALL_MS[rate_hz] / 1000
    end = since + round(minutes * 60 * 16e6)
    at = since
    while at < end:
        # every 3 s, at any phase to blocks, frames and schema; never two behind each other
        rig.card.stall(stall_s, at_cycle=at + int(rng.integers(16_000_000)))
        at += 3 * 16_000_000
    rig.receiver.source = lambda t: [*(stick(t) for stick in sticks), 1500.0, 1900.0]
    first = len(rig.imu.sent)
    chip.run_until(end)
    load = chip.load_now()
    vectors = {name: chip.interrupt(number) for number, name in VECTORS.items()}
    errors_us = pulse_errors_us(chip, rig, since)
    sent = len(rig.imu.sent) - first
    engaged = rig.relay.engaged
    written = rig.card.count().written
    rig.land()
    check_card(card)
    log = host.read_log(take_log(card, folder / f"flight{rate_hz}.bin"))
    system = log.frames["system"]
    ident = log.frames["ident"]
    stack = int(system["stack_free_min"].min())

    print(f"{rate_hz} Hz, {minutes:g} min, stalls of {stall_s * 1e3:.0f} ms every 3 s, 5 ms else")
    busy = 100 * load.busy_fraction
    limit = CPU_LIMIT_PERCENT[rate_hz]
    checks = [busy <= limit]
    row("CPU load", f"{busy:.1f} %", f"<= {limit:.0f} %", checks[-1])
    checks.append(stack >= STACK_LIMIT_BYTES)
    row("stack never touched", f"{stack} B", f">= {STACK_LIMIT_BYTES} B", checks[-1])
    p99, most = float(np.percentile(errors_us, 99)), float(errors_us.max())
    checks.append(p99 <= 3.0 and most <= 5.0)
    row(
        "servo pulse against received p99, max",
        f"{p99:.2f}, {most:.2f} us",
        "<= 3, 5 us",
        checks[-1],
    )
    checks.append(not log.loss.any)
    row("losses", "none" if checks[-1] else f"{log.loss.frames} frames", "none", checks[-1])
    gaps = int(np.sum(np.diff(ident["imu_seq"].astype(np.uint8)) != 1))
    checks.append(gaps == 0)
    row("IMU samples sent, in the log", f"{sent}, {len(ident)}", "each once", checks[-1])
    checks.append(engaged)
    row("relay engaged to the end", str(engaged), "True", engaged)
    row("ring: least room", f"{int(system['ring_free_min'].min())} B")
    loops = system["loop_max_us"]
    row("main loop, longest turn p50, max", f"{np.median(loops):.0f}, {loops.max()} us")
    seconds = minutes * 60
    row("card", f"{written * 512 / seconds / 1000:.1f} kB/s")
    print(f"  {'interrupt':22} {'per s':>8} {'latency p50 p99 max':>22} {'length p50 p99 max':>22}")
    for name, v in vectors.items():
        latency = f"{v.latency_p50} {v.latency_p99} {v.latency_max}"
        length = f"{v.length_p50} {v.length_p99} {v.length_max}"
        print(f"  {name:22} {v.count / seconds:8.0f} {latency:>22} {length:>22}  cycles")
    return all(checks)


def main() -> int:
    """Print the tables; 0 if every limit holds, else 6."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--minutes", type=float, default=10.0, help="simulated (default 10)")
    parser.add_argument("--rate", type=int, action="append", choices=sorted(STALL_MS))
    options = parser.parse_args()
    elf = build_flight_image()
    size = subprocess.run(["avr-size", str(elf)], capture_output=True, text=True, check=True)
    text, data, bss = map(int, size.stdout.splitlines()[1].split()[:3])
    ram_ok = data + bss <= RAM_LIMIT_BYTES
    row("flash", f"{text + data} B", "<= 253952 B", text + data <= 253952)
    row("static RAM", f"{data + bss} B", f"<= {RAM_LIMIT_BYTES} B", ram_ok)
    good = ram_ok
    with tempfile.TemporaryDirectory() as folder:
        for rate_hz in options.rate or sorted(STALL_MS):
            good &= measure(elf, rate_hz, options.minutes, Path(folder))
    return 0 if good else 6


if __name__ == "__main__":
    sys.exit(main())
