"""A UART of the chip as a pseudo-terminal, for programs that want a serial port.

The one place where the simulator meets the clock on the wall: programs such as avrdude time out in
real seconds, so the chip may run ahead of them only while bytes are flowing. A busy computer stops
them for seconds; a bootloader that waits must not have gone meanwhile.
"""

from __future__ import annotations

import os
import select
import time
import tty
from collections.abc import Callable
from types import TracebackType

from simavr_bench.chip import Chip, ResetCause


class PtyBridge:
    """Connects one UART to a pseudo-terminal.

    Parameters
    ----------
    chip : Chip
        The chip, powered.
    port : int
        Its UART, 0 for USB.
    baud : float
        What the program outside speaks; a pseudo-terminal does not tell.
    reset_on_open : bool
        Reset the chip when a program opens the terminal, in place of the DTR line that it lacks,
        and let the chip wait for that program: while no byte flows, `BUSY_S` pass for what it does
        with the last ones, and then `WAITING` of the time on the wall.

    Attributes
    ----------
    path : str
        Name of the terminal to open.
    """

    SLICE_S = 0.001
    WAITING = 0.1
    BUSY_S = 0.1

    def __init__(
        self, chip: Chip, port: int = 0, *, baud: float = 115200.0, reset_on_open: bool = False
    ) -> None:
        self._chip = chip
        self._port = port
        self._baud = baud
        self._reset = reset_on_open
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._out = bytearray()
        self._opened = False
        os.close(self._slave)  # from now on the master tells whether somebody has it open
        self._poll = select.poll()
        self._poll.register(self._master, select.POLLIN | select.POLLHUP)
        chip.on_uart(port, lambda byte, cycle: self._out.append(byte))

    def close(self) -> None:
        """Close our end."""
        os.close(self._master)

    def __enter__(self) -> PtyBridge:
        """Give the bridge itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close our end."""
        self.close()

    def _exchange(self) -> bool:
        """Carry bytes both ways; return whether the program outside sent any."""
        [(_, ready)] = self._poll.poll(0) or [(self._master, 0)]
        opened = not ready & select.POLLHUP
        if opened and not self._opened and self._reset:
            self._out.clear()
            self._chip.reset(ResetCause.EXTERNAL)
            self._chip.run_s(0.1)  # start-up delay and the bootloader's first instructions
        self._opened = opened
        if not opened:
            self._out.clear()  # nobody listens
            return False
        if self._out:
            try:
                sent = os.write(self._master, self._out)
            except BlockingIOError:
                sent = 0
            del self._out[:sent]
        if not ready & select.POLLIN:
            return False
        self._chip.uart_send(self._port, os.read(self._master, 4096), baud=self._baud)
        return True

    def serve(self, done: Callable[[], bool], *, limit_s: float = 60.0) -> None:
        """Run the chip and carry bytes until ``done()``.

        Parameters
        ----------
        done : callable
            Looked at once per millisecond of simulated time.
        limit_s : float
            Real time after which to give up.

        Raises
        ------
        TimeoutError
            If ``done()`` stays false.
        """
        began_s, from_s = time.monotonic(), self._chip.time_s
        pace, busy_s = (self.WAITING, self.BUSY_S) if self._reset else (1.0, 0.0)
        while not done():
            flowing = self._exchange() or bool(self._out)
            waited_s = time.monotonic() - began_s
            if waited_s > limit_s:
                raise TimeoutError(f"nothing came of it in {limit_s} s")
            passed_s = pace * waited_s
            if flowing:
                from_s = self._chip.time_s - passed_s  # time spent in bytes is no lead
            elif self._chip.time_s - from_s > passed_s + busy_s:
                time.sleep(self.SLICE_S)
                continue
            self._chip.run_s(self.SLICE_S)
        self._exchange()
