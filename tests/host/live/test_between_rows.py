"""What rows of the radio leave out: edges of an input, and what a burst takes."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from host.aircraft.linear_aircraft import load
from host.errors import IdentificationError
from host.live.test_point.between_rows import drawn_rows, finer
from host.planning.aircraft_response import STEP_S, AircraftResponse
from host.sysid.reconstruction.servo_response import servo_response
from host.twin.testcard.cards import Segment
from host.twin.testcard.input_shapes import STEPS, staircase
from numpy.typing import NDArray

Vector = NDArray[np.float64]
SPEED_MPS, START_S, SINCE_S = 17.0, 14.0, 11.0
ELEVATOR = Segment("3211", axes=("elevator",), amplitudes=(5.0,), width_s=0.3)
EVERY = 5  # rows of the log for one of the radio


@pytest.fixture(scope="module")
def response() -> AircraftResponse:
    return AircraftResponse(load("ultrastick25e"), SPEED_MPS)


def flown(response: AircraftResponse) -> dict[str, Vector]:
    """Return 20 s at 100 Hz: trim, then a 3-2-1-1 of the linear aircraft in a calm morning."""
    rng = np.random.default_rng(11)
    t = np.arange(0.0, 20.0, STEP_S)
    signs, lengths = np.array(STEPS["3211"]).T
    edges = START_S + np.concatenate([[0.0], np.cumsum(lengths * ELEVATOR.width_s)])
    stick = math.radians(5.0) * staircase(t, edges, signs, 0.08)
    held = np.repeat(stick[::2], 2)  # a pulse lasts 20 ms
    surface = servo_response(held, STEP_S, response.servo_radps / (2.0 * np.pi), 0.0)
    none = np.zeros(len(t))
    moved = response.motion("longitudinal", {"elevator": surface, "aileron": none, "rudder": none})
    gust = np.cumsum(rng.normal(0.0, 0.156 * math.sqrt(STEP_S), len(t)))
    columns = {
        "t_s": t, "alpha_rad": 0.05 + moved["alpha"] - gust / SPEED_MPS, "q_radps": moved["q"],
        "theta_rad": 0.05 + np.cumsum(moved["q"]) * STEP_S,
        "elevator_rad": surface - 0.1, "elevator_pot_rad": surface - 0.1,
        "rc_elevator_us": 1520.0 + 900.0 * held, "servo_elevator_us": none + np.nan,
        "mega_drives": none, "az_mps2": none - 9.81,
    }  # fmt: skip
    return {name: np.asarray(column, np.float64) for name, column in columns.items()}


def radio(whole: dict[str, Vector], lost: slice | None = None) -> pd.DataFrame:
    """Return every fifth row, some of them lost."""
    rows = pd.DataFrame({name: column[::EVERY] for name, column in whole.items()})
    return rows if lost is None else rows.drop(rows.index[lost]).reset_index(drop=True)


def error_deg(drawn: pd.DataFrame, whole: dict[str, Vector], name: str) -> float:
    """Return the rms error of a drawn column from the input on, deg."""
    truth = np.interp(drawn["t_s"], whole["t_s"], whole[name])
    inside = (drawn["t_s"] > START_S - 0.5) & (drawn["t_s"] < START_S + 4.0)
    return float(np.degrees(np.sqrt(np.mean((drawn[name] - truth)[inside] ** 2))))


def test_edges_between_two_rows_are_those_of_the_stick(response: AircraftResponse) -> None:
    whole = flown(response)
    rows = radio(whole)
    drawn = drawn_rows(rows, ELEVATOR, response, SINCE_S)
    curves, motion = (error_deg(x, whole, "elevator_rad") for x in (finer(rows), drawn.by_motion))
    assert motion < 0.8 * curves
    # Where all rows came curves are curves, and the motion goes through the rows.
    pd.testing.assert_frame_equal(drawn.by_curves, finer(rows)[drawn.by_curves.columns])
    at_rows = drawn.by_motion.set_index(np.round(drawn.by_motion["t_s"], 3))
    inside = rows[rows["t_s"] < rows["t_s"].iloc[-1] - 0.1]
    for name in ("elevator_rad", "alpha_rad", "q_radps"):
        kept = at_rows.loc[np.round(inside["t_s"], 3), name].to_numpy()
        assert kept == pytest.approx(inside[name].to_numpy(), abs=2e-4)


def test_bursts_over_edges_are_filled_by_what_the_aircraft_did(response: AircraftResponse) -> None:
    whole = flown(response)
    names = {"elevator_rad": 0.7, "alpha_rad": 0.5, "q_radps": 0.85}  # of what a line is off
    line, curves, motion = (dict.fromkeys(names, 0.0) for _ in range(3))
    for edge in (0.0, 3.0, 5.0, 6.0):
        first = round((START_S + edge * ELEVATOR.width_s - 0.1) / (EVERY * STEP_S))
        rows = radio(whole, slice(first, first + 6))
        drawn = drawn_rows(rows, ELEVATOR, response, SINCE_S)
        filled = ((line, finer(rows)), (curves, drawn.by_curves), (motion, drawn.by_motion))
        for name in names:
            for total, table in filled:
                total[name] += error_deg(table, whole, name)
        # A surface that differs from its pot counts as commanded, with the errors of a servo.
        for table in (drawn.by_curves, drawn.by_motion):
            assert table["elevator_pot_rad"].equals(table["elevator_rad"])
    for name, share in names.items():
        assert max(curves[name], motion[name]) < share * line[name], name


def test_a_column_stays_at_its_last_value(response: AircraftResponse) -> None:
    """Airspeed needs a pressure that comes more slowly: a cubic went on to -255 m/s."""
    rows = radio(flown(response)).assign(airspeed_mps=17.0 + np.sin(np.arange(400.0)))
    last = len(rows) - 8
    rows.loc[last + 1 :, "airspeed_mps"] = np.nan
    drawn = finer(rows)
    behind = drawn["airspeed_mps"][drawn["t_s"] > rows["t_s"][last] + STEP_S]
    assert behind.to_numpy() == pytest.approx(rows["airspeed_mps"][last])


def test_without_pulses_the_pots_tell(response: AircraftResponse) -> None:
    whole = flown(response)
    whole["rc_elevator_us"] *= np.nan
    drawn = drawn_rows(radio(whole), ELEVATOR, response, SINCE_S)
    assert error_deg(drawn.by_motion, whole, "elevator_rad") < 1.0


def test_too_few_rows_are_named(response: AircraftResponse) -> None:
    rows = radio(flown(response))
    with pytest.raises(IdentificationError, match="20 rows arrived, 30 are needed"):
        drawn_rows(rows[:20], ELEVATOR, response, SINCE_S)
    with pytest.raises(IdentificationError, match="rows arrived, 30 are needed"):
        drawn_rows(rows, ELEVATOR, response, float(rows["t_s"].iloc[-1]) - 1.0)
