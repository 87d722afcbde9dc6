"""Gains of the logger's hold on its flight card: whole numbers, signs, and what no card carries."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import pytest
from host.aircraft.linear_aircraft import load
from host.cli import main
from host.errors import UsageError
from host.physical.calibration import Calibration, load_calibration
from host.planning.hold_card import HoldError, HoldGains, hold_part, read_gains
from host.planning.logger_card import logger_card
from host.twin.faults import Fault
from host.twin.recorder.logger_flight import logger_flight
from host.twin.testcard.cards import Card, Segment
from host.wire.card_text import card_document, card_lines
from host.wire.flight_card import HELD, card_bytes, card_faults, held_axes, read_card

GAINS = HoldGains(
    "ultrastick25e", date(2026, 11, 28),
    {"aileron": 0.71, "elevator": 0.97}, {"aileron": 0.235, "elevator": 0.325},
    {"aileron": 0.03, "elevator": 0.03}, {"aileron": 1.0, "elevator": -1.0},
)  # fmt: skip
FILE = """aircraft = "ultrastick25e"
covariance_date = "2026-11-28"
aileron_sense = 1.0
elevator_sense = -1.0
roll_angle_gain = 0.71  # deg/deg
roll_rate_gain = 0.03
roll_integral_gain = 0.235
pitch_angle_gain = 0.97
pitch_rate_gain = 0.03
pitch_integral_gain = 0.325
"""
TICKS_PER_S, TICK_US = 200, 0.5


def calibrated(slope_radpus: float) -> Calibration:
    found = load_calibration()
    lines = dict(found.lines)
    for surface in HELD:
        line = lines[f"pulse.{surface}"]
        lines[f"pulse.{surface}"] = replace(line, slope=(slope_radpus,))
    return replace(found, lines=lines)


def test_gains_are_read_as_host_tune_saves_them(tmp_path: Path) -> None:
    path = tmp_path / "gains.toml"
    path.write_text(FILE)
    assert read_gains(path) == GAINS


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("roll_angle_gain = 0.71", "roll_angle_gain = 0", "angle gain of the aileron is 0"),
        ("pitch_rate_gain = 0.03", "pitch_rate_gain = -1", "rate gain of the elevator is -1"),
        ("pitch_integral_gain = 0.325", "", "no pitch_integral_gain"),
        ("aileron_sense = 1.0", "aileron_sense = 0.5", "1 or -1"),
        ("2026-11-28", "yesterday", "expected a day"),
        ("0.97", '"much"', "expected a number"),
    ],
)
def test_a_file_that_is_none_is_one_line(old: str, new: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "gains.toml"
    path.write_text(FILE.replace(old, new))
    with pytest.raises(HoldError, match=said):
        read_gains(path)


@pytest.mark.parametrize("slope_radpus", [5e-4, 1.09e-3, 2e-3, -1.09e-3])
def test_whole_numbers_are_the_gains_over_the_range(slope_radpus: float) -> None:
    """To half a step each, and to 4 % at the softest gains that `host tune` gives."""
    calibration = calibrated(slope_radpus)
    for angle, rate in itertools.product((0.05, 0.5, 1.0), (0.0, 0.03, 0.25)):
        each = dict.fromkeys(HELD, angle)
        gains = replace(
            GAINS, angle=each, integral_per_s={k: v / 3.0 for k, v in each.items()},
            rate_s=dict.fromkeys(HELD, rate),
        )  # fmt: skip
        part = hold_part(gains, calibration, [100, 100])
        for k, surface in enumerate(HELD):
            # rad of the surface per rad, from ticks per 0.01 deg.
            turn = abs(slope_radpus) * TICK_US * math.degrees(1.0)
            found = {
                "angle_gain": part["angle_gain"][k] / 2**14 * turn * 100.0,
                "integral_gain": part["integral_gain"][k] / 2**20 * turn * 100.0 * TICKS_PER_S,
            }
            sign = math.copysign(1.0, slope_radpus) * GAINS.sense[surface]
            assert sign * found["angle_gain"] == pytest.approx(angle, rel=0.01)
            assert sign * found["integral_gain"] == pytest.approx(angle / 3.0, rel=0.04)
            rate_step_degps = math.degrees(2.664624812204e-4)
            damping = part["rate_gain"][k] / 2**14 * turn / rate_step_degps
            assert sign * damping == pytest.approx(rate, rel=0.01, abs=1e-4)


def test_gains_that_16_bits_do_not_hold_are_refused() -> None:
    with pytest.raises(HoldError, match="angle_gain of the aileron"):
        hold_part(GAINS, calibrated(5e-5), [100, 100])
    with pytest.raises(HoldError, match="angle_gain of the aileron is 0"):
        hold_part(replace(GAINS, angle=dict.fromkeys(HELD, 1e-6)), calibrated(1e-3), [1, 1])


def card() -> Card:
    segments = (
        Segment("doublet", axes=("elevator",), amplitudes=(4.0,), width_s=0.5),
        Segment("doublet", axes=("rudder",), amplitudes=(5.0,), width_s=0.5),
    )
    return Card("two", "", "ultrastick25e", segments)


def test_rows_hold_what_they_do_not_move_and_no_further_than_the_card() -> None:
    calibration = load_calibration()
    data = logger_card(card(), load("ultrastick25e"), calibration, hold=GAINS)
    assert card_faults(data) == []
    found = read_card(data)
    assert [held_axes(row) for row in found.rows] == [("aileron",), ("aileron", "elevator")]
    assert found.teaches == ("", "")
    assert found.hold is not None
    # The elevator as far as its doublet, the aileron as far as the rudder's 5 deg.
    aileron, elevator = found.hold["authority_us"]
    assert elevator == found.head["amplitude_max_us"][1] == abs(found.rows[0]["amplitude_us"][1])
    assert aileron == math.floor(
        abs(found.rows[1]["amplitude_us"][2])
        * abs(calibration.lines["pulse.rudder"].slope[0])
        / abs(calibration.lines["pulse.aileron"].slope[0])
    )
    text = "\n".join(card_lines(found))
    assert "holds with gains of ultrastick25e, 2026-11-28: aileron" in text
    assert "; holds aileron, elevator" in text
    assert card_document(found)["hold"]["model"] == "ultrastick25e"
    broken = replace(card(), faults=(Fault("imu_off", at_s=50.0),))
    with pytest.raises(UsageError, match=r"has imu_off.* without faults"):
        logger_flight(data, broken, seed=0, recorder=lambda *_: pytest.fail("it was run"))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda hold: hold.update(angle_gain=[0, 5]), "gains of the aileron 0"),
        (lambda hold: hold.update(rate_gain=[-1, 0]), "gains of the aileron"),
        (lambda hold: hold.update(authority_us=[0, 10]), "authority of the aileron 0 us"),
        (lambda hold: hold.update(authority_us=[10, 900]), "authority of the elevator 900 us"),
        (lambda hold: hold.update(reserved=[1] * 12), "reserved"),
    ],
)
def test_a_card_whose_hold_is_none_says_why(
    change: Callable[[dict[str, Any]], None], said: str
) -> None:
    good = logger_card(card(), load("ultrastick25e"), load_calibration(), hold=GAINS)
    found = read_card(good)
    assert found.hold is not None
    hold = dict(found.hold)
    change(hold)
    assert said in "\n".join(card_faults(card_bytes(found.head, found.rows, hold=hold)))


def test_a_row_that_holds_without_gains_or_what_it_moves_is_refused() -> None:
    found = read_card(logger_card(card(), load("ultrastick25e"), load_calibration(), hold=GAINS))
    head = dict(found.head, hold=0)
    assert "gains on the card" in "\n".join(card_faults(card_bytes(head, found.rows)))
    both = dict(found.rows[0], axes=2 | 2 << 4)
    assert "none that it moves" in "\n".join(
        card_faults(card_bytes(found.head, [both], hold=found.hold))
    )


def test_gains_without_the_loggers_file_are_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "gains.toml"
    path.write_text(FILE)
    assert main(["plan", "demo", "--hold", str(path)]) == 2
    assert "name it, --card FILE" in capsys.readouterr().err
