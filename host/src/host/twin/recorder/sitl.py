"""Run the recorder, a shared library, through a flight in simulated time.

Gives it the stimuli and faults of the flight and reads its card; `sitl_library` is the C
interface.
"""

from __future__ import annotations

import mmap
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from host.errors import UsageError
from host.twin.faults import Action, Fault, recorder_actions
from host.twin.flight.stick_commands import IDLE_US, NEUTRAL_US
from host.twin.recorder.fat32 import CardImageError, CardReader, format_card, unwritten_card
from host.twin.recorder.flight_card_line import eeprom_with_card
from host.twin.recorder.recorder_build import recorder_library
from host.twin.recorder.sitl_library import TICKS_PER_US, CardFault, Port, Sitl
from host.twin.recorder.stimuli import SAMPLE_STEP_TICKS, Stimuli
from host.twin.sensors.mega_clock import TICKS_PER_S
from host.wire.schema_text import packed_schema

RATES_HZ = (25, 50, 100, 200)
PRESS_S, LET_GO_S = 3.6, 3.9  # start button
GROUND_S = 25.0  # the power-on before: a bare board knows the ground after 18 s, makes a file
CLOSE_S = 20.0  # the next power-on: on the ground the recorder closes the file
# Room on the card per second of flight at 100 Hz: about 18 blocks are used.
BLOCKS_PER_S = 40
PITOTS = (4, 5)  # places of dp_a and dp_b in a scan
PITOT_ZERO = 512.0
SERVO_PULSE = np.dtype([("at", np.int64), ("output", np.uint8), ("width", np.int64)])
CARD_ID = b"\x03VIRT\x15card\x10\x00\x00\x01\x00\xf0"
CARD_EVENTS = {
    "card_busy": CardFault.BUSY,
    "card_reject": CardFault.REJECT,
    "card_removed": CardFault.REMOVE,
    "card_inserted": CardFault.INSERT,
}
# storage::VolumeStatus of the recorder.
VOLUMES = ("a good card", "no card", "a card without a file system", "a card it cannot read",
           "a full card", "a card without room in one piece")  # fmt: skip
NO_FILE = {"card_absent": "no card", "card_full": "a full card",
           "card_unformatted": "a card without a file system"}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Recording:
    """What the recorder left on the card.

    Attributes
    ----------
    log : bytes
        The flight file, as long as the recorder's last boot made it; empty where it rightly made
        none.
    name : str
        Its name on the card; without a file, why there is none.
    lost_edges, lost_packets, lost_gps_bytes : int
        Stimuli the hardware model had no room for.
    servos : structured array (at, output, width)
        Every pulse of the Mega to a servo, in ticks; outputs in the order of the receiver.
    """

    log: bytes
    name: str
    lost_edges: int
    lost_packets: int
    lost_gps_bytes: int
    servos: NDArray[np.void] = field(default_factory=lambda: np.zeros(0, dtype=SERVO_PULSE))


def recorder_rate_hz(wanted_hz: float) -> int:
    """Return the rate to set: the flight card's if the recorder has it, else 100 Hz."""
    return int(wanted_hz) if wanted_hz in RATES_HZ else 100


def record(
    given: Stimuli,
    *,
    rate_hz: int,
    aircraft: str,
    faults: Sequence[Fault] = (),
    seed: int = 0,
    flight_card: bytes = b"",
    progress: Callable[[float], None] = lambda _: None,
) -> Recording:
    """Run the recorder through a flight.

    Parameters
    ----------
    given : Stimuli
    rate_hz : int
        One of `RATES_HZ`.
    aircraft : str
        Name for the log's configuration, at most 15 characters are kept.
    faults : sequence of Fault
        Those of card, barometer and supply act here; the others are in the stimuli already.
    seed : int
        Seed of the garbage that a power cut leaves in a block being programmed.
    flight_card : bytes
        In its EEPROM; empty for none.
    progress : callable
        Called with the share done.

    Returns
    -------
    Recording

    Raises
    ------
    UsageError
        No library, or the recorder did not make a file.
    """
    sitl, image = ready(given, rate_hz, aircraft, faults, flight_card)
    try:
        return _record(sitl, image, given, faults, seed, progress)
    finally:
        sitl.close()


