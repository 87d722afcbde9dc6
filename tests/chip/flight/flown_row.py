"""The flight image with a row of a flight card under way, and which servo pulses are the card's."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from devices.ardu_imu import ImuSample
from flight.rig import DIRECT_US, FlightRig, at_rest, make_card, numbered
from flight.servos import SERVOS, strange
from flight.settings import reference_image
from host.planning.learning_card import SIX_HARMONICS, LearningCondition, learning_card
from host.planning.onboard_sums import ROLL
from host.wire.framing import EnvelopeReader
from host.wire.schema_text import packed_schema
from numpy.typing import NDArray
from simavr_bench import Image, cycles
from simavr_bench.card_journal import CardJournal

from tests.sitl import flight_cards as cards
from tests.sitl.input_flight import ARMED_US, LEAST_US, MEGA_US, MOST_US
from tests.sitl.input_judge import slewed
from tests.sitl.input_shapes import shape_of

QUIET_S, BEFORE_S = 0.2, 1.5  # of the row; flown of it before a fault
SHOWN_S, SIGN_S = 1.0, 3.4
GROUND_S = 12.0 + 5.0 * SHOWN_S + SIGN_S
TILT_S, TILT = 4.0, 3000  # 30 deg
HIGH_US = 1790.0  # the elevator's stick: 60 us below its end, so that the row is cut there
CLIMB_UP = 300 * 8  # 900 Pa of the pressure sensor
GPS_S = 0.2
MOVES_UP, MOVES_1E7 = 64, 8  # what a sensor that is alive does by itself
WIDE = {
    "dp_min": 600, "dp_max": 4000, "alpha_min": 100, "alpha_max": 4000, "beta_min": 100,
    "beta_max": 4000, "phi_max": 18000, "theta_min": -18000, "theta_max": 18000, "p_max": 32767,
    "q_max": 32767, "r_max": 32767, "az_min": -32768, "az_max": 32767, "height_max_pa": 6000,
}  # fmt: skip
ROW = cards.row(
    shape=cards.MULTISINE, axes=7, quiet_ms=200, duration_ms=19_000, amplitude_us=(100, -80, 120),
    components=[byte for k in range(10) for byte in (20 + 4 * k, 25 * k, 64 * (k % 3) + 60)],
)  # fmt: skip
LEARNED = learning_card("ultrastick25e", ROLL, LearningCondition(17.0, harmonics=SIX_HARMONICS))
HELD_ROW = cards.row(
    shape=cards.MULTISINE, axes=4 | 3 << 4, quiet_ms=200, duration_ms=19_000,
    amplitude_us=(0, 0, 120),
    components=[byte for k in range(10) for byte in (20 + 4 * k, 25 * k, 64 * 2 + 18)],
)  # fmt: skip

SPREAD_MS = 85  # a servo period, whole ticks of the rate, and that clock
NEAR = 80 * 1.6  # cycles: the relay's own judge takes 5 us, and 3 us of a command's steps


def swaying(time_s: float) -> ImuSample:
    """Give samples of an aircraft that sways a little: a row may hold it."""
    step, turn = round(time_s * 200), 2.0 * math.pi * time_s
    bank, pitch = 400.0 * math.sin(turn / 1.5), 300.0 * math.sin(turn / 1.3)
    p, q = 1097.0 * math.cos(turn / 1.5), 950.0 * math.cos(turn / 1.3)
    return ImuSample(
        (round(p) + step % 31, round(q) + 7 * step % 97, step % 27),
        (100 + step % 200, 200 - step % 150, -8192 + step % 170),
        (round(bank), round(pitch), 9000 + step % 60),
    )


@dataclass(frozen=True, slots=True)
class RowCard:
    """A card of one row, and the motion that it is flown in.

    Attributes
    ----------
    does : str
        What the row does besides its shape.
    row, data : bytes
        Its row, and the card.
    source : callable
        What the IMU sends in flight.
    authority_us : tuple of float
        Over each axis that the row holds; else 0.
    """

    does: str
    row: bytes
    data: bytes
    source: Callable[[float], ImuSample]
    authority_us: tuple[float, ...] = (0.0, 0.0, 0.0)

    @property
    def holds(self) -> bool:
        """Whether a proof by tilts comes before it."""
        return any(self.authority_us)

    @property
    def ground_s(self) -> float:
        """Time on the ground."""
        return GROUND_S + (2.0 * TILT_S if self.holds else 0.0)


TEACHES = RowCard("teaches roll", ROW, cards.card([ROW], [LEARNED], [1], **WIDE), numbered)
HOLDS = RowCard(
    "holds bank and pitch", HELD_ROW, cards.card([HELD_ROW], (), (), cards.HOLD, **WIDE), swaying,
    (*cards.HOLD["authority_us"], 0.0),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class FlownRow:
    """The row that is flown when a fault begins.

    Attributes
    ----------
    start : int
        Cycle of its trigger, by the log's clock.
    deflection : NDArray[np.float64], shape (ms, 3)
        Cycles, from the beginning of the shape.
    authority : tuple of float
        Cycles over each axis that it holds, from the trigger on; else 0.
    """

    start: int
    deflection: NDArray[np.float64]
    authority: tuple[float, ...]

    def made(self, channel: int, start: int, width: int, sticks: NDArray[np.int64]) -> bool:
        """Tell whether a pulse may be a late stick's and what the card asks for about then."""
        within = 16 * LEAST_US - NEAR <= width <= 16 * MOST_US + NEAR
        ms = round((start - self.start) / 16e3 - 1e3 * QUIET_S)
        if channel >= self.deflection.shape[1] or not within or start < self.start:
            return False
        if held := self.authority[channel]:
            low, high = -held, held
        else:
            asked = self.deflection[max(0, ms - SPREAD_MS) : max(0, ms + 2), channel]
            if not asked.size:
                return False
            low, high = min(0.0, asked.min()), max(0.0, asked.max())
        return bool(np.any((width - sticks >= low - NEAR) & (width - sticks <= high + NEAR)))


