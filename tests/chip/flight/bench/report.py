"""Print what was measured and what is asked for."""

from __future__ import annotations

import json
import re
import subprocess
from collections import Counter
from pathlib import Path

import numpy as np
import stack_depth
from flight.bench import pulses, signals
from flight.bench.fly import FIELDS, LAST_S, Flight
from flight.bench.inputs import InputFigures
from flight.bench.plan import CYCLES_PER_S, RAMP_SLOTS, SCHEMA_RETURN_S, STALL_S
from flight.bench.table import Table
from flight.images import ROOT
from flight.rig import SERVOS, check_card, take_log
from host.wire.schema_text import packed_schema
from image_hash import image_hash
from numpy.typing import NDArray
from owners import Sources, flash_by_owner, ram_by_owner, room_of

import host

RAM_LIMIT_BYTES = 6600
FLASH_LIMIT_BYTES = 253_952
UNTOUCHED_BYTES = 600
CPU_LIMIT_PERCENT = {100: 32.0, 200: 39.0}  # no flight card is enabled
INPUT_CPU_LIMIT_PERCENT = {100: 42.0, 200: 50.0}  # while a row of three axes teaches one
PULSE_P99_US, PULSE_MAX_US = 2.0, 4.0
OUTPUT_US = 1.0
DEFLECTED_US = 80.0  # the elevator's amplitude is 80 to either side, its sines seldom agree
HELD_US = 40.0  # the pitch of these flights is noise of 3 deg
DONE = packed_schema().number("input_end", "done")
DELAY_MS = 20.0 + 2.0  # one servo frame and 2 ms
STEP_COUNTS = 1.0
RAMP_US = 100.0
REAL_TIME = 4.0
VECTOR_NAMES = {
    11: "PCINT2 receiver",
    12: "WDT",
    13: "TIMER2 COMPA 1 ms",
    17: "TIMER1 COMPA rudder off",
    26: "USART0 UDRE USB",
    29: "ADC",
    32: "TIMER3 COMPA throttle off",
    33: "TIMER3 COMPB aileron off",
    34: "TIMER3 COMPC elevator off",
    39: "TWI IMU",
    50: "TIMER5 OVF clock",
    51: "USART2 RX GPS",
    52: "USART2 UDRE GPS",
    55: "USART3 UDRE radio",
}


def image_rows(table: Table, elf: Path) -> tuple[stack_depth.StackDepth, int]:
    """Print what the image takes: flash, RAM and their owners, the deepest stack.

    Returns
    -------
    depth : StackDepth
        The computed worst case.
    room_bytes : int
        What the stack has.
    """
    size = subprocess.run(["avr-size", str(elf)], capture_output=True, text=True, check=True)
    text, data, bss = map(int, size.stdout.splitlines()[1].split()[:3])
    table.head(f"image {image_hash(elf):08x}, {built_by(elf)}")
    table.at_most("flash", text + data, FLASH_LIMIT_BYTES, "B")
    table.at_most("static RAM", data + bss, RAM_LIMIT_BYTES, "B")
    depth = stack_depth.analyse(elf)
    room = stack_depth.room_bytes(elf)
    table.row("stack: deepest chain from main", f"{depth.main_bytes} B")
    nesting = len(depth.nesting)
    table.row(f"stack: {nesting} nesting interrupts and one", f"{depth.interrupt_bytes} B")
    table.at_most("stack: computed worst case", depth.total_bytes, room, "B")
    owners_rows(table, elf)
    return depth, room


