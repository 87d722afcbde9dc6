"""Every row of the table, in the order of their numbers."""

from __future__ import annotations

from flight.faults.card import CARD
from flight.faults.model import Fault
from flight.faults.peripherals import PERIPHERALS
from flight.faults.program import PROGRAM
from flight.faults.receiver import RADIO, RECEIVER, SUPPLY
from flight.faults.sensors import ANALOG, BARO, GPS, IMU

NONE = Fault("-", "none", "nothing lost", lambda rig: None)
FAULTS = (
    NONE,
    *sorted(
        (*CARD, *BARO, *IMU, *RECEIVER, *ANALOG, *PERIPHERALS, *SUPPLY, *PROGRAM, *GPS, *RADIO),
        key=lambda fault: int(fault.number),
    ),
)
