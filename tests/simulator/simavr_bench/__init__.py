"""Simulated ATmegas with chips and instruments around them.

The instruction core is Debian's unmodified libsimavr; everything around it is modelled in
``tests/simulator/shim``. Simulation only: nothing here was measured on a board.
"""

from simavr_bench.barometer import Bmp085, Bmp280
from simavr_bench.chip import CYCLES_PER_S, Chip, ResetCause, cycles
from simavr_bench.firmware import Image, read_image
from simavr_bench.fork import ForkError, in_fork
from simavr_bench.gps import GpsUart
from simavr_bench.i2c_bus import I2cBus
from simavr_bench.imu_sensors import Magnetometer, Mpu6000, MpuFault
from simavr_bench.log import Fault, LogKind
from simavr_bench.pins import arduino_pin, pin_name, pin_number
from simavr_bench.radio import XBee
from simavr_bench.receiver import Receiver
from simavr_bench.relay import ChargePumpRelay
from simavr_bench.sd_card import CardKind, SdCard
from simavr_bench.supply import Supply

__all__ = [
    "CYCLES_PER_S",
    "Bmp085",
    "Bmp280",
    "CardKind",
    "ChargePumpRelay",
    "Chip",
    "Fault",
    "ForkError",
    "GpsUart",
    "I2cBus",
    "Image",
    "LogKind",
    "Magnetometer",
    "Mpu6000",
    "MpuFault",
    "Receiver",
    "ResetCause",
    "SdCard",
    "Supply",
    "XBee",
    "arduino_pin",
    "cycles",
    "in_fork",
    "pin_name",
    "pin_number",
    "read_image",
]