def ready(
    given: Stimuli, rate_hz: int, aircraft: str, faults: Sequence[Fault], flight_card: bytes
) -> tuple[Sitl, mmap.mmap]:
    """Return the recorder, off, as `record` has it, with the image of a card that has room."""
    check_duration(given)
    room_s = given.duration / TICKS_PER_S + 30.0
    blocks = round(room_s * BLOCKS_PER_S * max(rate_hz / 100.0, 0.5))
    image = card_image(faults, blocks)
    settings = Sitl(recorder_library())
    kinds = {fault.kind for fault in faults}
    configure(settings, rate_hz, aircraft, damaged="settings_damaged" in kinds)
    content = settings.eeprom()
    if flight_card:
        content = eeprom_with_card(content, flight_card)
    sitl = Sitl(recorder_library())
    sitl.set_file_blocks(blocks)
    sitl.set_eeprom(content)
    if "card_absent" not in kinds:
        sitl.insert_card(image, CARD_ID)
    return sitl, image


def check_duration(given: Stimuli) -> None:
    """Raise UsageError if the flight is over before the recorder gets its start."""
    duration_s = given.duration / TICKS_PER_S
    if duration_s < LET_GO_S:
        raise UsageError(
            f"the flight ends after {duration_s:.1f} s: its recorder is started {PRESS_S} s after"
            " power-on, expected a longer one, or --firmware none"
        )


def eeprom(rate_hz: int, aircraft: str, *, damaged: bool = False) -> bytes:
    """Return the EEPROM (4096 bytes) of a recorder with these settings; raises UsageError."""
    sitl = Sitl(recorder_library())
    configure(sitl, rate_hz, aircraft, damaged=damaged)
    return sitl.eeprom()


def _record(
    sitl: Sitl,
    image: mmap.mmap,
    given: Stimuli,
    faults: Sequence[Fault],
    seed: int,
    progress: Callable[[float], None],
) -> Recording:
    for fault in faults:
        if fault.kind == "clock_wrap":
            offset_us = (1 << 32) - round(fault.at_s * 1e6)
            sitl.set_clock_offset(offset_us & 0xFFFFFFFF)
    cuts = [round(f.at_s * TICKS_PER_S) for f in faults if f.kind == "power_cut"]
    end = min([given.duration, *cuts])
    give_stimuli(sitl, given, end)
    if any(fault.kind == "telemetry_flood" for fault in faults):
        raise UsageError("telemetry_flood: here an interrupt takes no time; use --firmware avr")
    actions = [(round(a.at_s * TICKS_PER_S), a) for a in recorder_actions(faults)]
    sitl.power_on()
    marks = {*range(TICKS_PER_S, end, TICKS_PER_S), *(at for at, _ in actions if at < end), end}
    for mark in sorted(marks):
        sitl.run_until(mark)
        for at, action in actions:
            if at == mark:
                _act(sitl, given, at, action)
        progress(mark / end)
    return closed(sitl, image, given, end, faults, seed)


def closed(
    sitl: Sitl, image: mmap.mmap, given: Stimuli, end: int, faults: Sequence[Fault], seed: int
) -> Recording:
    """Pull the battery at tick `end`; the next power-on, at the bench, closes the file."""
    sitl.run_until(end)
    state = sitl.state()
    servos = np.rec.fromarrays(sitl.pulses(), dtype=SERVO_PULSE)
    sitl.power_cut(seed & 0xFFFFFFFF)
    close_start = end + TICKS_PER_S
    sitl.run_until(close_start)
    sitl.set_analog(close_start, SAMPLE_STEP_TICKS, still_analog(given)[None, :])
    sitl.add_edges(*_idle_receiver(close_start, close_start + round(CLOSE_S * TICKS_PER_S)))
    sitl.power_on()
    sitl.run_until(close_start + round(CLOSE_S * TICKS_PER_S))

    log, name = file_of(image, faults)
    if not log:
        name = VOLUMES[state.volume]
    lost = state.lost_edges, state.lost_packets, state.lost_gps_bytes
    return Recording(log, name, *lost, servos=servos)


def file_of(image: mmap.mmap, faults: Sequence[Fault]) -> tuple[bytes, str]:
    """Return the flight's file and its name; no bytes and the reason where a fault prevents one."""
    reasons = [NO_FILE[fault.kind] for fault in faults if fault.kind in NO_FILE]
    try:
        files = CardReader(image).files()
    except CardImageError:
        files = []
    flights = sorted((f for f in files if f.name.startswith("FLT")), key=lambda f: f.name)
    # The file that the card came with was never recorded into.
    if reasons and (not flights or "card_absent" in {fault.kind for fault in faults}):
        return b"", reasons[0]
    if not flights:
        raise UsageError("the recorder made no file on the card: was the flight shorter than 5 s?")
    # The reboot may have prepared the next file already: the flight is the first one.
    return CardReader(image).read(flights[0]), flights[0].name


