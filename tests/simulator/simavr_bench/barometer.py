"""BMP085 and BMP280 on a bit-banged I2C bus: registers in C, conversions here.

Bosch BST-BMP085-DS000 and BST-BMP280-DS001.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

from simavr_bench.chip import Chip, cycles
from simavr_bench.pins import pin_number

# Coefficients and raw values of the datasheet's own example.
BMP085_CALIBRATION = (408, -72, -14383, 32741, 32757, 23153, 6190, 4, -32768, -8711, 2868)
BMP280_CALIBRATION = (
    *(27504, 26435, -1000),
    *(36477, -10685, 3024, 2855, 140, -7, 15500, -14600, 6000),
)
_BMP085_WORDS = ">hhhHHHhhhhh"
_BMP280_WORDS = "<HhhHhhhhhhhh"


class RegisterDevice:
    """A device of 256 registers on two pins with pull-ups.

    Parameters
    ----------
    chip : Chip
        The master.
    sda, scl : str
        Pins of the bus.
    address : int
        7 bits.
    """

    _count = 0

    def __init__(self, chip: Chip, sda: str, scl: str, address: int) -> None:
        RegisterDevice._count += 1
        self._chip = chip
        self._sda = sda
        self._scl = scl
        number = RegisterDevice._count
        self._device = chip.library.bench_i2c_device(
            chip.handle, number, address, pin_number(sda), pin_number(scl)
        )
        self._registers = chip.library.bench_i2c_registers(self._device)
        self._held = (False, False)
        chip.on_i2c_write(number, self.written)

    def written(self, register: int, value: int) -> None:
        """The master wrote a register; devices override this."""

    def put(self, register: int, data: bytes) -> None:
        """Set registers."""
        for offset, byte in enumerate(data):
            self._registers[(register + offset) & 0xFF] = byte

    def get(self, register: int) -> int:
        """Read a register."""
        return int(self._registers[register])

    @property
    def present(self) -> bool:
        """Whether it answers its address."""
        return self._present

    @present.setter
    def present(self, present: bool) -> None:
        self._present = present
        self._chip.library.bench_i2c_present(self._device, present)

    _present = True

    def hold(self, *, sda: bool, scl: bool) -> None:
        """Hold lines of this bus low, or let them go."""
        for pin, before, now in ((self._sda, self._held[0], sda), (self._scl, self._held[1], scl)):
            if before != now:
                self._chip.library.bench_pin_pull_low(self._chip.handle, pin_number(pin), now)
        self._held = (sda, scl)

    @property
    def fastest_scl_hz(self) -> float:
        """Highest clock seen so far; 0 before the second clock."""
        shortest = self._chip.library.bench_i2c_fastest(self._device)
        return 0.0 if shortest == 0xFFFFFFFF else 16e6 / shortest


class Bmp085(RegisterDevice):
    """BMP085 at 0x77.

    A result appears after the datasheet's maximum conversion time (4.5 ms; pressure 4.5, 7.5,
    13.5, 25.5 ms by oversampling); before that the old one is read.

    Attributes
    ----------
    raw_temperature, raw_pressure : int
        UT, and UP as it is at oversampling 3 (19 bits); coarser settings give its upper bits.
    conversions : list of tuple(int, int)
        Cycle at which each conversion began and its command.
    frozen : bool
        Conversions never end.
    source : callable or None
        Gives UT and UP (19 bits) for a cycle, in place of the two above.
    """

    TEMPERATURE, PRESSURE = 0x2E, 0x34
    TIMES_S = (0.0045, 0.0075, 0.0135, 0.0255)

    def __init__(self, chip: Chip, sda: str, scl: str) -> None:
        super().__init__(chip, sda, scl, 0x77)
        self.raw_temperature = 27898
        self.raw_pressure = 23843 << 3
        self.conversions: list[tuple[int, int]] = []
        self.frozen = False
        self.source: Callable[[int], tuple[int, int]] | None = None
        self.put(0xD0, b"\x55")
        self.calibrate(BMP085_CALIBRATION)

    def calibrate(self, words: tuple[int, ...]) -> None:
        """Set AC1..AC6, B1, B2, MB, MC, MD."""
        self.put(0xAA, struct.pack(_BMP085_WORDS, *words))

    def written(self, register: int, value: int) -> None:
        """Start a conversion."""
        if register != 0xF4:
            return
        self.conversions.append((self._chip.cycle, value))
        oversampling = value >> 6
        if self.source is not None:
            self.raw_temperature, self.raw_pressure = self.source(self._chip.cycle)
        if value == self.TEMPERATURE:
            result = struct.pack(">HB", self.raw_temperature, 0)
            time_s = self.TIMES_S[0]
        elif value & 0x3F == self.PRESSURE:
            bits = 16 + oversampling
            reading = self.raw_pressure >> (19 - bits)
            result = (reading << (8 - oversampling)).to_bytes(3, "big")
            time_s = self.TIMES_S[oversampling]
        else:
            return
        if not self.frozen:
            self._chip.at(self._chip.cycle + cycles(time_s), lambda: self.put(0xF6, result))


class Bmp280(RegisterDevice):
    """BMP280 at 0x76 or 0x77: forced and normal mode, coefficients of the datasheet's example.

    Attributes
    ----------
    raw_temperature, raw_pressure : int
        20-bit results of the next measurement.
    measurements : list of int
        Cycle at which each one began.
    """

    def __init__(self, chip: Chip, sda: str, scl: str, address: int = 0x76) -> None:
        super().__init__(chip, sda, scl, address)
        self.raw_temperature = 519888
        self.raw_pressure = 415148
        self.measurements: list[int] = []
        self._mode = 0
        self._generation = 0
        self.put(0xD0, b"\x58")
        self.put(0x88, struct.pack(_BMP280_WORDS, *BMP280_CALIBRATION))
        self.put(0xF7, bytes.fromhex("800000800000"))

    def _time_s(self, control: int) -> float:
        # Datasheet 3.8.1, maximum: 1.25 + 2.3 per temperature + 2.3 per pressure + 0.575 ms
        temperature, pressure = (
            (0, 1, 2, 4, 8, 16, 16, 16)[bits] for bits in (control >> 5, (control >> 2) & 7)
        )
        return (1.25 + 2.3 * temperature + (2.3 * pressure + 0.575 if pressure else 0.0)) * 1e-3

    def written(self, register: int, value: int) -> None:
        """Start measuring, or reset."""
        if register == 0xE0 and value == 0xB6:
            self.put(0xF4, b"\0\0")
            self._generation += 1
        if register == 0xF4:
            self._generation += 1
            self._mode = value & 3
            if self._mode:
                self._measure(self._generation)

    def _measure(self, generation: int) -> None:
        if generation != self._generation:
            return
        self.measurements.append(self._chip.cycle)
        time_s = self._time_s(self.get(0xF4))
        self._chip.at(self._chip.cycle + cycles(time_s), lambda: self._finish(generation))
        if self._mode == 3:
            standby = (0.0005, 0.0625, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0)[self.get(0xF5) >> 5]
            self._chip.at(
                self._chip.cycle + cycles(time_s + standby), lambda: self._measure(generation)
            )

    def _finish(self, generation: int) -> None:
        if generation != self._generation:
            return
        self.put(0xF7, (self.raw_pressure << 4).to_bytes(3, "big"))
        self.put(0xFA, (self.raw_temperature << 4).to_bytes(3, "big"))
        if self._mode != 3:
            self.put(0xF4, bytes([self.get(0xF4) & 0xFC]))
