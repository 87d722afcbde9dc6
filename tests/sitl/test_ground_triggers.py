"""No trigger on the ground starts a row, honest ones do, and a row ends where it flies no more."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from host.twin.recorder.sitl_library import TICKS_PER_S
from host.wire.schema_text import packed_schema

from tests.sitl import flight_cards as cards
from tests.sitl.bench import Bench
from tests.sitl.ground_triggers import (
    ACTING,
    KNOWN_BY,
    LOOSE,
    TRIGGERS,
    barometer_wrong,
    car,
    fly,
    in_flight,
    on_the_ground,
)
from tests.sitl.input_faults import ROWS
from tests.sitl.input_flight import ANALOG_S, TRIGGER_S, input_flight
from tests.sitl.input_judge import deflected

SEED = 46_200
PLAIN_S, SERVO_S, SCAN_S = 0.025, 0.020, 0.012


@pytest.mark.parametrize("number", range(0, len(ACTING), 5))
def test_no_trigger_on_the_ground_starts_a_row(number: int) -> None:
    """Every fifth draw of `make ground-triggers`, on another seed."""
    told = fly(on_the_ground(number, SEED))
    assert told.enabled
    assert sum(told.refused.values()) == TRIGGERS
    assert (told.started, told.moved) == (0, 0)


def test_a_campaign_in_which_rows_start_says_so() -> None:
    """Real speed and a wrong barometer are a flight; the judge sees rows and pulses."""
    told = [fly(on_the_ground(n, SEED, (barometer_wrong, car))) for n in range(6, 12)]
    assert sum(one.started for one in told) > 0
    assert all((one.moved > 0) == (one.started > 0) for one in told)


@pytest.mark.parametrize("number", range(len(KNOWN_BY)))
def test_an_honest_trigger_starts_its_row(number: int) -> None:
    told = fly(in_flight(number, SEED))
    assert told.enabled
    assert told.started == TRIGGERS


@pytest.mark.parametrize("rate_hz", [100, 200])
def test_a_row_ends_where_its_flight_is_no_longer_proven(rate_hz: int, tmp_path: Path) -> None:
    """No GPS that is fast, and the pitot falls to its zero: nothing but the proof is left."""
    flight = input_flight(TRIGGER_S + 3.0, np.random.default_rng(SEED))
    flight.ground_speed_cmps[flight.ground_speed_cmps > 499] = 499
    fell = int((TRIGGER_S + 1.0) / ANALOG_S)
    flight.analog[fell:, 4:6] = 512.0 + 15.0  # 73 Pa
    data = cards.card([ROWS[4]], (), (), **LOOSE | {"airspeed_input": 4, "distance_max_m": 400})
    bench = Bench()
    bench.sitl.set_eeprom(cards.eeprom_with(data))
    bench.set_rate(rate_hz)
    flight.give(bench.sitl)
    bench.sitl.power_on()
    bench.sitl.run_until(round(flight.seconds * TICKS_PER_S))
    events = bench.log(tmp_path).frames["event"]
    schema = packed_schema()
    ended = events["arg"][events["code"] == schema.number("event", "input_end")]
    assert [int(arg) >> 8 & 0xFF for arg in ended] == [schema.number("input_end", "not_flying")]
    late = deflected(bench.sitl.pulses(), flight, TRIGGER_S) / TICKS_PER_S
    assert late.size > 20
    assert late[-1] + SERVO_S <= fell * ANALOG_S + SCAN_S + PLAIN_S
