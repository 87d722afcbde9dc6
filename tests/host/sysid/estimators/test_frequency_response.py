"""Frequency responses of records and models: truth, scipy, draws from the covariance."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from host.errors import IdentificationError
from host.sysid.estimators.frequency_response import (
    model_response,
    recorded_response,
)
from host.sysid.models import FitResult, LinearModel, Maneuver, Parameter, Term
from scipy import signal

DT_S = 0.02
LIMIT = 0.6
A = np.array([[-2.0, 0.95], [-40.0, -3.0]])
B = np.array([[-0.1, 0.0], [-30.0, 4.0]])
C = np.eye(2)
THETA = np.array([-40.0, -3.0, -30.0, 0.013])


def sampled(hold: Any) -> Any:
    """Return A, B, C, D of the sampled system, and its period."""
    return signal.cont2discrete((A, B, C, np.zeros((2, 2))), DT_S, method=hold)


def flown(inputs: np.ndarray, noise: float, seed: int, name: str = "sweep") -> Maneuver:
    _, y, _ = signal.dlsim(sampled("zoh"), inputs)
    y = y + noise * np.std(y, axis=0) * np.random.default_rng(seed).standard_normal(y.shape)
    return Maneuver(DT_S, inputs, y, name=name)


def sweep(seconds: float) -> np.ndarray:
    t = np.arange(0.0, seconds, DT_S)
    return 0.05 * signal.chirp(t, 0.2, seconds, 8.0) * np.sin(np.pi * t / seconds) ** 0.3


def true_response(frequency_hz: np.ndarray) -> np.ndarray:
    z = np.exp(2j * np.pi * frequency_hz * DT_S)
    Phi, Gamma = sampled("zoh")[:2]
    return np.array([C @ np.linalg.solve(one * np.eye(2) - Phi, Gamma) for one in z])


def model(hold: str = "zoh") -> LinearModel:
    free = np.zeros((2, 2))
    start = A.copy()
    start[1] = 0.0
    moved = B.copy()
    moved[1, 0] = 0.0
    terms = (Term("A", 1, 0, "M_alpha"), Term("A", 1, 1, "M_q"), Term("B", 1, 0, "M_de"))
    return LinearModel(
        "pitch",
        ("alpha_rad", "q_radps"),
        ("elevator_rad", "rudder_rad"),
        ("alpha_rad", "q_radps"),
        start,
        moved,
        C,
        free,
        terms,
        tuple(Parameter(n) for n in ("M_alpha", "M_q", "M_de")),
        hold=hold,
    )


def fit_of(one: LinearModel, theta: np.ndarray, covariance: np.ndarray) -> FitResult:
    empty = np.zeros((0, 0))
    return FitResult(
        "test", one, one.parameter_names, theta, covariance, covariance,
        np.full(len(theta), np.inf), (), (), "output", empty, 1, converged=True,
    )  # fmt: skip


def test_a_sweep_of_one_input_gives_the_true_response_where_it_is_coherent() -> None:
    inputs = np.column_stack([sweep(60.0), np.zeros(3000)])
    whole = flown(inputs, 0.05, seed=2301)
    found = recorded_response([replace(whole, inputs=whole.inputs[:, :1])])
    assert found.windows == 5
    assert found.frequency_hz[0] == pytest.approx(2.0 / found.window_s)
    inside = (found.frequency_hz < 7.0) & (found.coherence[:, 1, 0] > LIMIT)
    assert inside.sum() > 0.95 * np.sum(found.frequency_hz < 7.0)
    ratio = found.response[:, 1, 0] / true_response(found.frequency_hz)[:, 1, 0]
    assert np.sqrt(np.mean(np.abs(ratio[inside] - 1.0) ** 2)) < 0.06
    assert "chirp-z" in found.method and "partial" not in found.method


def test_of_inputs_that_move_together_only_the_one_that_acts_is_coherent() -> None:
    rng = np.random.default_rng(2303)
    first = np.concatenate([sweep(60.0), sweep(60.0)])
    other = 0.8 * first + 0.01 * signal.lfilter([0.2], [1.0, -0.8], rng.standard_normal(6000))
    _, y, _ = signal.dlsim(sampled("zoh"), np.column_stack([first, np.zeros(6000)]))
    y = y[:, 1:] + 0.05 * np.std(y[:, 1]) * rng.standard_normal((6000, 1))
    both = Maneuver(DT_S, np.column_stack([first, other]), y)
    alone = recorded_response([replace(both, inputs=both.inputs[:, 1:])])
    found = recorded_response([both])
    inside = found.frequency_hz < 7.0
    assert np.median(alone.coherence[alone.frequency_hz < 7.0]) > LIMIT  # taken for the first
    assert (
        np.median(found.coherence[inside, 0, 1]) < LIMIT < np.median(found.coherence[inside, 0, 0])
    )
    assert "partial" in found.method
    ratio = found.response[inside, 0, 0] / true_response(found.frequency_hz[inside])[:, 1, 0]
    assert np.median(np.abs(ratio - 1.0)) < 0.15


def test_chance_passes_the_limit_in_one_line_of_twenty_at_most() -> None:
    rng = np.random.default_rng(2304)
    passed = []
    for _ in range(60):
        noise = rng.standard_normal((800, 3))
        found = recorded_response([Maneuver(DT_S, noise[:, :2], noise[:, 2:])])
        passed.append(np.mean(found.coherence[::4] > LIMIT))
    assert np.mean(passed) < 0.05


@pytest.mark.parametrize("hold", ["zoh", "foh"])
def test_the_models_response_is_scipys_and_its_interval_that_of_draws(hold: str) -> None:
    f = np.linspace(0.3, 6.0, 12)
    deviation = np.array([1.5, 0.2, 0.9])
    correlation = np.array([[1.0, 0.4, -0.3], [0.4, 1.0, 0.5], [-0.3, 0.5, 1.0]])
    covariance = correlation * np.outer(deviation, deviation)
    one = model(hold)
    found = model_response(fit_of(one, THETA[:3], covariance), f, DT_S)
    if hold == "zoh":
        assert np.allclose(found.response, true_response(f), rtol=1e-9)
    else:  # scipy's states of a first-order hold are others: compare its transfer function
        Phi, Gamma, read, direct, _ = sampled("foh")
        z = np.exp(2j * np.pi * f * DT_S)
        peer = [read @ np.linalg.solve(x * np.eye(2) - Phi, Gamma) + direct for x in z]
        assert np.allclose(found.response, peer, rtol=1e-9)
    draws = np.random.default_rng(2305).multivariate_normal(THETA[:3], 1e-4 * covariance, 4000)
    spread = np.array(
        [model_response(fit_of(one, x, 0.0 * covariance), f, DT_S).response for x in draws[:1500]]
    )
    logs = np.log(spread[:, :, 1, 0] / found.response[:, 1, 0])
    widths = found.half_width[:, 1, 0]
    assert np.allclose(1.96 * 100.0 * np.std(logs.real, axis=0), widths.real, rtol=0.08)
    assert np.allclose(1.96 * 100.0 * np.std(logs.imag, axis=0), widths.imag, rtol=0.08)


def test_a_delay_turns_the_phase_of_its_output() -> None:
    from host.sysid.models.state_space_model import DelayGroup

    one = replace(model(), delays=(DelayGroup("delay_imu_s", ("q_radps",)),))
    f = np.array([2.0])
    found = model_response(fit_of(one, THETA, np.zeros((4, 4))), f, DT_S)
    turn = found.response[0] / true_response(f)[0]
    assert np.allclose(turn[0], 1.0)
    assert np.allclose(np.angle(turn[1]), -2.0 * np.pi * 2.0 * 0.013)


def test_records_too_short_for_their_rate_are_refused() -> None:
    noise = np.random.default_rng(2306).standard_normal((20, 2))
    with pytest.raises(IdentificationError, match="fly a longer input"):
        recorded_response([Maneuver(0.1, noise[:, :1], noise[:, 1:])])
