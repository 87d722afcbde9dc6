"""The simulator's log: one record per observable event, in time order."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class LogKind(IntEnum):
    """Kinds of record; the numbers of ``enum log_kind`` in shim/chip.h."""

    PIN = 0
    UART_TX = 1
    RESET = 2
    TWI = 3
    UART_LOST = 4
    FAULT = 5
    SPI = 6
    CARD = 7
    POWER = 8
    INTERRUPT = 9
    OUT_OF_RESET = 10
    MARK = 11
    PC = 12


class Fault(IntEnum):
    """What the chip does not define or the model does not cover; ``enum fault`` in shim/chip.h."""

    BAD_ADDRESS = 1
    TIMER_MODE = 2
    TIMER_CLOCK = 3
    TWI_MASTER = 4
    SLEEP_MODE = 5
    CONTENTION = 6
    SPI_SLAVE = 7
    FLASH = 8
    ADC = 9


class TwiNote(IntEnum):
    """Sources of TWI records; ``enum twi_note`` in shim/twi.h."""

    DONE = 0
    DIED = 1
    REFUSED = 2
    STRETCH = 3
    START = 4
    ADDRESSED = 5
    BYTE = 6


class CardNote(IntEnum):
    """Sources of card records; ``enum card_note`` in shim/sd_card.c."""

    WRITTEN = 0
    REJECTED = 1
    LOST = 2
    IGNORED = 3


RECORD = np.dtype(
    [("cycle", "<u8"), ("kind", "<u2"), ("source", "<u2"), ("value", "<u4")], align=False
)

Records = NDArray[np.void]


def select(records: Records, kind: LogKind, source: int | None = None) -> Records:
    """Records of one kind and, if given, of one source."""
    wanted = records["kind"] == int(kind)
    if source is not None:
        wanted &= records["source"] == source
    chosen: Records = records[wanted]
    return chosen


def pulses(cycles: NDArray[np.uint64], levels: NDArray[np.uint32]) -> NDArray[np.uint64]:
    """High pulses of one pin.

    Parameters
    ----------
    cycles : NDArray[np.uint64], shape (n,)
        Time of every edge.
    levels : NDArray[np.uint32], shape (n,)
        Level after it.

    Returns
    -------
    NDArray[np.uint64], shape (m, 2)
        Start and end cycle of every pulse that both begins and ends in the record.
    """
    rising = np.flatnonzero(levels[:-1] == 1)
    return np.column_stack((cycles[rising], cycles[rising + 1])).astype(np.uint64)
