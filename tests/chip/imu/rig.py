"""Two images on one bus: the IMU's ATmega328P as master, the Mega in its flight rig as slave."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from flight.rig import CRUISE_US, MEGA_US, FlightRig
from flight.settings import settings_image
from numpy.typing import NDArray
from simavr_bench import Chip, GpsUart, I2cBus, Magnetometer, Mpu6000

TCCR5B = 0x121
RAM_END = 0x900
BOOTLOADER = Path(
    "/usr/share/arduino/hardware/arduino/avr/bootloaders/atmega/ATmegaBOOT_168_atmega328.hex"
)


class ImuBoard:
    """An ArduIMU with its sensors, unpowered.

    Parameters
    ----------
    elf : Path
        The IMU's image.
    slave : Chip, optional
        The Mega; without one nobody answers.
    clock_ppm : float
        The board's resonator against the Mega's.
    mpu_ppm : float
        The sensor's clock against the board's.
    product_id : int
        Product id of the sensor.
    over_i2c : bool
        An MPU-6050 on the bus instead of an MPU-6000 on SPI.
    qmc : bool
        A QMC5883L where a HMC5883L is expected.
    bootloader : bool
        Start in Debian's copy of the board's bootloader.
    seed : int
        Seed of noise, jitter and memory at power-on.
    """

    def __init__(
        self,
        elf: Path,
        slave: Chip | None = None,
        *,
        clock_ppm: float = 0.0,
        mpu_ppm: float = 0.0,
        product_id: int = 0x58,
        over_i2c: bool = False,
        qmc: bool = False,
        bootloader: bool = False,
        seed: int = 2,
    ) -> None:
        self.chip = Chip(model="atmega328p", bootloader=bootloader, startup_s=0.065, seed=seed)
        if bootloader:
            self.chip.load(BOOTLOADER)
        self.chip.load(elf)
        self.bus = I2cBus(self.chip, slave, master_ppm=clock_ppm)
        self.mpu = Mpu6000(
            self.chip,
            bus=self.bus if over_i2c else None,
            clock_ppm=mpu_ppm,
            product_id=product_id,
        )
        self.magnetometer = Magnetometer(self.chip, self.bus, qmc=qmc)
        self.gps = GpsUart(self.chip, 0, knows_pvt=True)
        self._stack = b""

    def power_on(self) -> None:
        """Give power to the board and its GPS."""
        self.chip.power_on()
        low = self._stack_low()
        self._stack = self.chip.data(low, RAM_END - low)
        self.gps.start()

    def _stack_low(self) -> int:
        return self.chip.symbols["_end"][0]

    @property
    def stack_room(self) -> int:
        """Bytes between the variables and the end of RAM."""
        return RAM_END - self._stack_low()

    def stack_untouched(self) -> int:
        """Bytes of stack that nothing wrote to since power-on."""
        return self.chip.untouched_stack(self._stack_low(), self._stack)


class PairRig:
    """The flight rig with a real IMU image at the other end of the bus.

    Parameters
    ----------
    mega_elf, imu_elf, card_image : Path
        Images of both chips and of the card.
    rate_hz : int
        What the Mega logs.
    clock_ppm, mpu_ppm, over_i2c, product_id, bootloader
        See :class:`ImuBoard`.
    in_place : bool
        See :class:`flight.rig.FlightRig`.
    """

    def __init__(
        self,
        mega_elf: Path,
        imu_elf: Path,
        card_image: Path,
        *,
        rate_hz: int = 200,
        clock_ppm: float = 0.0,
        mpu_ppm: float = 0.0,
        product_id: int = 0x58,
        over_i2c: bool = False,
        bootloader: bool = False,
        in_place: bool = True,
    ) -> None:
        self.flight = FlightRig(mega_elf, card_image, in_place=in_place)
        self.flight.chip.load(settings_image(rate_hz=rate_hz))
        self.flight.imu.silent = True  # the modelled IMU; the real image takes its place
        self.mega = self.flight.chip
        self.board = ImuBoard(
            imu_elf,
            self.mega,
            clock_ppm=clock_ppm,
            mpu_ppm=mpu_ppm,
            product_id=product_id,
            over_i2c=over_i2c,
            bootloader=bootloader,
        )
        self.mega_zero_cycle = 0

    def power_on(self) -> None:
        """Give power to everything at once."""
        self.board.power_on()
        self.flight.power_on()
        # The Mega's microseconds count from the instruction that starts timer 5.
        while self.mega.data(TCCR5B, 1) == b"\0":
            self.mega.run_until(self.mega.cycle + 1)
        self.mega_zero_cycle = self.mega.cycle

    def take_off(self, *, ground_s: float = 12.0) -> None:
        """Power on, wait on the ground, throttle up, switch to direct and then to Mega."""
        self.power_on()
        self.mega.run_s(ground_s)
        self.flight.receiver.width_us[3] = CRUISE_US
        self.mega.run_s(1.5)
        self.flight.receiver.width_us[4] = MEGA_US
        self.mega.run_s(0.5)

    def samples_us(self) -> NDArray[np.float64]:
        """Instant of every sample of the sensor, in microseconds of the Mega's clock."""
        cycles = self.board.mpu.samples()["cycle"]
        at = np.array([self.board.bus.slave_cycle(int(cycle)) for cycle in cycles])
        return np.asarray((at - self.mega_zero_cycle) / 16.0, np.float64)

    def close(self) -> None:
        """Free both chips."""
        self.board.chip.close()
        self.mega.close()
