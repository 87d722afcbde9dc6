"""One simulated ATmega2560: memories, time, pins, buses, statistics."""

from __future__ import annotations

import ctypes as ct
import importlib.util
import struct
from collections.abc import Callable, Iterable
from enum import IntEnum
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simavr_bench.firmware import Image, read_image
from simavr_bench.library import Callback, load_library
from simavr_bench.log import RECORD, LogKind, Records, TwiNote, select
from simavr_bench.pins import pin_number
from simavr_bench.statistics import CpuLoad, VectorStatistics, vector_statistics

CYCLES_PER_S = 16_000_000
RAM_FIRST = 0x200
RAM_LAST = 0x21FF
BOOTLOADER_START = 0x3E000

_TIMER, _I2C = 100, 101


class ResetCause(IntEnum):
    """Bits of MCUSR."""

    POWER_ON = 1
    EXTERNAL = 2
    BROWN_OUT = 4
    WATCHDOG = 8


def cycles(time_s: float) -> int:
    """Number of 16 MHz cycles in a time, rounded to the nearest."""
    return round(time_s * CYCLES_PER_S)


def _library_path() -> Path:
    script = Path(__file__).resolve().parents[1] / "build.py"
    spec = importlib.util.spec_from_file_location("simavr_bench_build", script)
    if spec is None or spec.loader is None:
        raise RuntimeError(f"cannot load {script}")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    path: Path = module.build_library()
    return path


