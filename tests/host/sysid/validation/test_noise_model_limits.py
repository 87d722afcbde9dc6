"""Filter error may follow what its model lacks: free simulation then misses more than it allows."""

import numpy as np
import pytest
from host.sysid.linear import Answer
from host.sysid.numerics import ArNoise, autocovariance
from host.sysid.validation.prediction_limits import power_freedom, random_noise
from studies.wrong_flights import fly

from tests.host.sysid.at_hand import identify

WORDS = "times what gusts and noise allow"


def gust_filter(fault: str, seed: int, noise: str = "gust") -> Answer:
    flight = fly("short-period", fault, noise, seed)
    [answer] = identify(flight.columns, names=("short-period",), windows=flight.windows)
    assert answer.result.method == "filter error with gust"
    return answer


def test_a_right_model_in_gusts_is_within_its_own_noise() -> None:
    answer = gust_filter("none", 1)
    assert not any(WORDS in w for w in answer.result.warnings)
    assert all(one.holds for one in answer.predictions.values())


def test_a_hidden_lag_is_more_than_its_gusts_allow() -> None:
    answer = gust_filter("hidden lag", 1)
    [line] = [w for w in answer.result.warnings if WORDS in w]
    assert "intervals are wider for it" in line
    assert answer.result.half_width()[answer.result.index("M_de")] > 10.0  # 3 without it


def test_drawn_noise_has_the_power_of_its_model() -> None:
    memory = ArNoise.from_coefficient(np.array([0.8]))
    errors = random_noise(np.random.default_rng(3), memory, 0.5, 400, 200)
    assert np.mean(errors**2) == pytest.approx(
        0.5 * autocovariance(memory.coefficient, 0)[0], rel=0.05
    )
    assert power_freedom(ArNoise.white(), 400) == 400.0
    assert power_freedom(memory, 400) == pytest.approx(400.0 * (1 - 0.64) / (1 + 0.64), rel=0.01)
