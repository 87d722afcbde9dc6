"""What is flown: eight receivers one after the other, stalls, rejects, sensors that move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flight.rig import MEGA_US
from host.wire.schema_text import packed_schema
from numpy.typing import NDArray

CYCLES_PER_S = 16_000_000
# firmware/boards/arduimu samples and sends at this rate whatever the logger's; its aux fields take
# turns, a field of the magnetometer (15 a second) first.
IMU_HZ = 200
IMU_DELAY_US = 3000.0  # from a sample to its START
# No two clocks agree: every phase between IMU, receiver, servos and loop is met in ten minutes.
IMU_PPM = -1100.0
RECEIVER_PPM = 270.0
IMU_FLAGS = sum(
    packed_schema().bit("imu_flags", word)
    for word in ("attitude_valid", "mag_valid", "offsets_valid")
)
MAGNETOMETER, GYRO_BIAS, STATUS = (
    packed_schema().number("imu_aux", word) for word in ("magnetometer", "gyro_bias", "status")
)
PACKETS_PER_FIELD = 13  # 15.4 a second
STALL_S = {100: 0.500, 200: 0.250}
STALL_EVERY_S = 3.0
# From the end of a stall until the ring is as empty as before it: nine blocks of 5 ms busy and
# 9 ms on the bus. Two stalls nearer to each other than that would be one longer stall.
RECOVERY_S = 0.2
BUSY_S = 0.005
SCHEMA_RETURN_S = 60.0

FRAMES_S = (0.014, 0.018, 0.020, 0.0225)
SETTLE_S = 2.5  # of the change from one receiver to the next, not judged

AVCC_VOLT = 5.0
RAMP_SLOTS = (0, 2, 4, 6, 8)  # the slots between them step
LOW_VOLT, HIGH_VOLT = 0.5, 4.5
RAMP_PERIOD_S = 0.0837  # up and down again: 19.6 counts a millisecond


@dataclass(frozen=True, slots=True)
class ReceiverKind:
    """One receiver of the field."""

    frame_s: float
    sequential: bool

    @property
    def true_frame_s(self) -> float:
        """As the Mega's clock sees it."""
        return self.frame_s * (1 + RECEIVER_PPM * 1e-6)

    @property
    def name(self) -> str:
        """As the table says it."""
        order = "one after the other" if self.sequential else "all at once"
        return f"{self.frame_s * 1e3:g} ms, {order}"


RECEIVERS = tuple(ReceiverKind(f, order) for f in FRAMES_S for order in (True, False))


@dataclass(frozen=True, slots=True)
class Stall:
    """One stall: when the card shall be busy, and what else happens to that block."""

    cycle: int
    reject: bool  # the block is refused first, so that its re-send stalls


def stalls(rate_hz: int, begin: int, end: int, rng: np.random.Generator) -> list[Stall]:
    """Plan a stall in every 3 s, at a random phase.

    The phase is uniform over all of the 3 s that leave the ring time to empty before the next 3 s
    begin: two stalls that touch would be one of twice the length. Once a minute the block is
    refused for its CRC first.

    Parameters
    ----------
    rate_hz : int
        Rate of the logger.
    begin, end : int
        Cycles between which they lie.
    rng : Generator
        Source of the phases.

    Returns
    -------
    list of Stall
        By rising cycle.
    """
    length = round(STALL_EVERY_S * CYCLES_PER_S)
    room_s = STALL_EVERY_S - STALL_S[rate_hz] - RECOVERY_S
    return [
        Stall(window + round(rng.uniform(0.0, room_s) * CYCLES_PER_S), number % 20 == 3)
        for number, window in enumerate(range(begin, end - length + 1, length))
    ]


class Sticks:
    """Sticks that never rest: sines, and each pulse up to 40 us off them.

    So that each pulse tells by its width which one it is.
    """

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self.switch_us = MEGA_US

    def __call__(self, time_s: float) -> list[float]:
        """Widths in microseconds of the five channels."""
        periods_s = np.array([2.0, 3.0, 2.5, 7.0])
        swing_us = np.array([350.0, 250.0, 300.0, 150.0])
        sines = 1500.0 + swing_us * np.sin(2 * np.pi * time_s / periods_s)
        widths = sines + self._rng.uniform(-40.0, 40.0, 4)
        return [*widths.tolist(), self.switch_us + float(self._rng.uniform(-2.0, 2.0))]


def imu_aux(sequence: int) -> tuple[int, tuple[int, int, int]]:
    """Give the aux fields of a packet as the IMU's firmware sends them."""
    if sequence % PACKETS_PER_FIELD == 0:
        return MAGNETOMETER, (200 + sequence, -300, 400)
    if sequence % 2:
        return GYRO_BIAS, (3, -4, 5)
    return STATUS, (2500, 0x0268, 0)


@dataclass(frozen=True, slots=True)
class Profile:
    """Voltage of one analogue input: straight lines between points."""

    cycles: NDArray[np.float64]
    volts: NDArray[np.float64]

    def counts(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Ideal counts of the converter at some cycles."""
        value: NDArray[np.float64] = np.interp(at, self.cycles, self.volts) * 1024 / AVCC_VOLT
        return value


def ramp(begin: int, end: int, slot: int) -> Profile:
    """Give a triangle, its phase its own in every slot."""
    half = RAMP_PERIOD_S / 2 * CYCLES_PER_S
    corners = np.arange(begin + slot * half / 7, end, half)
    volts = np.where(np.arange(len(corners)) % 2 == 0, LOW_VOLT, HIGH_VOLT)
    return Profile(corners, volts)


def steps(begin: int, end: int, rng: np.random.Generator) -> Profile:
    """Give a new level about once a second."""
    at = begin + np.cumsum(rng.uniform(0.5, 1.5, int((end - begin) / CYCLES_PER_S * 2) + 1)) * (
        CYCLES_PER_S
    )
    at = at[at < end]
    levels = rng.uniform(LOW_VOLT, HIGH_VOLT, len(at) + 1)
    # two points at one cycle make a step
    return Profile(np.repeat(at, 2), np.repeat(levels, 2)[1:-1])