def built_by(elf: Path) -> str:
    """Return what the image says of its compiler: ``GCC 7.3.0``."""
    command = ["avr-readelf", "-p", ".comment", str(elf)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    versions = re.findall(r"GCC: \(GNU\) (\S+)", said)
    return f"GCC {', '.join(versions)}" if versions else "compiler unknown"


def owners_rows(table: Table, elf: Path) -> None:
    """Print RAM and flash by folder, and the largest variables."""
    sources = Sources()
    ram = ram_by_owner(elf, sources)
    rooms_ram: Counter[str] = Counter()
    rooms_flash: Counter[str] = Counter()
    for (file, _), count in ram.items():
        rooms_ram[room_of(file)] += count
    for file, count in flash_by_owner(elf, sources).items():
        rooms_flash[room_of(file)] += count
    table.head("owners: RAM, flash")
    for room in sorted(rooms_ram | rooms_flash, key=lambda name: -rooms_ram[name]):
        table.row(room, f"{rooms_ram[room]} B, {rooms_flash[room]} B")
    for (file, what), count in ram.most_common(6):
        table.row(what, f"{count} B", file)


def flight_rows(
    table: Table, flight: Flight, depth: stack_depth.StackDepth, room_bytes: int
) -> None:
    """Print everything of one flight."""
    check_card(flight.card_image)
    log = host.read_log(take_log(flight.card_image, flight.card_image.with_suffix(".bin")))
    minutes = flight.seconds / 60
    stall_ms = STALL_S[flight.rate_hz] * 1e3
    table.head(
        f"{flight.rate_hz} Hz, {minutes:.3g} min, every device at its rate; card busy 5 ms, "
        f"{flight.stalls} stalls of {stall_ms:.0f} ms"
    )
    table.at_most(
        "CPU load", 100 * flight.load.busy_fraction, CPU_LIMIT_PERCENT[flight.rate_hz], "%", 1
    )
    system = log.frames["system"]
    untouched = int(system["stack_free_min"].min())
    used = room_bytes - untouched
    table.at_least("stack never touched", untouched, UNTOUCHED_BYTES, "B")
    table.row(
        "stack: seen, computed",
        f"{used}, {depth.total_bytes} B",
        "seen <= computed",
        ok=used <= depth.total_bytes,
    )
    loop = flight.loop
    table.row(
        "main loop, period p50 p99 max",
        f"{loop.period_p50_us:.0f} {loop.period_p99_us:.0f} {loop.period_max_us:.0f} us",
    )
    table.row(
        "main loop, work p50 p99 max",
        f"{loop.work_p50_us:.0f} {loop.work_p99_us:.0f} {loop.work_max_us:.0f} us",
    )
    interrupt_rows(flight)
    pulse_rows(table, flight)
    card_rows(table, flight, log)
    sample_rows(table, flight, log)
    ratio = flight.seconds / flight.cpu_s
    table.row("simulator, of a free core", f"{ratio:.1f} x real time", f">= {REAL_TIME:g} x")
    table.none_of("things outside the simulator's model", flight.faults)


def input_rows(table: Table, figures: InputFigures) -> None:
    """Print what a row of three axes that teaches one, or holds two, costs."""
    what = "holds two" if figures.held else "teaches roll"
    table.head(
        f"{figures.rate_hz} Hz, a row of three axes that {what}, {figures.seconds:.1f} s, "
        f"receiver {1e3 * figures.frame_s:g} ms, {figures.stalls} stalls"
    )
    limit = INPUT_CPU_LIMIT_PERCENT[figures.rate_hz]
    table.at_most("CPU load while it runs", 100 * figures.busy_fraction, limit, "%", 1)
    table.at_least("stack never touched", figures.untouched_bytes, UNTOUCHED_BYTES, "B")
    most = float(figures.width_error_us.max())
    table.row(
        f"servo pulse against the command, {len(figures.width_error_us)}, max",
        f"{most:.2f} us",
        f"<= {OUTPUT_US:g} us",
        ok=most <= OUTPUT_US,
    )
    least_us = HELD_US if figures.held else DEFLECTED_US
    table.at_least("elevator deflected, to and fro", figures.deflected_us, least_us, "us")
    if not figures.held:
        table.at_least("derivatives told", figures.told, int(figures.seconds) - 2, "")
    table.none_of("frames lost", figures.frames_lost)
    table.row("ends of inputs", str(figures.ends), "done", ok=figures.ends == (DONE,))


def interrupt_rows(flight: Flight) -> None:
    """Print latency and length of every interrupt that came, in cycles of 62.5 ns."""
    print(f"  {'interrupt, cycles':28} {'per s':>8} {'latency p50 p99 max':>22}", end="")
    print(f" {'length p50 p99 max':>22}")
    for number, v in flight.vectors.items():
        if v.count == 0:
            continue
        latency = f"{v.latency_p50} {v.latency_p99} {v.latency_max}"
        length = f"{v.length_p50} {v.length_p99} {v.length_max}"
        name = f"{number} {VECTOR_NAMES.get(number, '')}"
        print(f"  {name:28} {v.count / flight.seconds:8.1f} {latency:>22} {length:>22}")


def pulse_rows(table: Table, flight: Flight) -> None:
    """Print receiver and servo pulses, for each receiver and over all."""
    measured = {}
    for channel, sent in flight.pulses_sent.items():
        accepted = flight.pulses_accepted[flight.pulses_accepted[:, 0] == channel]
        measured[channel] = pulses.match_measured(sent, accepted[:, 2:], flight.zero)
    widths: list[NDArray[np.float64]] = []
    delays: list[NDArray[np.float64]] = []
    frames: list[NDArray[np.float64]] = []
    edges = strange = refused = engaged = judged = 0
    for leg in flight.legs:
        errors = []
        for one in measured.values():
            # of the last pulses some were not accepted yet
            inside = (one.start > leg.begin) & (one.end < leg.end - CYCLES_PER_S // 20)
            part = pulses.Measured(one.start[inside], one.end[inside], one.width_ticks[inside])
            errors.append(part.error_us)
            judged += int(np.count_nonzero(inside))
            refused += int(np.count_nonzero(part.width_ticks == 0))
        p50, p99, most = signals.percentiles(np.concatenate(errors))
        ok = p99 <= PULSE_P99_US and most <= PULSE_MAX_US
        table.row(
            f"RC pulse error, {leg.receiver.name}",
            f"{p50:.2f} {p99:.2f} {most:.2f} us",
            f"p99 <= {PULSE_P99_US:g}, max <= {PULSE_MAX_US:g} us",
            ok=ok,
        )
        engaged += leg.engaged
        for channel in range(len(SERVOS)):
            out = flight.servo_pulses[channel]
            out = out[(out[:, 0] > leg.begin) & (out[:, 1] < leg.end)]
            seen = pulses.judge_output(out, measured[channel])
            widths.append(seen.width_error_us)
            strange += seen.strange
            edges += 2 * len(out)
            delays.append(seen.delay_ms)
            frames.append(np.diff(out[:, 0]) / pulses.CYCLES_PER_US)
    table.none_of("RC pulses not accepted", refused, judged)
    frame = np.concatenate(frames)
    table.row("servo edges; frame", f"{edges}; {frame.min():.2f} to {frame.max():.2f} us")
    _, p99, most = signals.percentiles(np.concatenate(widths))
    table.row(
        "servo pulse against measured, p99 max",
        f"{p99:.2f} {most:.2f} us",
        f"<= {OUTPUT_US:g} us",
        ok=most <= OUTPUT_US,
    )
    table.none_of("servo pulses not of the last 100 ms", strange, edges // 2)
    p50, p99, most = signals.percentiles(np.concatenate(delays))
    table.row(
        "stick to servo, p50 p99 max",
        f"{p50:.1f} {p99:.1f} {most:.2f} ms",
        f"<= {DELAY_MS:g} ms",
        ok=most <= DELAY_MS,
    )
    table.row(
        "relay engaged, receivers",
        f"{engaged} of {len(flight.legs)}",
        "all",
        ok=engaged == len(flight.legs),
    )


def card_rows(table: Table, flight: Flight, log: host.FlightLog) -> None:
    """Print what the card took and what was lost."""
    system = log.frames["system"]
    throughput = flight.card.written * 512 / flight.seconds / 1000
    table.row("card", f"{throughput:.1f} kB/s, {flight.card.written} blocks")
    high = flight.ring_bytes - int(system["ring_free_min"].min())
    table.row("ring high-water", f"{high} of {flight.ring_bytes} B")
    table.none_of("frames lost", log.loss.frames)
    table.row("log without any loss", str(not log.loss.any), "True", ok=not log.loss.any)
    returns = len(log.frames["identity"]) - 1  # it follows every pass of the schema
    # the last of them may be under way when the battery is pulled
    due = max(0, int(flight.seconds / SCHEMA_RETURN_S - 0.5))
    table.at_least("returns of the schema", returns, due, "")
    table.at_least("stalls while the schema returns", flight.stalls_in_schema, due, "")
    table.at_least("blocks refused for their CRC", flight.card.rejected, due, "")
    table.at_least("stalls of a block sent again", flight.stalls_of_resends, due, "")


def sample_rows(table: Table, flight: Flight, log: host.FlightLog) -> None:
    """Print whether every sample came once, and analogue values at their time."""
    ident = log.frames["ident"]
    found = signals.find_samples(
        ident, flight.samples_sent, flight.end - round(LAST_S * CYCLES_PER_S)
    )
    table.none_of("IMU samples missing", found.missing, found.sent)
    table.none_of("IMU samples twice", found.repeated)
    table.none_of("IMU samples nobody sent", found.strange)
    inside = _cycles(ident["t_us"], flight.zero)
    judged = (inside > flight.begin) & (inside < flight.end)
    rows, at = ident[judged], inside[judged]
    schema = json.loads((ROOT / "protocol" / "generated" / "schema.json").read_text())["schema"]
    fields = next(frame for frame in schema["frames"] if frame["name"] == "ident")["fields"]
    columns = schema["columns"]
    analogue = [dict(zip(columns, f, strict=False)) for f in fields]
    analogue = [f for f in analogue if f.get("unit") == "count"]
    step: list[NDArray[np.float64]] = []
    slope: list[NDArray[np.float64]] = []
    for slot, field in enumerate(analogue[:FIELDS]):
        counts = rows[field["name"]] * field["scale"]
        sampled = at - field["delay_us"] * signals.CYCLES_PER_US
        profile = flight.profiles[slot]
        if slot in RAMP_SLOTS:
            slope.append(signals.ramp_errors_us(counts, sampled, profile))
        else:
            step.append(signals.step_errors(counts, sampled, profile))
    _, p99, most = signals.percentiles(np.concatenate(step))
    table.row(
        f"analogue step, {sum(map(len, step))} frames, p99 max",
        f"{p99:.2f} {most:.2f} counts",
        f"<= {STEP_COUNTS:g} count",
        ok=most <= STEP_COUNTS,
    )
    _, p99, most = signals.percentiles(np.concatenate(slope))
    table.row(
        f"ramp, {sum(map(len, slope))} frames, p99 max",
        f"{p99:.0f} {most:.0f} us",
        f"<= {RAMP_US:g} us of the delay",
        ok=most <= RAMP_US,
    )


def _cycles(t_us: NDArray[np.uint32], zero: int) -> NDArray[np.float64]:
    """Cycles of the simulation at times of the firmware's clock (no wrap within an hour)."""
    cycles: NDArray[np.float64] = t_us.astype(np.float64) * signals.CYCLES_PER_US + zero
    return cycles
