"""Filter error may follow what its model lacks: free simulation then misses more than it allows."""

from dataclasses import replace

import numpy as np
import pytest
from host.sysid.estimators import fit
from host.sysid.linear import Answer
from host.sysid.models import LinearModel, Maneuver, model_from
from host.sysid.numerics import ArNoise, autocovariance
from host.sysid.numerics.input_coherence import input_coherence
from host.sysid.validation import free_responses, random_errors
from host.sysid.validation.prediction_limits import power_freedom, predictions, random_noise
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


def slow_roll() -> tuple[LinearModel, Maneuver, np.ndarray]:
    """Return a roll in gusts at 20 Hz, of which p is read every third row, and free motion."""
    rng, rows, dt_s = np.random.default_rng(11), 600, 0.05
    aileron = 0.1 * np.sign(np.sin(0.15 * np.arange(rows)))
    p, free = np.zeros(rows), np.zeros(rows)
    decay = np.exp(-4.0 * dt_s)
    for k in range(1, rows):
        push = 10.0 * (1.0 - decay) * aileron[k - 1]
        free[k] = decay * free[k - 1] + push
        p[k] = decay * p[k - 1] + push + 0.02 * rng.standard_normal()
    measured = p + 0.01 * rng.standard_normal(rows)
    model = model_from(
        {
            "name": "roll",
            "hold": "zoh",
            "states": ["p_radps"],
            "inputs": ["aileron_rad"],
            "outputs": ["p_radps"],
            "delays": [],
            "A": [["L_p"]],
            "B": [["L_da"]],
            "parameters": {"L_p": -4.0, "L_da": 40.0},
        }
    )
    seen = (np.arange(rows) % 3 == 0)[:, None]
    return model, Maneuver(dt_s, aileron[:, None], measured[:, None], sampled=seen), free[:, None]


def test_rows_that_a_slow_sensor_did_not_measure_count_on_neither_side() -> None:
    """Noise was drawn for them: of three times what was measured, and it hid any excess."""
    model, maneuver, free = slow_roll()
    seen = np.asarray(maneuver.sampled)
    found = fit("filter-error", model, [maneuver], process=("p_radps",), compare_noise=False)
    rng = np.random.default_rng(12)
    errors = random_errors(rng, found.model, found.estimate, found, maneuver, 1)[0]
    assert not errors[~seen[:, 0]].any()
    left = (maneuver.outputs - free)[seen]
    assert np.mean(errors[seen[:, 0]] ** 2) == pytest.approx(np.mean(left**2), rel=0.3)
    responses = free_responses(found.model, found.estimate, [maneuver])
    assert responses is not None
    noise = input_coherence(responses.problem, responses.responses, responses.theta)
    y = maneuver.outputs.copy()
    y[~seen] += 10.0  # whatever stands there is not looked at
    for data in (maneuver, replace(maneuver, outputs=y)):
        [said] = predictions(found.model, found, found.uncertainty, noise, [data], [free]).values()
        assert said.by_gusts
        assert said.holds
        assert said.nrmse == pytest.approx(np.std(left) / np.std(maneuver.outputs[seen]), rel=0.05)


def test_drawn_noise_has_the_power_of_its_model() -> None:
    memory = ArNoise.from_coefficient(np.array([0.8]))
    errors = random_noise(np.random.default_rng(3), memory, 0.5, 400, 200)
    assert np.mean(errors**2) == pytest.approx(
        0.5 * autocovariance(memory.coefficient, 0)[0], rel=0.05
    )
    assert power_freedom(ArNoise.white(), 400) == 400.0
    assert power_freedom(memory, 400) == pytest.approx(400.0 * (1 - 0.64) / (1 + 0.64), rel=0.01)
