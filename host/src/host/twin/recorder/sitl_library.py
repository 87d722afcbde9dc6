"""The recorder as a shared library: the C interface of `firmware/boards/sitl/sitl.h`, typed.

The library is loaded by path; nothing of it is imported or linked. It holds one instrument, so one
`Sitl` is in use at a time. Times are ticks of 0.5 us since the `Sitl` was made.
"""

from __future__ import annotations

import ctypes
import mmap
from collections.abc import Sequence
from enum import IntEnum
from pathlib import Path

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from host.twin.recorder.recorder_build import CLONE_LIBRARY as LIBRARY

TICKS_PER_US = 2
TICKS_PER_S = 2_000_000
BLOCK_BYTES = 512
PACKET_BYTES = 40
EEPROM_BYTES = 4096
ANALOG_CHANNELS = 11
# A byte with its acknowledge at 400 kHz, and behind it the clock held by the Mega.
BYTE_US = 22.5
SLAVE_HOLD_TICKS = 7

Ticks = NDArray[np.int64]


class Recorder(IntEnum):
    """What the recorder is doing (app::Recorder::State)."""

    NO_FILE = 0
    UNDECIDED = 1
    READY = 2
    RECORDING = 3
    ENDING = 4
    FILE_FULL = 5
    FAILED = 6


class Volume(IntEnum):
    """Status of the card's volume (storage::VolumeStatus)."""

    READY = 0
    NO_CARD = 1
    NO_FAT = 2
    UNREADABLE = 3
    FULL = 4
    FRAGMENTED = 5


class CardFault(IntEnum):
    """Faults of a card towards its host; times in us."""

    BUSY = 0
    REJECT = 1
    REMOVE = 2
    INSERT = 3
    EVERY_BUSY = 4
    UNREADABLE = 5


class Level(IntEnum):
    """Lines whose changes are kept."""

    RELAY = 0
    LED = 1
    BUZZER = 2


class Port(IntEnum):
    """Serial ports of the instrument."""

    USB = 0
    GPS = 1
    TELEMETRY = 2


class State(ctypes.Structure):
    """The instrument at one instant (struct SitlState)."""

    now: int
    clock_us: int
    file_number: int
    blocks_taken: int
    ground_writes: int
    conversions: int
    lost_edges: int
    lost_packets: int
    lost_gps_bytes: int
    recorder: int
    volume: int
    drive: int
    relay: int
    powered: int
    programming: int
    led: int
    buzzer: int
    _fields_ = (
        ("now", ctypes.c_int64),
        ("clock_us", ctypes.c_uint32),
        ("file_number", ctypes.c_uint32),
        ("blocks_taken", ctypes.c_uint32),
        ("ground_writes", ctypes.c_uint32),
        ("conversions", ctypes.c_uint32),
        ("lost_edges", ctypes.c_uint16),
        ("lost_packets", ctypes.c_uint16),
        ("lost_gps_bytes", ctypes.c_uint16),
        ("recorder", ctypes.c_uint8),
        ("volume", ctypes.c_uint8),
        ("drive", ctypes.c_uint8),
        ("relay", ctypes.c_uint8),
        ("powered", ctypes.c_uint8),
        ("programming", ctypes.c_uint8),
        ("led", ctypes.c_uint8),
        ("buzzer", ctypes.c_uint8),
    )


def byte_ticks(byte_us: float = BYTE_US) -> int:
    """Return how long a byte takes on the IMU's bus; STOP comes behind address and data."""
    return round(byte_us * TICKS_PER_US) + SLAVE_HOLD_TICKS