class Chip:
    """An ATmega2560 at 16 MHz with nothing connected.

    Several may live in one process; each is independent and, with its seed and stimuli, repeats
    itself to the cycle.

    Parameters
    ----------
    seed : int
        Seeds what the chip does not define: SRAM at power-on, converter noise.
    startup_s : float
        From the release of reset to the first instruction; 66.024 ms is low fuse 0xFF.
    bootloader : bool
        Start at 0x3E000 (BOOTRST programmed) instead of at 0.

    Examples
    --------
    >>> with Chip() as chip:
    ...     chip.power_on()
    ...     chip.run_s(0.1)
    ...     round(chip.time_s, 3)
    0.1
    """

    def __init__(
        self, *, seed: int = 1, startup_s: float = 0.066024, bootloader: bool = False
    ) -> None:
        self._lib = load_library(_library_path())
        self._chip = self._lib.bench_create(seed)
        self._timers: dict[int, Callable[[], None]] = {}
        self._next_timer = 0
        self._pin_listeners: dict[int, list[Callable[[bool, int], None]]] = {}
        self._watched: set[int] = set()
        self._uart_listeners: dict[int, list[Callable[[int, int], None]]] = {}
        self._i2c_listeners: dict[int, Callable[[int, int], None]] = {}
        self._power_listeners: list[Callable[[bool], None]] = []
        self._start_listeners: list[Callable[[int], None]] = []
        self._error: BaseException | None = None
        self._next_packet = 1
        self._pc_watches = 0
        self._callback = Callback(self._on_event)  # kept alive as long as the chip
        self._lib.bench_on_event(self._chip, self._callback)
        start = BOOTLOADER_START if bootloader else 0
        self._lib.bench_set_startup(self._chip, cycles(startup_s), start)
        self.symbols: dict[str, tuple[int, int]] = {}

    # ---- life -----------------------------------------------------------------------------

    def close(self) -> None:
        """Free the chip; every other call afterwards is an error."""
        if self._chip is not None:
            self._lib.bench_destroy(self._chip)
            self._chip = None

    def __enter__(self) -> Chip:
        """Give the chip itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Free the chip."""
        self.close()

    @property
    def handle(self) -> int:
        """The C object, for device models."""
        if self._chip is None:
            raise RuntimeError("the chip is closed")
        return int(self._chip)

    @property
    def library(self) -> ct.CDLL:
        """The C library, for device models."""
        return self._lib

    def load(self, firmware: Path | Image) -> Image:
        """Put a program into flash (and its EEPROM part into EEPROM).

        Parameters
        ----------
        firmware : Path or Image
            ELF, Intel HEX, or an image read before. Flash it does not cover stays as it is, so a
            bootloader and an application can be loaded one after the other.

        Returns
        -------
        Image
            The image; its symbols are added to :attr:`symbols`.
        """
        image = firmware if isinstance(firmware, Image) else read_image(firmware)
        flash, eeprom = self._lib.bench_flash(self.handle), self._lib.bench_eeprom(self.handle)
        for address, piece in image.flash.items():
            ct.memmove(flash + address, piece, len(piece))
        for address, piece in image.eeprom.items():
            ct.memmove(eeprom + address, piece, len(piece))
        self.symbols.update(image.symbols)
        return image

    def power_on(self) -> None:
        """Apply the supply: SRAM undefined, MCUSR power-on, start after the start-up time."""
        self._lib.bench_power_on(self.handle)
        for listener in self._power_listeners:
            listener(True)

    def power_off(self) -> None:
        """Take the supply away: pins let go, an EEPROM byte or card block under way is lost."""
        for listener in self._power_listeners:
            listener(False)
        self._lib.bench_power_off(self.handle)

    def reset(self, cause: ResetCause = ResetCause.EXTERNAL) -> None:
        """Reset at once and start again after the start-up time."""
        self.hold_reset(cause)
        self.release_reset(cause)

    def hold_reset(self, cause: ResetCause = ResetCause.EXTERNAL) -> None:
        """Assert a reset and keep it."""
        self._lib.bench_assert_reset(self.handle, int(cause))

    def release_reset(self, cause: ResetCause = ResetCause.EXTERNAL) -> None:
        """Let a held reset go; the chip starts when no cause is left."""
        self._lib.bench_release_reset(self.handle, int(cause))

    def on_power(self, listener: Callable[[bool], None]) -> None:
        """Call ``listener(on)`` when the supply comes or goes."""
        self._power_listeners.append(listener)

    def on_start(self, listener: Callable[[int], None]) -> None:
        """Call ``listener(cycle)`` when the first instruction after a reset is about to run."""
        self._start_listeners.append(listener)

    # ---- time -----------------------------------------------------------------------------

    @property
    def cycle(self) -> int:
        """Cycles since the chip was made; goes on through resets and power cuts."""
        return int(self._lib.bench_cycle(self.handle))

    @property
    def time_s(self) -> float:
        """Simulated time in seconds."""
        return self.cycle / CYCLES_PER_S

    @property
    def state(self) -> str:
        """``off``, ``reset``, ``running`` or ``sleeping``."""
        return ("off", "reset", "running", "sleeping")[self._lib.bench_state(self.handle)]

    def run_until(self, cycle: int) -> None:
        """Run to an absolute cycle, or until :meth:`stop`.

        Raises
        ------
        BaseException
            Whatever a scheduled callback raised; the run ends there.
        """
        self._lib.bench_run(self.handle, cycle)
        if self._error is not None:
            error, self._error = self._error, None
            raise error

    def run_s(self, time_s: float) -> None:
        """Run for a time from now."""
        self.run_until(self.cycle + cycles(time_s))

    def stop(self) -> None:
        """End the run from within a callback."""
        self._lib.bench_stop(self.handle)

    def at(self, cycle: int, call: Callable[[], None]) -> None:
        """Call back at an absolute cycle (now, if it has passed)."""
        self._next_timer = (self._next_timer + 1) & 0xFFFFFFFF
        self._timers[self._next_timer] = call
        self._lib.bench_timer(self.handle, max(cycle, self.cycle), self._next_timer)

    def after_s(self, time_s: float, call: Callable[[], None]) -> None:
        """Call back after a time from now."""
        self.at(self.cycle + cycles(time_s), call)

    def _on_event(self, kind: int, source: int, cycle: int, value: int) -> None:
        try:
            self._dispatch(kind, source, cycle, value)
        except BaseException as error:
            if self._error is None:
                self._error = error
            self.stop()

    def _dispatch(self, kind: int, source: int, cycle: int, value: int) -> None:
        if kind == _TIMER:
            self._timers.pop(source)()
        elif kind == int(LogKind.PIN):
            for on_pin in self._pin_listeners.get(source, ()):
                on_pin(bool(value), cycle)
        elif kind == int(LogKind.UART_TX):
            for on_byte in self._uart_listeners.get(source, ()):
                on_byte(value, cycle)
        elif kind == _I2C:
            self._i2c_listeners[source](value >> 8, value & 0xFF)
        elif kind == int(LogKind.OUT_OF_RESET):
            for on_start in self._start_listeners:
                on_start(cycle)

    # ---- pins -----------------------------------------------------------------------------

    def watch(self, *names: str) -> None:
        """Log every level change of these pins."""
        for name in names:
            self._watched.add(pin_number(name))
            self._set_watch(pin_number(name))

    def on_pin(self, name: str, listener: Callable[[bool, int], None]) -> None:
        """Call ``listener(level, cycle)`` at every level change of a pin."""
        self._pin_listeners.setdefault(pin_number(name), []).append(listener)
        self._set_watch(pin_number(name))

    def _set_watch(self, number: int) -> None:
        self._lib.bench_pin_watch(
            self.handle, number, number in self._watched, number in self._pin_listeners
        )

    def level(self, name: str) -> bool:
        """Level of a pin now."""
        return bool(self._lib.bench_pin_level(self.handle, pin_number(name)))

    def is_output(self, name: str) -> bool:
        """Whether the chip drives the pin now."""
        return bool(self._lib.bench_pin_driven(self.handle, pin_number(name)))

    def drive(self, name: str, level: bool | None, *, at_cycle: int | None = None) -> None:
        """Drive a pin from outside, or let it go (``None``), now or at a cycle."""
        drive = 0 if level is None else 2 if level else 1
        if at_cycle is None:
            self._lib.bench_pin_strong(self.handle, pin_number(name), drive)
        else:
            self._lib.bench_pin_strong_at(self.handle, at_cycle, pin_number(name), drive)

    def pull(self, name: str, level: bool | None) -> None:
        """Connect an external pull-up (true), pull-down (false) or nothing (none)."""
        weak = 0 if level is None else 2 if level else 1
        self._lib.bench_pin_weak(self.handle, pin_number(name), weak)

    def edges(self, name: str) -> tuple[NDArray[np.uint64], NDArray[np.uint32]]:
        """Edges of a watched pin.

        Returns
        -------
        cycles : NDArray[np.uint64], shape (n,)
            When.
        levels : NDArray[np.uint32], shape (n,)
            Level from then on.
        """
        chosen = self.records(LogKind.PIN, pin_number(name))
        return chosen["cycle"], chosen["value"]

    # ---- log and statistics ---------------------------------------------------------------

    def _log_view(self) -> Records:
        # Valid until the chip runs again: the log may move when it grows.
        count = self._lib.bench_log_count(self.handle)
        if count == 0:
            return np.empty(0, RECORD)
        address = self._lib.bench_log(self.handle)
        raw = (ct.c_uint8 * (count * RECORD.itemsize)).from_address(address)
        return np.frombuffer(raw, RECORD)

    def log(self) -> Records:
        """Copy of all records since the chip was made or the log cleared."""
        return self._log_view().copy()

    def records(self, kind: LogKind, source: int | None = None) -> Records:
        """Copy of the records of one kind and, if given, of one source."""
        return select(self._log_view(), kind, source)

    def clear_log(self) -> None:
        """Forget all records."""
        self._lib.bench_clear_log(self.handle)

    def faults(self) -> list[tuple[int, int, int]]:
        """Cycle, :class:`~simavr_bench.log.Fault` and detail of everything outside the model."""
        chosen = self.records(LogKind.FAULT)
        return [(int(r["cycle"]), int(r["source"]), int(r["value"])) for r in chosen]

    def log_interrupts(self, on: bool = True) -> None:
        """Record every interrupt entry and return (many records)."""
        self._lib.bench_log_interrupts(self.handle, on)

    def log_marks(self, on: bool = True) -> None:
        """Record every byte the program writes to GPIOR0, 1 or 2 (one cycle of its time each)."""
        self._lib.bench_log_marks(self.handle, on)

    def watch_pc(self, symbol: str) -> int:
        """Record every execution of the first instruction of a function.

        The simulator then goes one instruction at a time, several times slower.

        Parameters
        ----------
        symbol : str
            Function in the ELF.

        Returns
        -------
        int
            Source of its :attr:`LogKind.PC` records.
        """
        self._pc_watches += 1
        self._lib.bench_watch_pc(self.handle, self.symbols[symbol][0], self._pc_watches)
        return self._pc_watches

    def load_now(self) -> CpuLoad:
        """CPU cycles by state since the start or :meth:`clear_statistics`."""
        counts = (ct.c_uint64 * 3)()
        self._lib.bench_load(self.handle, counts)
        return CpuLoad(running=counts[0], sleeping=counts[1], held=counts[2])

    def interrupt(self, vector: int) -> VectorStatistics:
        """Latency and length of one vector since the last :meth:`clear_statistics`."""
        return vector_statistics(self._lib.bench_vector(self.handle, vector).contents)

    def clear_statistics(self) -> None:
        """Start load, interrupt and stack statistics again."""
        self._lib.bench_clear_statistics(self.handle)

    @property
    def lowest_sp(self) -> int:
        """Lowest stack pointer seen at interrupt entries and between bursts of instructions."""
        return int(self._lib.bench_lowest_sp(self.handle))

    @property
    def sp(self) -> int:
        """Stack pointer now."""
        return int(self._lib.bench_sp(self.handle))

    @property
    def pc(self) -> int:
        """Program counter now, in bytes."""
        return int(self._lib.bench_pc(self.handle))

    # ---- memory ---------------------------------------------------------------------------

    def data(self, address: int, count: int) -> bytes:
        """Bytes of the data space (registers, I/O without side effects, SRAM)."""
        return ct.string_at(self._lib.bench_data(self.handle) + address, count)

    def poke(self, address: int, value: bytes) -> None:
        """Write bytes of the data space without side effects."""
        ct.memmove(self._lib.bench_data(self.handle) + address, value, len(value))

    def eeprom(self) -> bytes:
        """All 4096 bytes of EEPROM."""
        return ct.string_at(self._lib.bench_eeprom(self.handle), 4096)

    def set_eeprom(self, content: bytes) -> None:
        """Set all 4096 bytes of EEPROM.

        Raises
        ------
        ValueError
            If there are not 4096.
        """
        if len(content) != 4096:
            raise ValueError(f"EEPROM of {len(content)} bytes, expected 4096")
        ct.memmove(self._lib.bench_eeprom(self.handle), content, 4096)

    def flash(self, address: int, count: int) -> bytes:
        """Bytes of program memory."""
        return ct.string_at(self._lib.bench_flash(self.handle) + address, count)

    def read(self, symbol: str, form: str = "") -> int:
        """Read an integer variable by name.

        Parameters
        ----------
        symbol : str
            Name in the ELF.
        form : str
            struct format without byte order; by default unsigned of the symbol's size.

        Returns
        -------
        int
            Its value now.

        Raises
        ------
        KeyError
            If the ELF has no such symbol.
        """
        address, size = self.symbols[symbol]
        raw = self.data(address, struct.calcsize("<" + form) if form else size)
        return int(struct.unpack("<" + form, raw)[0] if form else int.from_bytes(raw, "little"))

    def read_array(self, symbol: str, dtype: str) -> NDArray[np.generic]:
        """Read an array variable by name as numpy ``dtype`` (little-endian)."""
        address, size = self.symbols[symbol]
        return np.frombuffer(self.data(address, size), dtype)

    # ---- analogue, serial, TWI ------------------------------------------------------------

    def analog(self, channel: int, volt: float, *, noise_lsb: float = 0.0) -> None:
        """Hold an analogue input at a voltage, with normal noise of so many counts rms."""
        self.analog_profile(channel, [0], [volt])
        self._lib.bench_analog_noise(self.handle, channel, noise_lsb)

    def analog_profile(self, channel: int, at_cycle: ArrayLike, volt: ArrayLike) -> None:
        """Give an analogue input straight lines between points.

        Parameters
        ----------
        channel : int
            0..15.
        at_cycle : array_like, shape (n,)
            Cycles, never falling; two equal ones make a step.
        volt : array_like, shape (n,)
            Voltage at them; constant before the first and after the last.

        Raises
        ------
        ValueError
            If the shapes differ or the cycles fall.
        """
        x = np.ascontiguousarray(at_cycle, np.float64)
        y = np.ascontiguousarray(volt, np.float64)
        if x.shape != y.shape or x.ndim != 1 or np.any(np.diff(x) < 0):
            raise ValueError("expected as many voltages as cycles, the cycles never falling")
        pointer = ct.POINTER(ct.c_double)
        self._lib.bench_analog_set(
            self.handle, channel, x.ctypes.data_as(pointer), y.ctypes.data_as(pointer), len(x)
        )

    def analog_supply(
        self, avcc_volt: float, *, aref_volt: float | None = None, bandgap_volt: float = 1.1
    ) -> None:
        """Set the references of the converter."""
        aref = avcc_volt if aref_volt is None else aref_volt
        self._lib.bench_analog_supply(self.handle, avcc_volt, aref, bandgap_volt)

    @property
    def adc_conversions(self) -> int:
        """Conversions finished so far."""
        return int(self._lib.bench_adc_conversions(self.handle))

    def uart_send(self, port: int, data: bytes, *, baud: float, at_cycle: int = 0) -> None:
        """Put bytes on a receive line (8N1), after those already on their way."""
        self._lib.bench_uart_send(self.handle, port, data, len(data), CYCLES_PER_S / baud, at_cycle)

    def uart_sent(self, port: int) -> bytes:
        """All bytes the chip has sent, whole ones only."""
        chosen = self.records(LogKind.UART_TX, port)
        return bytes(chosen["value"].astype(np.uint8))

    def on_uart(self, port: int, listener: Callable[[int, int], None]) -> None:
        """Call ``listener(byte, cycle)`` at the end of every byte the chip sends."""
        self._uart_listeners.setdefault(port, []).append(listener)
        self._lib.bench_uart_notify(self.handle, port, True)

    def uart_lost(self, port: int) -> int:
        """Received bytes lost by overrun."""
        return int(self._lib.bench_uart_lost(self.handle, port))

    def twi_send(
        self,
        address: int,
        data: bytes,
        *,
        at_cycle: int = 0,
        scl_hz: float = 100_000.0,
        dies: int = 0,
        dies_after: int = 0,
    ) -> int:
        """Let the external master write to a slave on the hardware TWI.

        Parameters
        ----------
        address : int
            7 bits.
        data : bytes
            At most 128.
        at_cycle : int
            START not before this; waits for a free bus.
        scl_hz : float
            Bus clock.
        dies : int
            0 the packet is whole; 1 the master lets the lines go in the middle of a byte, 2 it
            keeps SDA low, 3 it keeps SCL low.
        dies_after : int
            Whole data bytes before it dies.

        Returns
        -------
        int
            Number of the packet, as in :meth:`twi_results`.
        """
        number = self._next_packet
        self._next_packet += 1
        self._lib.bench_twi_send(
            self.handle, at_cycle, number, address, data, len(data),
            round(CYCLES_PER_S / scl_hz), dies, dies_after,
        )  # fmt: skip
        return number

    def twi_hold(self, *, sda: bool, scl: bool) -> None:
        """Hold lines of the hardware TWI low, or let them go."""
        self._lib.bench_twi_hold(self.handle, sda, scl)

    def twi_results(self) -> dict[int, int]:
        """Acknowledged data bytes by packet number, for packets that are over."""
        chosen = self.records(LogKind.TWI)
        over = chosen[(chosen["source"] == TwiNote.DONE) | (chosen["source"] == TwiNote.DIED)]
        return {int(v) >> 8: int(v) & 0xFF for v in over["value"]}

    def twi_stretch_cycles(self) -> NDArray[np.uint32]:
        """How long the chip held SCL low, one figure per packet that is over."""
        chosen = self.records(LogKind.TWI, TwiNote.STRETCH)
        stretch: NDArray[np.uint32] = chosen["value"]
        return stretch

    def on_i2c_write(self, number: int, listener: Callable[[int, int], None]) -> None:
        """Call ``listener(register, value)`` when a bit-banged device is written (for models)."""
        self._i2c_listeners[number] = listener

    def untouched_stack(self, first: int, before: bytes) -> int:
        """Bytes from ``first`` upwards that still are as in ``before``.

        Parameters
        ----------
        first : int
            Lowest address the stack may use (``_end`` or the end of ``.noinit``).
        before : bytes
            Memory from ``first``, taken when nothing had run there.

        Returns
        -------
        int
            Length of the run of unchanged bytes.
        """
        now = np.frombuffer(self.data(first, len(before)), np.uint8)
        changed = np.flatnonzero(now != np.frombuffer(before, np.uint8))
        return int(changed[0]) if len(changed) else len(before)


def run_together(chips: Iterable[Chip], time_s: float, slice_s: float = 1e-3) -> None:
    """Run several chips side by side in slices of simulated time."""
    every = list(chips)
    ends = [chip.cycle + cycles(time_s) for chip in every]
    while any(chip.cycle < end for chip, end in zip(every, ends, strict=True)):
        for chip, end in zip(every, ends, strict=True):
            chip.run_until(min(end, chip.cycle + cycles(slice_s)))
