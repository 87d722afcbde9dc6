"""Analogue inputs, serial ports and the TWI of a simulated chip, from outside."""

from __future__ import annotations

import ctypes as ct
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simavr_bench.core import CYCLES_PER_S
from simavr_bench.log import LogKind, TwiNote
from simavr_bench.observation import Observation


class BusAccess(Observation):
    """What reaches the chip other than by single pins."""

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

    def analog_stick(self, *settings: int) -> None:
        """Never end a conversion of these settings of the multiplexer (0x1E: the reference)."""
        self._lib.bench_analog_stick(self.handle, sum(1 << setting for setting in settings))

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