class Sitl:
    """One instrument with everything around it, switched off, its EEPROM erased."""

    def __init__(self, library: Path = LIBRARY) -> None:
        self._c = ctypes.CDLL(str(library))
        for name in ("default_config", "pulses", "levels", "sent"):
            getattr(self._c, f"sitl_{name}").restype = ctypes.c_size_t
        self._c.sitl_create()
        self._image: object = None  # keeps the card's memory alive

    def close(self) -> None:
        """Let go of the card's image, so that an mmap may be closed."""
        self._c.sitl_create()
        self._image = None

    def set_clock_offset(self, offset_us: int) -> None:
        """Let the Mega's clock start at `offset_us` at each boot, so that it wraps soon."""
        self._c.sitl_set_clock_offset(ctypes.c_uint32(offset_us))

    def set_file_blocks(self, blocks: int) -> None:
        """Make new flight files of so many blocks; 0 means the flight value."""
        self._c.sitl_set_file_blocks(ctypes.c_uint32(blocks))

    def eeprom(self) -> bytes:
        """Return the 4096 bytes of the EEPROM."""
        out = ctypes.create_string_buffer(EEPROM_BYTES)
        self._c.sitl_get_eeprom(out)
        return out.raw

    def set_eeprom(self, content: bytes) -> None:
        """Replace the EEPROM."""
        if len(content) != EEPROM_BYTES:
            raise ValueError(f"found {len(content)} bytes, an EEPROM has {EEPROM_BYTES}")
        self._c.sitl_set_eeprom(content)

    def default_config(self) -> bytearray:
        """Return the fields of the frame `config` that an erased EEPROM gives, `t_us` first."""
        out = ctypes.create_string_buffer(256)
        size = int(self._c.sitl_default_config(out, ctypes.c_size_t(len(out))))
        return bytearray(out.raw[:size])

    def set_config(self, config: bytes | bytearray) -> None:
        """Write settings into the EEPROM; ValueError if the firmware refuses them."""
        if not self._c.sitl_set_config(bytes(config), ctypes.c_size_t(len(config))):
            raise ValueError("settings: a value is out of its range, or the size is wrong")

    def insert_card(self, image: bytearray | mmap.mmap, card_id: bytes) -> None:
        """Put in a card whose blocks are those of `image`, which the firmware writes in place."""
        if len(card_id) != 16 or len(image) % BLOCK_BYTES:
            raise ValueError("a card has an id of 16 bytes and whole blocks of 512 bytes")
        memory = (ctypes.c_uint8 * len(image)).from_buffer(image)
        self._image = memory
        blocks = ctypes.c_uint32(len(image) // BLOCK_BYTES)
        self._c.sitl_insert_card(memory, blocks, card_id)

    def add_edges(self, at: npt.ArrayLike, levels: npt.ArrayLike) -> None:
        """Add receiver edges: ticks (n,), and the five lines after each edge (n,)."""
        self._add("sitl_add_edges", at, levels)

    def add_gps(self, at: npt.ArrayLike, data: npt.ArrayLike) -> None:
        """Add bytes from the GPS receiver: ticks (n,), bytes (n,)."""
        self._add("sitl_add_gps", at, data)

    def add_usb(self, at: npt.ArrayLike, data: npt.ArrayLike) -> None:
        """Add bytes that the USB line brings: ticks (n,), bytes (n,)."""
        self._add("sitl_add_usb", at, data)

    def add_button(self, at: npt.ArrayLike, pressed: npt.ArrayLike) -> None:
        """Add changes of the button: ticks (n,), 1 for pressed (n,)."""
        self._add("sitl_add_button", at, pressed)

    def press(self, at: int, seconds: float) -> None:
        """Press the button at `at` ticks for so long."""
        self.add_button([at, at + round(seconds * TICKS_PER_S)], [1, 0])

    def add_packets(
        self,
        start: npt.ArrayLike,
        address: int | Sequence[int],
        packets: Sequence[bytes],
        *,
        byte_us: float = BYTE_US,
    ) -> None:
        """Add transfers on the IMU's bus: ticks of their START (n,), one address or n, n packets.

        `byte_us` is the time of a byte with its acknowledge: 22.5 at 400 kHz, 90 at 100 kHz.
        """
        when = _ticks(start)
        # Bytes, not arrays: a loop with an aircraft adds one packet at a time.
        data = b"".join(packet.ljust(PACKET_BYTES, b"\0") for packet in packets)
        if len(data) != len(packets) * PACKET_BYTES:
            raise ValueError(f"a packet has at most {PACKET_BYTES} bytes")
        addresses = bytes([address] * len(packets) if isinstance(address, int) else address)
        _in_order(when, len(packets))
        self._c.sitl_add_packets(
            _of(when),
            addresses,
            bytes([len(packet) for packet in packets]),
            data,
            ctypes.c_uint32(round(byte_us * TICKS_PER_US)),
            ctypes.c_size_t(len(when)),
        )

    def set_analog(self, start: int, step: int, counts: npt.ArrayLike) -> None:
        """Give the analogue inputs: rows of 11 channels in counts, `step` ticks apart, linear
        between, in the order of the scan (alpha_a ... pot_rudder, rail).
        """
        rows = np.ascontiguousarray(counts, dtype=np.float64).reshape(-1, ANALOG_CHANNELS)
        self._c.sitl_set_analog(
            ctypes.c_int64(start), ctypes.c_int64(step), _of(rows), ctypes.c_size_t(len(rows))
        )

    def set_supply(self, avcc_mv: int) -> None:
        """Set the analogue supply in mV."""
        self._c.sitl_set_supply(ctypes.c_uint16(avcc_mv))

    def weld_relay(self) -> None:
        """Let the relay's contact say engaged for ever."""
        self._c.sitl_weld_relay(ctypes.c_int(1))

    def cut_relay(self, cut: bool = True) -> None:
        """Let the relay stay at rest whatever the heartbeat does, or follow it again."""
        self._c.sitl_cut_relay(ctypes.c_int(cut))

    def set_pressure(
        self, coefficients: Sequence[int], start: int, step: int, raw: npt.ArrayLike
    ) -> None:
        """Connect a BMP085: its coefficients AC1 ... MD, and rows of UT and UP (as at
        oversampling 3), `step` ticks apart, linear between.
        """
        self._pressure("sitl_set_pressure", coefficients, start, step, raw)

    def set_bmp280(
        self, coefficients: Sequence[int], start: int, step: int, raw: npt.ArrayLike
    ) -> None:
        """Connect a BMP280 instead: its coefficients dig_T1 ... dig_P9, and rows of the 20 bits of
        temperature and pressure.
        """
        self._pressure("sitl_set_bmp280", coefficients, start, step, raw)

    def _pressure(
        self, function: str, coefficients: Sequence[int], start: int, step: int, raw: npt.ArrayLike
    ) -> None:
        words = np.array([word & 0xFFFF for word in coefficients], dtype=np.uint16)
        rows = np.ascontiguousarray(raw, dtype=np.float64).reshape(-1, 2)
        getattr(self._c, function)(
            _of(words),
            ctypes.c_int64(start),
            ctypes.c_int64(step),
            _of(rows),
            ctypes.c_size_t(len(rows)),
        )

    def hold_pressure_bus(self, held: bool) -> None:
        """Let a line of the pressure sensor's bus be stuck, or let it go."""
        self._c.sitl_hold_pressure_bus(ctypes.c_int(held))

    def remove_pressure(self) -> None:
        """Let the pressure sensor answer no more."""
        self._c.sitl_remove_pressure()

    def hold_port(self, port: Port, until: int) -> None:
        """Let the far end of a port take no byte until then: what is sent waits."""
        self._c.sitl_hold_port(ctypes.c_int(port), ctypes.c_int64(until))

    def add_card_fault(self, at: int, fault: CardFault, value: int = 0) -> None:
        """Let the card misbehave from `at` ticks on."""
        amount = np.array([value], dtype=np.uint32)
        when, kind = _ticks([at]), _bytes([fault])
        self._c.sitl_add_card_events(_of(when), _of(kind), _of(amount), ctypes.c_size_t(1))

    def power_on(self) -> None:
        """Boot the firmware now."""
        self._c.sitl_power_on()

    def power_cut(self, seed: int = 1) -> None:
        """Take the battery away; a block being programmed becomes garbage made from `seed`."""
        self._c.sitl_power_cut(ctypes.c_uint32(seed))

    def reset(self, source: int) -> None:
        """Restart the chip alone; `source` as enum `reset_cause` of the schema."""
        self._c.sitl_reset(ctypes.c_uint8(source))

    def run_until(self, at: int) -> None:
        """Let time pass up to `at` ticks, at most 1 ms further."""
        self._c.sitl_run_until(ctypes.c_int64(at))

    def run_for(self, seconds: float) -> None:
        """Let so much time pass."""
        self.run_until(self.now() + round(seconds * TICKS_PER_S))

    def now(self) -> int:
        """Return the time in ticks."""
        return int(self.state().now)

    def state(self) -> State:
        """Return the state of the instrument now."""
        state = State()
        self._c.sitl_state(ctypes.byref(state))
        return state

    def pulses(self) -> tuple[Ticks, NDArray[np.uint8], NDArray[np.uint16]]:
        """Return every servo pulse of the Mega: start in ticks, output 0 to 3, width in ticks."""
        count = int(self._c.sitl_pulses(None, None, None, ctypes.c_size_t(0)))
        start = np.zeros(count, dtype=np.int64)
        output = np.zeros(count, dtype=np.uint8)
        width = np.zeros(count, dtype=np.uint16)
        self._c.sitl_pulses(_of(start), _of(output), _of(width), ctypes.c_size_t(count))
        return start, output, width

    def levels(self, line: Level) -> tuple[Ticks, NDArray[np.uint8]]:
        """Return the changes of a line: ticks and the level from there on."""
        count = int(self._c.sitl_levels(ctypes.c_int(line), None, None, ctypes.c_size_t(0)))
        at = np.zeros(count, dtype=np.int64)
        level = np.zeros(count, dtype=np.uint8)
        self._c.sitl_levels(ctypes.c_int(line), _of(at), _of(level), ctypes.c_size_t(count))
        return at, level

    def sent(self, port: Port) -> bytes:
        """Return all bytes sent through a port since the object was made."""
        count = int(self._c.sitl_sent(ctypes.c_int(port), None, ctypes.c_size_t(0)))
        out = ctypes.create_string_buffer(max(count, 1))
        self._c.sitl_sent(ctypes.c_int(port), out, ctypes.c_size_t(count))
        return out.raw[:count]

    def _add(self, function: str, at: npt.ArrayLike, values: npt.ArrayLike) -> None:
        when, data = _ticks(at), _bytes(values)
        _in_order(when, data.size)
        getattr(self._c, function)(_of(when), _of(data), ctypes.c_size_t(len(when)))


def _ticks(values: npt.ArrayLike) -> Ticks:
    return np.ascontiguousarray(values, dtype=np.int64)


def _bytes(values: npt.ArrayLike) -> NDArray[np.uint8]:
    return np.ascontiguousarray(values, dtype=np.uint8)


def _in_order(when: Ticks, count: int) -> None:
    if when.shape != (count,):
        raise ValueError(f"found times of {when.shape} for {count} values, they must be alike")
    if count > 1 and np.any(np.diff(when) < 0):
        raise ValueError("times must not go back")


def _of(array: np.ndarray[tuple[int, ...], np.dtype[np.generic]]) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)
