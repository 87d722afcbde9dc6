"""An airspeed that nobody calibrated is in the intervals of forces where data leave it open."""

from __future__ import annotations

import numpy as np
import pytest
from host.instrument.deviations import airspeed_share
from host.instrument.instrument_errors import usual_errors
from host.physical.recording import AUTOPILOT, FOREIGN, OWN
from host.sysid.answer import TRUSTED
from host.sysid.linear import Answer
from studies.wrong_flights import TRUTH

from tests.host.sysid.at_hand import identify
from tests.host.sysid.recorded import linear_flight
from tests.host.sysid.verdicts import verdict_of

SEED = 14790


def answer_to(noise: str, fault: str, seed: int, maker: str = FOREIGN) -> Answer:
    """The default answer to a linear flight in some noise."""
    flight = linear_flight("short-period", fault, noise, seed)
    [answer] = identify(
        flight.columns, names=("short-period",), windows=flight.windows, maker=maker
    )
    return answer


def share_of(answer: Answer, name: str) -> float:
    """The half-width over the value."""
    k = answer.result.index(name)
    return float(answer.result.half_width()[k] / abs(answer.result.estimate[k]))


def test_in_gusts_a_wrong_airspeed_is_never_under_trust() -> None:
    """It was, known to 3 % and 10 % off: no other column tells it there."""
    answer = answer_to("gust", "airspeed 10 % wrong", SEED)
    assert verdict_of(answer).marks["Z_alpha"] != TRUSTED
    assert verdict_of(answer).marks["M_alpha"] == TRUSTED
    assert answer.causes["Z_alpha"] == "scale of the airspeed"
    own = answer_to("gust", "none", SEED, maker=OWN)
    assert verdict_of(own).marks["Z_alpha"] == TRUSTED


def test_in_calm_air_the_data_tell_the_airspeed() -> None:
    """A right one widens nothing, of a wrong one the interval holds the truth."""
    right = answer_to("white", "none", SEED)
    assert share_of(right, "Z_alpha") < 0.05
    assert verdict_of(right).marks["Z_alpha"] == TRUSTED
    wrong = answer_to("white", "airspeed 10 % wrong", SEED)
    k = wrong.result.index("Z_alpha")
    off = abs(wrong.result.estimate[k] - TRUTH["short-period"]["Z_alpha"])
    assert off < 1.05 * wrong.result.half_width()[k]  # 10 % are 1.7 of its deviations


def test_what_is_usual_of_pitots() -> None:
    """Pressure counts by half; a slow aircraft's zero by more."""
    slow, fast = (airspeed_share(usual_errors(FOREIGN), qbar) for qbar in (175.0, 8000.0))
    assert fast == pytest.approx(0.04, rel=0.02)
    assert slow == pytest.approx(0.5 * np.hypot(0.08, 15.0 / 175.0), rel=0.02)
    assert airspeed_share(usual_errors(OWN), 175.0) < 0.015
    assert 0.02 < airspeed_share(usual_errors(AUTOPILOT), 8000.0) < fast
