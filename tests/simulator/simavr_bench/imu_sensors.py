"""The sensors of the IMU board: MPU-6000 (SPI) or MPU-6050 (I2C), HMC5883L or QMC5883L."""

from __future__ import annotations

import ctypes as ct
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simavr_bench.chip import CYCLES_PER_S, Chip
from simavr_bench.i2c_bus import I2cBus
from simavr_bench.library import MpuSettings
from simavr_bench.pins import pin_number

G0_MPS2 = 9.80665
SAMPLE = np.dtype(
    [("cycle", "<u8"), ("force", "<i2", 3), ("temperature", "<i2"), ("rates", "<i2", 3)],
    align=True,
)
Samples = NDArray[np.void]
_DOUBLES = ct.POINTER(ct.c_double)


class MpuFault(IntEnum):
    """How the chip fails; numbers of ``enum mpu_fault`` in shim/mpu6000.c."""

    NONE = 0
    SILENT = 1  # neither its line nor its registers
    STUCK = 2  # data-ready goes on, data stand still
    GARBAGE = 3
    CLOCK_STOPPED = 4  # registers answer, nothing is sampled


def _columns(*values: ArrayLike) -> NDArray[np.float64]:
    return np.ascontiguousarray(np.column_stack([np.asarray(v, np.float64) for v in values]))


class Mpu6000:
    """Samples a motion as the chip's registers ask, on a clock of its own.

    Mounted as on the ArduIMU V3: x forward, y left, z up.

    Parameters
    ----------
    chip : Chip
        The ATmega it is wired to.
    bus : I2cBus, optional
        Sit on this bus (an MPU-6050) instead of on SPI with chip select PD4.
    ready : str
        Pin of its data-ready line.
    product_id : int
        0x54 is revision C (half the counts per g), 0x58 revision D.
    clock_ppm, jitter_us : float
        Its clock runs fast by this much; each sample comes this much early or late at most.
    gyro_noise_lsb, accel_noise_lsb : float
        Normal noise of the output, rms.
    """

    def __init__(
        self,
        chip: Chip,
        *,
        bus: I2cBus | None = None,
        ready: str = "PD2",
        product_id: int = 0x58,
        clock_ppm: float = 0.0,
        jitter_us: float = 2.0,
        gyro_noise_lsb: float = 3.0,
        accel_noise_lsb: float = 12.0,
    ) -> None:
        self._lib, self._chip = chip.library, chip
        line = pin_number(ready)
        if bus is None:
            select = pin_number("PD4")
            self._mpu = self._lib.bench_mpu_spi(chip.handle, select, line, product_id)
        else:
            self._mpu = self._lib.bench_mpu_i2c(chip.handle, bus.handle, line, product_id)
        settings = MpuSettings(
            1.0 + clock_ppm * 1e-6, jitter_us * 16, gyro_noise_lsb, accel_noise_lsb
        )
        self._lib.bench_mpu_set(self._mpu, ct.byref(settings))
        self.motion([0.0], [[0.0, 0.0, 0.0]], [[0.0, 0.0, -G0_MPS2]])

    def motion(
        self,
        at_s: ArrayLike,
        rates_radps: ArrayLike,
        force_mps2: ArrayLike,
        temperature_degc: float = 31.0,
    ) -> None:
        """Give the motion from now on, straight lines between points.

        Parameters
        ----------
        at_s : array_like, shape (n,)
            Time from now.
        rates_radps, force_mps2 : array_like, shape (n, 3)
            p q r and specific force, body axes x forward, y right, z down.
        temperature_degc : float
            Temperature of the chip.
        """
        turn = np.array([1.0, -1.0, -1.0])
        force = np.asarray(force_mps2, np.float64) * turn / G0_MPS2
        rates = np.rad2deg(np.asarray(rates_radps, np.float64)) * turn
        at = self._chip.cycle + np.asarray(at_s, np.float64) * CYCLES_PER_S
        values = _columns(force, np.full(len(at), temperature_degc), rates)
        self._lib.bench_mpu_motion(
            self._mpu, at.ctypes.data_as(_DOUBLES), values.ctypes.data_as(_DOUBLES), len(at)
        )

    def fail(self, how: MpuFault) -> None:
        """Fail in a way, or recover."""
        self._lib.bench_mpu_fault(self._mpu, int(how))

    def reset(self) -> None:
        """Let the chip lose its registers, as its own brown-out does: it sleeps."""
        self._lib.bench_mpu_reset(self._mpu)

    def register(self, number: int) -> int:
        """Give the value of a register, without the effects of reading it."""
        return int(self._lib.bench_mpu_registers(self._mpu)[number])

    def poke(self, number: int, value: int) -> None:
        """Write a register as a program would."""
        self._lib.bench_mpu_write(self._mpu, number, value)

    def samples(self) -> Samples:
        """Every sample so far that was announced by the data-ready line.

        Returns
        -------
        NDArray, shape (n,)
            Fields ``cycle`` (of data-ready, clock of the ATmega), ``force`` and ``rates`` (counts,
            axes of the chip), ``temperature``.
        """
        count = self._lib.bench_mpu_count(self._mpu)
        if count == 0:
            return np.empty(0, SAMPLE)
        address = self._lib.bench_mpu_samples(self._mpu)
        raw = (ct.c_uint8 * (count * SAMPLE.itemsize)).from_address(address)
        samples: Samples = np.frombuffer(raw, SAMPLE).copy()
        return samples


class Magnetometer:
    """HMC5883L at 0x1E, or the QMC5883L sold under its name at 0x0D, on the IMU's bus.

    Mounted as on the ArduIMU V3: x backward, y right, z up.
    """

    def __init__(self, chip: Chip, bus: I2cBus, *, qmc: bool = False) -> None:
        self._lib, self._chip = chip.library, chip
        self._sensor = self._lib.bench_magnetometer(chip.handle, bus.handle, qmc)
        self.field([0.0], [[0.25e-4, 0.0, 0.38e-4]])

    def field(self, at_s: ArrayLike, field_t: ArrayLike) -> None:
        """Give the field in body axes from now on, in tesla, straight lines between points.

        Parameters
        ----------
        at_s : array_like, shape (n,)
            Time from now.
        field_t : array_like, shape (n, 3)
            Field in body axes.
        """
        at = self._chip.cycle + np.asarray(at_s, np.float64) * CYCLES_PER_S
        values = _columns(np.asarray(field_t, np.float64) * 1e4 * np.array([-1.0, 1.0, -1.0]))
        self._lib.bench_magnetometer_field(
            self._sensor, at.ctypes.data_as(_DOUBLES), values.ctypes.data_as(_DOUBLES), len(at)
        )

    def fail(self, *, absent: bool = False, stuck: bool = False) -> None:
        """Go silent or stand still; without arguments recover."""
        self._lib.bench_magnetometer_fault(self._sensor, not absent, stuck)

    @property
    def count(self) -> int:
        """Samples made so far."""
        return int(self._lib.bench_magnetometer_count(self._sensor))
