"""A simulated ATmega2560 with the devices of the flight recorder around it.

The instruction core is Debian's unmodified libsimavr; everything around it is modelled in
``tests/simavr/shim``. Simulation only: nothing here was measured on a board.
"""

from simavr_bench.chip import CYCLES_PER_S, Chip, ResetCause, cycles
from simavr_bench.firmware import Image, read_image
from simavr_bench.log import Fault, LogKind
from simavr_bench.pins import arduino_pin, pin_name, pin_number

__all__ = [
    "CYCLES_PER_S",
    "Chip",
    "Fault",
    "Image",
    "LogKind",
    "ResetCause",
    "arduino_pin",
    "cycles",
    "pin_name",
    "pin_number",
    "read_image",
]
