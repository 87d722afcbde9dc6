"""Equation error: exact on clean data, equal to independent solvers, honest on dirty data."""

import numpy as np
import pytest
from host.errors import IdentificationError
from host.sysid import LinearModel, Maneuver, Parameter, Term, fit
from host.sysid.numerics.differentiation import (
    bandwidth_hz,
    local_polynomial,
    smooth_and_differentiate,
    window_for,
)
from scipy import optimize, signal
from studies.data import TRUTH, clean, noisy, with_rates
from studies.navion import navion, navion_free, navion_structured


@pytest.mark.parametrize("variant", ["", "-weighted", "-robust", "-total"])
def test_clean_rates_give_the_truth(variant: str) -> None:
    result = fit("equation-error" + variant, navion_free(), [with_rates(1)])
    A, B, _, _ = result.matrices()
    np.testing.assert_allclose(A, navion()[0], atol=2e-6)
    np.testing.assert_allclose(B, navion()[1], atol=2e-6)


def test_total_least_squares_equals_the_distance_to_the_plane() -> None:
    rng = np.random.default_rng(4)
    x = rng.standard_normal((400, 2)) @ np.array([[2.0, 0.3], [0.0, 1.0]])
    u = rng.standard_normal((400, 1))
    rates = x @ np.array([[-1.0, 0.7], [0.4, -2.0]]).T + u @ np.array([[0.5, 3.0]])
    sigma = 0.3
    x_noisy = x + sigma * rng.standard_normal(x.shape)
    rates_noisy = rates + sigma * rng.standard_normal(x.shape)
    places = [("A", i, j, f"a{i}{j}") for i in range(2) for j in range(2)]
    places += [("B", i, 0, f"b{i}") for i in range(2)]
    model = LinearModel(
        name="two",
        states=("a", "b"),
        inputs=("u",),
        outputs=("a", "b"),
        A=np.zeros((2, 2)),
        B=np.zeros((2, 1)),
        C=np.eye(2),
        D=np.zeros((2, 1)),
        terms=tuple(Term(*place) for place in places),
        parameters=tuple(Parameter(place[3]) for place in places),
    )
    result = fit(
        "equation-error-total",
        model,
        [Maneuver(0.01, u, x_noisy, rates=rates_noisy)],
        deviations=(np.full(2, sigma), np.full(2, sigma)),
    )
    # The peer is told the noise and that the input is exact: distance to the plane, squared.
    z = np.hstack([x_noisy, u])
    for row in range(2):

        def distance(b: np.ndarray, row: int = row) -> float:
            miss = rates_noisy[:, row] - z @ b
            return float(miss @ miss / (1.0 + b[:2] @ b[:2]))

        peer = optimize.minimize(distance, [-1.0, 0.0, 1.0], method="BFGS", tol=1e-10)
        ours = [result.value(f"a{row}0"), result.value(f"a{row}1"), result.value(f"b{row}")]
        np.testing.assert_allclose(ours, peer.x, atol=2e-5)
    ordinary = fit("equation-error", model, [Maneuver(0.01, u, x_noisy, rates=rates_noisy)])
    assert abs(result.value("a11") + 2.0) < 0.5 * abs(ordinary.value("a11") + 2.0)


def test_differentiation_has_the_bandwidth_it_states() -> None:
    dt_s = 0.01
    window = window_for(2.0, dt_s, 2000)
    edge = bandwidth_hz(window, dt_s)
    assert edge >= 2.0 > bandwidth_hz(window + 2, dt_s)
    time_s = np.arange(2000) * dt_s
    wave = np.sin(2.0 * np.pi * edge * time_s)[:, None]
    smooth, _ = smooth_and_differentiate(wave, dt_s, 2.0)
    inner = slice(300, -300)
    assert np.std(smooth[inner]) / np.std(wave[inner]) == pytest.approx(np.sqrt(0.5), abs=0.02)
    slow = np.sin(2.0 * np.pi * 0.2 * time_s)[:, None]
    _, rate = smooth_and_differentiate(slow, dt_s, 2.0)
    expected = 0.4 * np.pi * np.cos(0.4 * np.pi * time_s)
    np.testing.assert_allclose(rate[inner, 0], expected[inner], atol=0.002)


@pytest.mark.parametrize(("samples", "window"), [(50, 5), (300, 41), (1000, 401)])
@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_smoothing_is_that_of_scipy(samples: int, window: int, derivative: int) -> None:
    values = np.cumsum(np.random.default_rng(samples).standard_normal((samples, 3)), axis=0)
    ours = local_polynomial(values, window, 3, derivative=derivative, dt_s=0.01)
    peer = signal.savgol_filter(values, window, 3, deriv=derivative, delta=0.01, axis=0)
    np.testing.assert_allclose(ours, peer, atol=1e-9 * 100.0**derivative)


def test_differentiated_states_recover_the_structured_model() -> None:
    u, y = clean(0.01)
    result = fit("equation-error", navion_structured(), [Maneuver(0.01, u, y)], bandwidth=8.0)
    np.testing.assert_allclose(result.value("M_alpha"), TRUTH[5], rtol=0.02)
    np.testing.assert_allclose(result.value("M_q"), TRUTH[6], rtol=0.02)


def test_an_input_that_never_moves_is_named() -> None:
    maneuver = noisy(6)
    still = Maneuver(maneuver.dt_s, 0.0 * maneuver.inputs, maneuver.outputs)
    with pytest.raises(IdentificationError, match="never moved"):
        fit("equation-error", navion_free(), [still])
