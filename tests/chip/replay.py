"""Fly the recorder's ELF through recorded stimuli in the chip simulator.

A program to be started by path; what it needs and leaves are files::

    python tests/chip/replay.py firmware.elf stimuli.npz card.img [--eeprom eeprom.bin]
        [--close-s 20] [--busy-ms 1] [--servos servos.npz]
        [--fault card_busy:12.5:500] [--fault power_cut:30]

The card's image is changed in place. One JSON object on stdout tells what happened; a line per ten
per cent goes to stderr. Exit 0, or 2 when a file is missing or not what it should be.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "simulator"))  # started by path, from anywhere

from devices.stimuli import Replay, adc_channel, read_stimuli, signal_pins  # noqa: E402
from simavr_bench import Chip, cycles  # noqa: E402
from simavr_bench.log import LogKind, pulses  # noqa: E402

SERVOS = ("servo_aileron", "servo_elevator", "servo_rudder", "servo_throttle")
TICKS_PER_S = 2_000_000
PITOT_ZERO_V = 2.5
_IDLE_US = (1500, 1500, 1500, 1000, 1000)


def _arguments(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Fly an ELF through recorded stimuli.")
    parser.add_argument("elf", type=Path)
    parser.add_argument("stimuli", type=Path)
    parser.add_argument("card", type=Path)
    parser.add_argument("--eeprom", type=Path, help="4096 bytes the chip starts with")
    parser.add_argument("--close-s", type=float, default=0.0, help="second power-on of this length")
    parser.add_argument("--busy-ms", type=float, default=1.0, help="card busy after each block")
    parser.add_argument("--servos", type=Path, help="write the output pulses here (.npz)")
    parser.add_argument(
        "--fault",
        action="append",
        default=[],
        metavar="KIND:AT_S[:VALUE]",
        help="card_busy (ms), card_reject (blocks), card_absent, card_removed, card_inserted, "
        "baro_off, baro_on, baro_bus_stuck, baro_bus_free, supply (V), reset (cause), power_cut; "
        "may be given several times",
    )
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args(argv)


def _plan_faults(flight: Replay, faults: list[str], end: int) -> int:
    """Plan all faults; gives the tick at which power goes."""
    for fault in faults:
        kind, at_s, *value = fault.split(":")
        at = round(float(at_s) * TICKS_PER_S)
        if kind == "power_cut":
            end = min(end, at)
        else:
            flight.plan(kind, at, float(value[0]) if value else 0.0)
    return end


def _report_progress() -> Callable[[float], None]:
    last = [-1]

    def report(share: float) -> None:
        tenth = int(share * 10)
        if tenth != last[0]:
            last[0] = tenth
            print(f"{tenth * 10} %", file=sys.stderr)

    return report


def _close_at_bench(chip: Chip, lines: list[str], pitots: list[int], time_s: float) -> None:
    # Standing still: the recorder closes the file of the flight it finds.
    chip.run_s(0.5)
    for channel in pitots:
        chip.analog(channel, PITOT_ZERO_V)
    chip.power_on()
    for frame in range(int(time_s / 0.02)):
        at = chip.cycle + cycles(0.02 * frame)
        for line, width_us in zip(lines, _IDLE_US, strict=True):
            chip.drive(line, True, at_cycle=at)
            chip.drive(line, False, at_cycle=at + width_us * 16)
    chip.run_s(time_s)
    chip.power_off()


def main(argv: list[str] | None = None) -> int:
    """Run; see the top of the file."""
    options = _arguments(argv)
    try:
        stimuli = read_stimuli(options.stimuli)
        pins = signal_pins(ROOT / "hw" / "pin_map.toml")
        chip = Chip(seed=options.seed, startup_s=0.0)
        chip.load(options.elf)
        if options.eeprom is not None:
            chip.set_eeprom(options.eeprom.read_bytes())
        flight = Replay(chip, stimuli, pins, options.card, busy_s=options.busy_ms * 1e-3)
        end = _plan_faults(flight, options.fault, stimuli.duration)
    except (OSError, ValueError) as error:
        print(f"replay: {error}", file=sys.stderr)
        return 2
    with chip:
        chip.watch(*(pins[name] for name in SERVOS))
        began_s = time.perf_counter()
        chip.power_on()
        flight.run(end, progress=_report_progress())
        wall_s = time.perf_counter() - began_s
        simulated_s = chip.time_s
        load = chip.load_now().busy_fraction
        chip.power_off()
        if options.close_s > 0:
            pitots = [adc_channel(pins[name]) for name in ("dp_a", "dp_b")]
            lines = [pins[f"rc_{i}"] for i in range(5)]
            _close_at_bench(chip, lines, pitots, options.close_s)
        if options.servos is not None:
            widths = {name: pulses(*chip.edges(pins[name])) for name in SERVOS}
            np.savez(options.servos, allow_pickle=False, **widths)
        count = flight.card.count()
        summary = {
            "simulated_s": simulated_s,
            "times_real_time": round(simulated_s / wall_s, 2),
            "cpu": round(load, 4),
            "blocks_written": count.written,
            "blocks_lost": count.lost,
            "uart_bytes_lost": [chip.uart_lost(port) for port in range(4)],
            "resets": len(chip.records(LogKind.OUT_OF_RESET)),
            "outside_the_model": len(chip.faults()),
        }
    print(json.dumps(summary))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
