"""What the logger learns while it flies a row, against the host's sums in double precision."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from host.link.card_console import CardConsole, CardError
from host.planning.learning_card import SIX_HARMONICS, LearningCondition, learning_card
from host.planning.onboard_sums import PITCH, ROLL, SAMPLE_HZ, AxisCard, FourierSums
from host.twin.recorder.flight_card_line import SitlLine
from host.twin.recorder.sitl_library import TICKS_PER_S, Level
from host.wire.flight_card import card_faults
from host.wire.schema_text import packed_schema
from numpy.typing import NDArray
from studies.onboard_equation_error import EquationError, Learned

from tests.sitl import flight_cards as cards
from tests.sitl.bench import Bench
from tests.sitl.input_flight import (
    ANALOG_S,
    PACKET_S,
    TRIGGER_S,
    InputFlight,
    input_flight,
)

SEED = 30_400
ROW_S = 8.0
ROW = cards.row(quiet_ms=200, duration_ms=round(1000 * ROW_S))
AXES = (
    learning_card("ultrastick25e", PITCH, LearningCondition(17.0)),
    learning_card("ultrastick25e", ROLL, LearningCondition(17.0, harmonics=SIX_HARMONICS)),
)
SLICES_PER_SAMPLE = 5  # app/row_learning.h
INPUT_END = 36
ALPHA, BETA, POT_ELEVATOR, POT_LEFT, POT_RUDDER = (0, 1), (2, 3), 6, 7, 9


def moved(seconds: float) -> InputFlight:
    """Return a flight in which an aircraft answers while its row is flown, both axes at once."""
    flight = input_flight(seconds, np.random.default_rng(SEED))
    at = np.arange(len(flight.analog)) * ANALOG_S
    flown = at > TRIGGER_S - 1.0
    tones = [(0.5, 0.3), (1.1, 0.9), (1.9, 2.0), (2.7, 1.2), (3.4, 2.9)]
    angle, rate = np.zeros(len(at)), np.zeros(len(at))
    surface = 60.0 * sum(np.sin(2 * np.pi * hz * at + phase) for hz, phase in tones) * flown
    for i in range(1, len(at)):
        turn = -45.0 * angle[i - 1] - 6.0 * rate[i - 1] + 20.0 * surface[i - 1]
        rate[i] = rate[i - 1] + ANALOG_S * turn
        angle[i] = angle[i - 1] + ANALOG_S * (rate[i - 1] - 4.0 * angle[i - 1])
    for slot in (*ALPHA, *BETA):
        flight.analog[:, slot] += np.clip(angle, -150, 150)
    for slot, share in ((POT_ELEVATOR, 1.0), (POT_LEFT, 0.5), (POT_LEFT + 1, -0.5)):
        flight.analog[:, slot] += share * surface
    flight.analog[:, POT_RUDDER] += 40.0 * np.sin(2 * np.pi * 1.4 * at + 0.4) * flown
    packets = np.arange(len(flight.imu)) * PACKET_S
    for column in (0, 1):
        own = 20.0 * np.interp(packets, at, rate)
        flight.imu[:, column] += np.clip(own, -8000, 8000).astype(np.int64)
    return flight


def flown(data: bytes, rate_hz: int = 100) -> Bench:
    flight = moved(TRIGGER_S + ROW_S + 2.0)
    bench = Bench()
    bench.sitl.set_eeprom(cards.eeprom_with(data))
    bench.set_rate(rate_hz)
    flight.give(bench.sitl)
    bench.sitl.power_on()
    bench.sitl.run_until(round(flight.seconds * TICKS_PER_S))
    return bench


def samples(ident: NDArray[Any], axis: str) -> NDArray[np.int64]:
    def raw(name: str) -> NDArray[np.int64]:
        return np.asarray(ident[name], dtype=np.int64)

    if axis == PITCH:
        columns = [raw("alpha_a") + raw("alpha_b"), raw("q"), raw("pot_elevator")]
    else:
        columns = [
            raw("beta_a") + raw("beta_b"), raw("p"), raw("r"),
            raw("pot_aileron_left") - raw("pot_aileron_right"), raw("pot_rudder"),
        ]  # fmt: skip
    return np.stack(columns, axis=1)


def in_double(card: AxisCard, values: NDArray[np.int64]) -> dict[int, Learned]:
    """Return the answer of each solve by the samples it knew."""
    sums = FourierSums(card, exact=True)
    solver = EquationError(card, sums, double=True)
    found: dict[int, Learned] = {}
    work, began = None, 0
    for sample in values:
        sums.take(sample)
        if work is None and sums.count >= 2 * SAMPLE_HZ and sums.count % SAMPLE_HZ == 0:
            work, began = solver.slices(), sums.count
        for _ in range(SLICES_PER_SAMPLE if work else 0):
            if work is not None and next(work):
                work = None
                if solver.learned is not None:
                    found[began] = solver.learned
    return found


@pytest.mark.parametrize(("number", "rate_hz"), [(1, 100), (2, 100), (1, 200)])
def test_estimates_are_those_of_double_precision(number: int, rate_hz: int, tmp_path: Path) -> None:
    bench = flown(cards.card([ROW], AXES, [number]), rate_hz)
    frames = bench.log(tmp_path).frames
    told, ident, card = frames["learned"], frames["ident"], AXES[number - 1]
    every = rate_hz // SAMPLE_HZ
    first = packed_schema().enums["derivative"]["cm_alpha" if number == 1 else "cl_beta"]
    assert set(told["row"]) == {0}
    counts = sorted({int(n) for n in told["samples"]})
    # The solve of the last second is not over when the row is.
    assert counts == list(range(100, round(ROW_S * SAMPLE_HZ), SAMPLE_HZ))
    # The newest sample of the first solve is the last scan that was over when it began.
    begun = int(told["t_us"][0])
    over = ident["t_us"].astype(np.int64) + 4700 < begun
    newest = int(np.flatnonzero(over)[-1])
    values = samples(ident, card.axis)
    worst = np.inf
    for last in range(newest - every, newest + 1):
        origin = last - every * (counts[0] - 1)
        exact = in_double(card, values[origin:][::every])
        worst = min(worst, max(_apart(told, exact, first)))
    assert worst <= 1.0
    assert len(told) == len(counts) * card.signals


def _apart(told: NDArray[Any], exact: dict[int, Learned], first: int) -> list[float]:
    """Return how far each estimate is, 1: 0.05 half-widths, or 2 % of the half-width."""
    found = []
    for row in told:
        other, place = exact[int(row["samples"])], int(row["derivative"]) - first
        width = float(other.half_width[place])
        estimate, half = 1e-6 * float(row["estimate"]), 1e-6 * float(row["half_width"])
        found += [abs(estimate - float(other.estimate[place])) / width / 0.05]
        found += [abs(half / width - 1.0) / 0.02]
        assert bool(row["enough"]) == (half <= 0.01 * _wanted(place, first) * abs(estimate))
    return found


def _wanted(place: int, first: int) -> int:
    return AXES[0 if first == 0 else 1].wanted_percent[place]


def test_a_row_that_teaches_nothing_and_a_card_without_axes_are_silent(tmp_path: Path) -> None:
    for data in (cards.card([ROW]), cards.card([ROW, ROW], AXES, [0, 1])):
        frames = flown(data).log(tmp_path).frames
        assert len(frames["learned"]) == 0
        assert len(frames["card"]) > 0


def test_learning_alters_no_pulse() -> None:
    """The servos of a flight that learns are those of one that does not."""
    plain, learning = (
        flown(cards.card([ROW, *more], axes, [1] if axes else []))
        for more, axes in (([], ()), ([], AXES))
    )
    for mine, theirs in zip(plain.sitl.pulses(), learning.sitl.pulses(), strict=True):
        assert np.array_equal(np.asarray(mine), np.asarray(theirs))


def test_a_card_of_too_many_axes_or_of_no_numbers_is_none() -> None:
    """Bounded before the hash is reckoned; host and logger refuse the same."""
    many = cards.card([ROW], AXES, [1], learned_axes=255)
    endless = cards.card([ROW], [replace(AXES[0], lever=math.inf)], [1])
    worthless = cards.card([ROW], [replace(AXES[0], gain=(math.nan, 1.0, 1.0))], [1])
    for data, fault in ((many, "limits"), (endless, "learning"), (worthless, "learning")):
        bench = Bench()
        bench.sitl.set_eeprom(cards.eeprom_with(data))
        bench.sitl.power_on()
        bench.sitl.run_for(1.0)
        line = SitlLine(bench.sitl)
        with pytest.raises(CardError, match=fault):
            CardConsole(line, line.now_s).read()
        assert card_faults(data)


def test_enough_is_one_tone(tmp_path: Path) -> None:
    """Chirps until every half-width is small enough, one tone from there to the row's end."""
    easy = replace(AXES[0], wanted_percent=(200, 200, 200), tolerance=(0.0, 0.0, 0.0))
    bench = flown(cards.card([ROW], [easy], [1]))
    told = bench.log(tmp_path).frames["learned"]
    every = np.asarray(told["enough"].reshape(-1, 3).all(axis=1))
    first_s = float(told["t_us"][::3][np.flatnonzero(every)[0]]) / 1e6
    assert every[np.flatnonzero(every)[0] :].all()
    at, level = bench.sitl.levels(Level.BUZZER)
    end_s = TRIGGER_S + ROW_S
    later = (at > (first_s + 0.9) * TICKS_PER_S) & (at < end_s * TICKS_PER_S)
    assert not later.any()
    last = np.flatnonzero(at < (first_s + 0.9) * TICKS_PER_S)[-1]
    assert level[last] == 1


def test_a_card_that_learns_what_it_does_not_have_is_none(tmp_path: Path) -> None:
    many = replace(AXES[1], harmonics=(*SIX_HARMONICS, 33))
    bad: Sequence[bytes] = (
        cards.card([ROW], AXES, [3]),
        cards.card([ROW], [many], [1]),
    )
    for data in bad:
        bench = flown(data)
        assert len(bench.log(tmp_path).frames["card"]) == 0
