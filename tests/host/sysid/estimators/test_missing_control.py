"""A user's model without the lift of its elevator, in gusts: what they explain is said and counted.

Two parameters that are right beside it stay as they are known.
"""

import numpy as np
import pytest
from host.physical.recording import FOREIGN
from host.sysid.answer import TRUSTED
from host.sysid.linear import Answer
from studies import wrong_flights
from studies.wrong_flights import LinearFlight

from tests.host.sysid.at_hand import identify
from tests.host.sysid.verdicts import verdict_of

SEED = 12150


def _answer(flight: LinearFlight) -> Answer:
    [found] = identify(
        flight.columns,
        names=("short-period",),
        windows=flight.windows,
        user_model=flight.model,
        maker=FOREIGN,
    )
    assert found.method == "filter-error-gust"
    return found


def _accused(answer: Answer) -> bool:
    return any("the inputs act where the model has no effect" in w for w in answer.result.warnings)


def test_parameters_that_stand_for_a_lift_that_is_missing_are_not_trusted() -> None:
    """M_q 11 and M_de 7 % off stood under "trust", known to 3 and 1 %."""
    seed = SEED
    flight = wrong_flights.fly("short-period", "missing derivative", "gust", seed)
    answer = _answer(flight)
    assert _accused(answer)
    marks, half = verdict_of(answer).marks, answer.result.half_width()
    for name in ("M_q", "M_de"):
        off = abs(answer.result.value(name) - flight.truth[name])
        assert off > 0.05 * abs(flight.truth[name])
        assert off < half[answer.result.index(name)]
        assert marks[name] != TRUSTED
    k = answer.result.index("M_alpha")
    assert half[k] < 0.06 * abs(flight.truth["M_alpha"])


def test_an_elevator_without_lift_is_not_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    truth = wrong_flights.TRUTH["short-period"] | {"Z_de": 0.0}
    monkeypatch.setitem(wrong_flights.TRUTH, "short-period", truth)
    seed = SEED
    flight = wrong_flights.fly("short-period", "missing derivative", "gust", seed)
    answer = _answer(flight)
    assert not _accused(answer)
    half = answer.result.half_width()[answer.result.index("M_q")]
    assert half < 0.08 * abs(flight.truth["M_q"])
    assert np.isfinite(half)