def input_rig(
    elf: Path,
    folder: Path,
    flown: RowCard = TEACHES,
    *,
    threshold_volt: float | None = None,
    frame_s: float = 0.020,
    sequential: bool = True,
) -> tuple[FlightRig, CardJournal, FlownRow]:
    """Bring a rig into the middle of a row, its card in private pages and journalled."""
    card = make_card(folder / "empty.img")
    rig = FlightRig(
        elf,
        card,
        in_place=False,
        threshold_volt=threshold_volt,
        ground_s=flown.ground_s,
        frame_s=frame_s,
        sequential=sequential,
        source=flown.source,
    )
    rig.chip.load(reference_image(1100))
    journal = CardJournal(rig.card)
    return rig, journal, begin_row(rig, flown)


def begin_row(rig: FlightRig, flown: RowCard) -> FlownRow:
    """Fly a rig, off yet, into the middle of a row of a card in its EEPROM."""
    # No more than the card: settings and the reference's voltage are others'.
    content = cards.eeprom_with(flown.data)[cards.VALID_AT : cards.CARD_AT + len(flown.data)]
    rig.chip.load(Image(flash={}, eeprom={cards.VALID_AT: content}))
    _keep_alive(rig)
    _show(rig, flown)
    rig.baro.raw_pressure -= CLIMB_UP
    for width_us, seconds in ((MEGA_US, 0.8), (ARMED_US, 0.3 + QUIET_S + BEFORE_S)):
        rig.receiver.width_us[4] = width_us
        rig.chip.run_s(seconds)
    started_us = _events(rig, "input_start")
    if len(started_us) != 1:
        raise AssertionError(f"no input began: {started_us}")
    shape = 8.0 * slewed(shape_of(flown.row), cards.HEAD["rate_max_usps"])
    return FlownRow(16 * started_us[0], shape, tuple(16.0 * us for us in flown.authority_us))


def _keep_alive(rig: FlightRig) -> None:
    """Let pressure and position move a little, as those of an aircraft do."""
    baro = rig.baro

    def pressure(cycle: int) -> tuple[int, int]:
        moved = MOVES_UP * (cycle // cycles(0.1) % 2)
        raw = baro.raw_pressure
        return baro.raw_temperature, raw and raw & ~MOVES_UP | moved

    def drift() -> None:
        rig.gps.longitude_1e7 ^= MOVES_1E7
        rig.chip.at(rig.chip.cycle + cycles(GPS_S), drift)

    baro.source = pressure
    drift()


def _show(rig: FlightRig, flown: RowCard) -> None:
    """Power on, show the sticks' travel, give the sign that enables the card, tilt, take off."""
    width_us = rig.receiver.width_us
    rig.power_on()
    rig.chip.run_s(10.0)
    for place_us in (LEAST_US, 1500.0, MOST_US, 1500.0):
        width_us[:3] = [float(place_us)] * 3
        rig.chip.run_s(SHOWN_S)
    width_us[0], width_us[2] = float(MOST_US), float(LEAST_US)
    rig.chip.run_s(SIGN_S)
    if flown.holds:
        _tilt(rig)
    width_us[:] = [1500.0, HIGH_US, 1500.0, width_us[3], DIRECT_US]
    rig.chip.run_s(rig.ground_s - rig.chip.cycle / 16e6 + 1.0)
    width_us[3] = 1500.0
    rig.chip.run_s(3.0)


def _tilt(rig: FlightRig) -> None:
    """Right wing down, then nose up, the stick of each at its end against it."""
    source, width_us = rig.imu.source, rig.receiver.width_us

    def tilted(angles_cdeg: tuple[int, int, int]) -> Callable[[float], ImuSample]:
        return lambda time_s: replace(at_rest(time_s), angles_cdeg=angles_cdeg)

    for channel, us, angles in ((0, LEAST_US, (TILT, 0, 9000)), (1, MOST_US, (0, TILT, 9000))):
        width_us[:3] = [1500.0] * 3
        width_us[channel] = float(us)
        rig.imu.source = tilted(angles)
        rig.chip.run_s(TILT_S)
    rig.imu.source = source


def _events(rig: FlightRig, name: str) -> list[int]:
    """Return the times (us) of an event, by what the radio sent of it."""
    schema = packed_schema()
    frame, code = schema.by_name["event"], schema.enums["event"][name]
    found = []
    for data in EnvelopeReader().feed(rig.chip.uart_sent(3)):
        if data[0] == frame.id:
            row = np.frombuffer(data, frame.dtype)[0]
            found += [int(row["t_us"])] if int(row["code"]) == code else []
    return found


def deflected(rig: FlightRig, row: FlownRow) -> NDArray[np.int64]:
    """Return the starts (cycles) of pulses at the servos that the card made."""
    return np.concatenate([_made(rig, row, channel) for channel in range(len(SERVOS))])


def first_plain(rig: FlightRig, row: FlownRow) -> int:
    """Return the cycle from which no servo is behind: its pulse after the card's last began."""
    first = []
    for channel, servo in enumerate(SERVOS):
        starts = rig.relay.servo_pulses(servo)[:, 0]
        for last in _made(rig, row, channel)[-1:]:
            first.append(int(starts[starts > last].min()))
    return max(first)


def _made(rig: FlightRig, row: FlownRow, channel: int) -> NDArray[np.int64]:
    starts = [
        start
        for start, width, sticks in strange(rig, row.start, SERVOS[channel])
        if row.made(channel, start, width, sticks)
    ]
    return np.array(starts, dtype=np.int64)