def card_image(faults: Sequence[Fault], file_blocks: int | None = None) -> mmap.mmap:
    """Return the memory card at the start: with a prepared file, unless a fault forbids it.

    A flight's stimuli begin in the air, where the recorder makes no file. So it had power on the
    ground before.
    """
    kinds = {fault.kind for fault in faults}
    if "card_unformatted" in kinds:
        return unwritten_card()
    image = format_card(full="card_full" in kinds)
    sitl = Sitl(recorder_library())
    try:
        if file_blocks is not None:
            sitl.set_file_blocks(file_blocks)
        sitl.insert_card(image, CARD_ID)
        sitl.power_on()
        sitl.run_for(GROUND_S)
        sitl.power_cut()
    finally:
        sitl.close()
    return image


def still_analog(given: Stimuli) -> NDArray[np.float64]:
    """Return the last counts of a flight's analogue inputs, its pitots without wind."""
    counts = np.array(given.analog[-1], dtype=np.float64)
    counts[list(PITOTS)] = PITOT_ZERO
    return counts


def _act(sitl: Sitl, given: Stimuli, at: int, action: Action) -> None:
    """Carry out one action on the simulated hardware now."""
    if action.what in CARD_EVENTS:
        # Milliseconds to microseconds for a busy card, else a count.
        value = round(action.value * (1000.0 if action.what == "card_busy" else 1.0))
        sitl.add_card_fault(at, CARD_EVENTS[action.what], value)
    elif action.what == "reset":
        sitl.reset(round(action.value))
    elif action.what == "supply":
        sitl.set_supply(round(action.value * 1000.0))
    elif action.what == "baro_off":
        sitl.remove_pressure()
    elif action.what == "baro_on":
        _give_pressure(sitl, given)
    elif action.what == "telemetry_blocked":
        until = min(action.value, given.duration / TICKS_PER_S)
        sitl.hold_port(Port.TELEMETRY, round(until * TICKS_PER_S))
    else:
        sitl.hold_pressure_bus(action.what == "baro_bus_stuck")


def configure(sitl: Sitl, rate_hz: int, aircraft: str, *, damaged: bool = False) -> None:
    """Change rate and aircraft in the default settings."""
    config = sitl.default_config()
    fields = packed_schema().by_name["config"].fields
    layout = np.dtype([(field.name, field.numpy_type) for field in fields])
    row = np.frombuffer(config, dtype=layout)
    row["rate_hz"] = rate_hz
    row["aircraft"] = aircraft.encode("ascii", "replace")[: layout["aircraft"].itemsize - 1]
    try:
        sitl.set_config(config)
    except ValueError as error:
        raise UsageError(
            f"the recorder refuses {rate_hz} Hz, expected one of {RATES_HZ}"
        ) from error
    if damaged:
        content = bytearray(sitl.eeprom())
        place = content.find(row["aircraft"].tobytes())
        content[place] ^= 0x20
        sitl.set_eeprom(bytes(content))


def give_stimuli(sitl: Sitl, given: Stimuli, end: int) -> None:
    """Give the stimuli that reach the pins before tick `end`; the next power-on is at the bench."""
    edges, gps = given.edges[given.edges["at"] < end], given.gps[given.gps["at"] < end]
    sitl.add_edges(edges["at"], edges["levels"])
    sitl.add_gps(gps["at"], gps["levels"])
    packets = [p for p in given.packets if p.start < end]
    if packets:
        ticks = (packets[0].end - packets[0].start) / (len(packets[0].data) + 1)
        sitl.add_packets(
            [p.start for p in packets],
            [p.address for p in packets],
            [p.data for p in packets],
            byte_us=round(ticks) / TICKS_PER_US,
        )
    sitl.set_analog(0, SAMPLE_STEP_TICKS, given.analog)
    _give_pressure(sitl, given)
    sitl.press(round(PRESS_S * TICKS_PER_S), LET_GO_S - PRESS_S)


def _give_pressure(sitl: Sitl, given: Stimuli) -> None:
    sitl.set_pressure(given.coefficients, 0, SAMPLE_STEP_TICKS, given.pressure)


def _idle_receiver(first: int, last: int) -> tuple[list[int], list[int]]:
    """Return edges of a receiver with neutral sticks and idle throttle."""
    at, levels = [], []
    widths = (NEUTRAL_US, NEUTRAL_US, NEUTRAL_US, IDLE_US, 1100.0)
    for frame in range(first + 2000, last, TICKS_PER_S // 50):
        rise = frame
        for k, width in enumerate(widths):
            fall = rise + round(width * 2)
            at += [rise, fall]
            levels += [1 << k, 0]
            rise = fall + 600
    return at, levels
