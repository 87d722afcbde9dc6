"""The I2C bus that joins a chip as master with a chip as slave and with register chips."""

from __future__ import annotations

from dataclasses import dataclass

from simavr_bench.chip import Chip
from simavr_bench.log import LogKind, TwiNote


@dataclass(frozen=True, slots=True)
class Transfer:
    """One write that was acknowledged.

    Attributes
    ----------
    start : int
        Cycle of the master's clock at START.
    address : int
        7 bits.
    data : bytes
        What followed the address, whether acknowledged or not.
    whole : bool
        Ended by STOP.
    """

    start: int
    address: int
    data: bytes
    whole: bool


class I2cBus:
    """Joins the TWI of two chips; from then on running one runs both.

    Parameters
    ----------
    master : Chip
        Its program drives the bus. Only it may be a master.
    slave : Chip, optional
        Answers as its program sets TWAR, TWAMR and TWEA.
    master_ppm : float
        The master's oscillator runs fast against the slave's by this much.

    Raises
    ------
    ValueError
        If a chip is on a bus already.
    """

    def __init__(self, master: Chip, slave: Chip | None = None, *, master_ppm: float = 0.0) -> None:
        self._lib = master.library
        self.master, self.slave = master, slave
        rate = 1.0 + master_ppm * 1e-6
        handle = None if slave is None else slave.handle
        self.handle = self._lib.bench_bus(master.handle, handle, rate)
        if not self.handle:
            raise ValueError("a chip can be on one bus only")
        if slave is not None:
            master.join(slave)

    def hold(
        self,
        *,
        sda_low: bool = False,
        scl_low: bool = False,
        sda_high: bool = False,
        scl_high: bool = False,
    ) -> None:
        """Short lines to ground or to the supply; without arguments let both go."""
        self._lib.bench_bus_hold(self.handle, sda_low, scl_low, sda_high, scl_high)

    def hang(self, clocks: int) -> None:
        """Hold SDA low as a slave does that waits for so many clocks more."""
        self._lib.bench_bus_hang(self.handle, clocks)

    def stretch(self, time_s: float) -> None:
        """Hold SCL for a time after every byte behind the address."""
        self._lib.bench_bus_stretch(self.handle, time_s * 16e6)

    def listen(self, *addresses: int) -> None:
        """Acknowledge everything sent to these addresses, as a slave that is not modelled."""
        for address in addresses:
            self._lib.bench_bus_listen(self.handle, address)

    def log_bytes(self, on: bool = True) -> None:
        """Record every byte written, for :meth:`writes`."""
        self._lib.bench_bus_log_bytes(self.handle, on)

    def writes(self) -> list[Transfer]:
        """Give every write since :meth:`log_bytes`, in order."""
        found: list[Transfer] = []
        start, address, data = 0, -1, bytearray()
        for record in self.master.records(LogKind.TWI):
            note, value = int(record["source"]), int(record["value"])
            if note in (TwiNote.START, TwiNote.DONE):
                if address >= 0:
                    found.append(Transfer(start, address, bytes(data), note == TwiNote.DONE))
                start, address, data = int(record["cycle"]), -1, bytearray()
            elif note == TwiNote.ADDRESSED and value & 1 == 0:
                address = value >> 1
            elif note == TwiNote.BYTE:
                data.append(value)
        return found

    def slave_cycle(self, master_cycle: int) -> float:
        """Cycle of the slave's clock at a cycle of the master's, since both were joined."""
        return float(self._lib.bench_bus_time(self.handle, self.master.handle, master_cycle))
