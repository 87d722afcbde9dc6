"""Life and time of a simulated chip: making it, power, resets, running, callbacks."""

from __future__ import annotations

import ctypes as ct
import importlib.util
from collections.abc import Callable
from enum import IntEnum
from pathlib import Path
from types import TracebackType
from typing import Self

from simavr_bench.firmware import Image, read_image
from simavr_bench.library import Callback, load_library
from simavr_bench.log import LogKind

CYCLES_PER_S = 16_000_000
# `enum chip_kind` of shim/model.h, bytes of flash and EEPROM, start of the boot section
MODELS = {
    "atmega2560": (0, 262_144, 4096, 0x3E000),
    "atmega328p": (1, 32_768, 1024, 0x7800),
}

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


class Core:
    """What every part of :class:`~simavr_bench.chip.Chip` stands on; see there."""

    def __init__(
        self,
        *,
        seed: int = 1,
        startup_s: float = 0.066024,
        bootloader: bool = False,
        model: str = "atmega2560",
    ) -> None:
        if model not in MODELS:
            raise ValueError(f"no model of {model!r}, expected one of {', '.join(MODELS)}")
        kind, self._flash_size, self._eeprom_size, boot_start = MODELS[model]
        self._lib = load_library(_library_path())
        self._chip = self._lib.bench_create(seed, kind)
        self._neighbours: list[Core] = []  # on one bus: they run together
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
        start = boot_start if bootloader else 0
        self._lib.bench_set_startup(self._chip, cycles(startup_s), start)
        self.symbols: dict[str, tuple[int, int]] = {}

    def close(self) -> None:
        """Free the chip; every other call afterwards is an error."""
        if self._chip is not None:
            self._lib.bench_destroy(self._chip)
            self._chip = None

    def __enter__(self) -> Self:
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

    def join(self, other: Core) -> None:
        """Run together with another chip, as the library does for chips on one bus."""
        self._neighbours.append(other)
        other._neighbours.append(self)

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

        Raises
        ------
        ValueError
            If the image does not fit the chip.
        """
        image = firmware if isinstance(firmware, Image) else read_image(firmware)
        for pieces, size in ((image.flash, self._flash_size), (image.eeprom, self._eeprom_size)):
            end = max((address + len(piece) for address, piece in pieces.items()), default=0)
            if end > size:
                raise ValueError(f"the image ends at {end}, the chip has {size} bytes")
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
        for chip in (self, *self._neighbours):
            if chip._error is not None:
                error, chip._error = chip._error, None
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
