"""Noise models, Kalman filters, responses and modes against statsmodels and python-control."""

from dataclasses import replace

import control
import numpy as np
import pytest
from host.sysid import LinearModel, Maneuver, Parameter, Term, fit
from host.sysid.models.modal_analysis import modes_of
from host.sysid.models.state_space_model import DelayGroup
from host.sysid.numerics import FilterProblem, OutputProblem
from host.sysid.numerics.ar_noise import (
    ArNoise,
    autocovariance,
    choose_order,
    fit_ar,
    lagged_moments,
)
from host.sysid.numerics.process_noise import discrete_noise
from host.sysid.numerics.riccati import predicted_covariance
from scipy import signal
from statsmodels.regression.linear_model import yule_walker
from statsmodels.tsa.ar_model import AutoReg, ar_select_order
from statsmodels.tsa.arima_process import arma_acovf
from statsmodels.tsa.statespace.kalman_filter import KalmanFilter
from statsmodels.tsa.statespace.sarimax import SARIMAX
from studies.data import TRUTH, noisy
from studies.navion import navion, navion_structured

RESONANT = np.array([1.6, -0.8])


def coloured(seed: int, samples: int, coefficient: np.ndarray = RESONANT) -> np.ndarray:
    white = np.random.default_rng(seed).standard_normal(samples + 500)
    return np.asarray(signal.lfilter([1.0], np.concatenate([[1.0], -coefficient]), white)[500:])


def moments_of(e: np.ndarray, order: int) -> np.ndarray:
    return lagged_moments([e], [np.zeros((len(e), 0))], order)


@pytest.mark.parametrize("order", [1, 2, 4])
def test_noise_model_is_the_autoregression_of_statsmodels(order: int) -> None:
    e = coloured(31, 800)
    ours, innovation = fit_ar(moments_of(e, order), order)
    peer = AutoReg(e, order, trend="n").fit()
    np.testing.assert_allclose(ours, peer.params, rtol=1e-8)
    assert innovation == pytest.approx(float(peer.resid @ peer.resid), rel=1e-8)
    # Yule-Walker takes what lies beyond the record for zero: a few parts in `samples` off.
    walker, _ = yule_walker(e, order=order, method="mle", demean=False, result_object=False)
    np.testing.assert_allclose(ours, walker, atol=30.0 / len(e))


def test_order_of_the_noise_model_is_that_of_statsmodels() -> None:
    orders = []
    for seed in range(12):
        e = coloured(320 + seed, 400, np.array([0.5, 0.0, [0.0, 0.15, 0.3][seed % 3]]))
        peer = ar_select_order(e, 6, ic="bic", trend="n")
        ours = choose_order(moments_of(e, 6), len(e) - 6)
        assert ours == max(peer.ar_lags or [0])
        orders.append(ours)
    assert len(set(orders)) > 1


def test_autocovariance_is_that_of_statsmodels() -> None:
    for coefficient in (np.array([0.9]), RESONANT, np.array([0.3, 0.2, -0.4])):
        peer = arma_acovf(np.concatenate([[1.0], -coefficient]), [1.0], nobs=40)
        np.testing.assert_allclose(autocovariance(coefficient, 39), peer, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("coefficient", [[0.9], [1.6, -0.8], [0.3, 0.2, -0.4]])
def test_whitened_likelihood_is_the_exact_one_of_statsmodels(coefficient: list[float]) -> None:
    e = coloured(33, 300, np.array(coefficient))
    noise = ArNoise.from_coefficient(np.array(coefficient))
    white, variance = noise.whiten(e[:, None])[:, 0], 1.7
    ours = -0.5 * (
        len(e) * np.log(2.0 * np.pi * variance)
        + noise.log_determinant()
        + float(white @ white) / variance
    )
    peer = SARIMAX(e, order=(len(coefficient), 0, 0)).loglike([*coefficient, variance])
    assert ours == pytest.approx(peer, rel=1e-10)


def sampled(A: np.ndarray, B: np.ndarray, dt_s: float) -> tuple[np.ndarray, np.ndarray]:
    system = control.ss(A, B, np.eye(len(A)), np.zeros((len(A), B.shape[1])))
    held = control.sample_system(system, dt_s, method="zoh")
    return np.asarray(held.A), np.asarray(held.B)


@pytest.mark.parametrize("share", [1.0, 0.6])
def test_likelihood_and_innovations_of_filter_error_are_those_of_statsmodels(share: float) -> None:
    """Same model, same noise, first covariance the steady one: same likelihood to the last digit.

    Left to itself statsmodels starts from a diffuse state; the steady filter here takes start
    states for parameters instead, which is the same from the second time constant on. Both leave
    out the samples at which an output was not measured.
    """
    maneuver = noisy(34, 0.05)
    seen = np.random.default_rng(38).random(maneuver.outputs.shape) < share
    maneuver = replace(maneuver, sampled=seen)
    model = navion_structured()
    process, noise = np.array([0.3, 0.02, 0.1]), np.array([0.8, 0.01, 0.02, 0.015])
    start = np.array([0.4, -0.01, 0.02, 0.01])
    problem = FilterProblem(model, [maneuver], ("u_mps", "alpha_rad", "q_radps"))
    point = problem.evaluate(np.concatenate([TRUTH, start, np.log(process), np.log(noise)]))
    assert point is not None

    A, B = navion()
    F, G = sampled(A, B, maneuver.dt_s)
    intensity = np.diag([*process**2, 0.0])
    # Noise a sample adds, from the steady state of a stable system: X = F X F' + Q.
    X = control.lyap(A, intensity)
    Q, R = X - F @ X @ F.T, np.diag(noise**2)
    gain, P, _ = control.dlqe(F, np.eye(4), np.eye(4), 0.5 * (Q + Q.T), R)
    peer = KalmanFilter(k_endog=4, k_states=4, k_posdef=4)
    peer.bind(np.where(seen, maneuver.outputs, np.nan))
    peer["design"] = np.eye(4)
    peer["transition"] = F
    peer["selection"] = np.eye(4)
    peer["state_intercept"] = G @ maneuver.inputs.T
    peer["state_cov"], peer["obs_cov"] = 0.5 * (Q + Q.T), R
    peer.initialize_known(start, P)
    output = peer.filter()
    expected = np.where(seen, output.forecasts_error.T, 0.0)
    np.testing.assert_allclose(point.e[0], expected, atol=1e-8)
    # Our cost leaves out the constant of the normal density.
    constant = 0.5 * seen.sum() * np.log(2.0 * np.pi)
    assert -point.cost - constant == pytest.approx(float(output.llf), rel=1e-9)
    # python-control's gain predicts: it has the transition in it.
    np.testing.assert_allclose(F @ point.filters[0].K, gain, rtol=1e-6, atol=1e-9)


def test_riccati_and_process_noise_are_those_of_python_control() -> None:
    A, _ = navion()
    intensity = np.array([0.09, 4e-4, 0.01, 0.0])
    F, Q = discrete_noise(A, intensity, 0.05)
    stationary = control.lyap(A, np.diag(intensity))
    np.testing.assert_allclose(control.dlyap(F, Q), stationary, rtol=1e-6, atol=1e-12)
    C, R = np.eye(4)[[1, 3]], np.diag([1e-4, 2e-4])
    solved, P = predicted_covariance(F, np.ascontiguousarray(C), Q, R)
    assert solved
    _, peer, _ = control.dlqe(F, np.eye(4), C, Q, R)
    np.testing.assert_allclose(P, peer, rtol=1e-6, atol=1e-10)


def only_inputs_free() -> LinearModel:
    """Return the NAVION with elevator effects alone unknown: joint estimation is linear then."""
    A, B = navion()
    known = B.copy()
    known[1:3] = 0.0
    return LinearModel(
        name="NAVION, inputs free",
        states=navion_structured().states,
        inputs=("elevator_rad",),
        outputs=navion_structured().states,
        A=A,
        B=known,
        C=np.eye(4),
        D=np.zeros((4, 1)),
        terms=(Term("B", 1, 0, "Z_de"), Term("B", 2, 0, "M_de")),
        parameters=(Parameter("Z_de"), Parameter("M_de")),
    )


@pytest.mark.parametrize("method", ["extended-kalman", "unscented-kalman"])
def test_joint_kalman_filters_are_statsmodels_where_the_problem_is_linear(method: str) -> None:
    maneuver = noisy(35, 0.05)
    noise, process = np.array([0.5, 0.01, 0.02, 0.01]), np.array([0.05, 1e-3, 2e-3, 1e-3])
    start = np.array([-0.1, -8.0])
    result = fit(method, only_inputs_free(), [maneuver], noise=noise, process=process, start=start)
    A, B = navion()
    F, G = sampled(A, np.eye(4), maneuver.dt_s)
    known = B[:, 0].copy()
    known[1:3] = 0.0
    transition = np.zeros((6, 6, maneuver.samples))
    transition[:4, :4] = F[:, :, None]
    transition[4:, 4:] = np.eye(2)[:, :, None]
    transition[:4, 4:] = G[:, 1:3, None] * maneuver.inputs[:, 0]
    first = (0.5 * np.abs(start) + 1e-3 * np.max(np.abs(start))) ** 2
    for _ in range(2):  # both filters pass over the record twice
        peer = KalmanFilter(k_endog=4, k_states=6, k_posdef=6)
        peer.bind(maneuver.outputs)
        peer["design"] = np.eye(4, 6)
        peer["transition"] = transition
        peer["selection"] = np.eye(6)
        peer["state_intercept"] = np.vstack(
            [np.outer(G @ known, maneuver.inputs[:, 0]), np.zeros((2, maneuver.samples))]
        )
        peer["state_cov"] = np.diag([*(process**2 * maneuver.dt_s), 0.0, 0.0])
        peer["obs_cov"] = np.diag(noise**2)
        peer.initialize_known(
            np.concatenate([maneuver.outputs[0], start]), np.diag([*(9.0 * noise**2), *first])
        )
        output = peer.filter()
        start = output.filtered_state[4:, -1]
    # The unscented filter steps by Runge-Kutta instead of the exact transition.
    share = 1e-7 if method == "extended-kalman" else 3e-4
    np.testing.assert_allclose(result.estimate, start, rtol=share)
    covariance = output.filtered_state_cov[4:, 4:, -1]
    np.testing.assert_allclose(result.covariance_white, covariance, rtol=100.0 * share)
    np.testing.assert_allclose(result.residuals[0], output.forecasts_error.T, atol=10.0 * share)


@pytest.mark.parametrize("hold", ["zoh", "foh"])
def test_response_is_that_of_python_control(hold: str) -> None:
    A, B = navion()
    dt_s = 0.04
    rng = np.random.default_rng(36)
    u = 0.05 * np.cumsum(rng.standard_normal((300, 1)), axis=0) / 10.0
    start = np.array([1.0, 0.02, -0.05, 0.03])
    model = replace(navion_structured(), hold=hold)
    ours = OutputProblem(model, [Maneuver(dt_s, u, np.zeros((300, 4)))]).respond(
        np.concatenate([TRUTH, start])
    )
    assert ours is not None
    time_s = np.arange(300) * dt_s
    system = control.ss(A, B, np.eye(4), np.zeros((4, 1)))
    if hold == "zoh":
        # A held input of a sampled system; the last sample's input moves nothing any more.
        system = control.sample_system(system, dt_s, method="zoh")
    peer = control.forced_response(system, time_s, u[:, 0], start)
    np.testing.assert_allclose(ours[0].y, peer.outputs, rtol=1e-7, atol=1e-9)


def test_delay_is_that_of_a_shift_register_and_of_a_finer_grid() -> None:
    A, B = navion()
    dt_s, samples = 0.02, 500
    delays = (DelayGroup("delay_s", ("alpha_rad",), prior_sd_s=1.0, limit_s=0.1),)
    model = replace(navion_structured(), delays=delays)
    time_s = np.arange(samples) * dt_s
    u = (0.05 * np.sin(2.0 * np.pi * 0.5 * time_s) ** 3)[:, None]
    problem = OutputProblem(model, [Maneuver(dt_s, u, np.zeros((samples, 4)))])
    held = control.sample_system(control.ss(A, B, np.eye(4)[[1]], [[0.0]]), dt_s, method="zoh")
    register = control.tf([1.0], [1.0, 0.0, 0.0], dt_s)
    peer = control.forced_response(register * held, time_s, u[:, 0]).outputs
    whole = problem.respond(np.concatenate([TRUTH, [2.0 * dt_s], np.zeros(4)]))
    assert whole is not None
    # Over the first samples the delay leans on the record, the register on zeros.
    np.testing.assert_allclose(whole[0].y[1, 4:], peer[4:], atol=1e-7)
    fine = control.sample_system(
        control.ss(A, B, np.eye(4)[[1]], [[0.0]]), dt_s / 10.0, method="zoh"
    )
    between = control.forced_response(
        fine, np.arange(10 * samples) * dt_s / 10.0, np.repeat(u[:, 0], 10)
    ).outputs
    part = problem.respond(np.concatenate([TRUTH, [0.3 * dt_s], np.zeros(4)]))
    assert part is not None
    size = np.ptp(between)
    np.testing.assert_allclose(part[0].y[1, 4:], between[37::10][: samples - 4], atol=1e-4 * size)


def test_modes_are_those_of_python_control() -> None:
    A, B = navion()
    found = modes_of(navion_structured(), A, np.zeros((9, 9)))
    system = control.ss(A, B, np.eye(4), np.zeros((4, 1)))
    frequency, damping, pole = control.damp(system, doprint=False)
    ours = sorted((m.frequency_radps, m.damping, m.eigenvalue) for m in found)
    upper = sorted(
        (w, z, p) for w, z, p in zip(frequency, damping, pole, strict=True) if p.imag > 0.0
    )
    np.testing.assert_allclose(ours, upper, rtol=1e-8)


def test_frequency_response_is_that_of_python_control() -> None:
    """Response to slow sines, once settled: gain and phase of the transfer function."""
    A, B = navion()
    dt_s = 0.02
    model = replace(navion_structured(), hold="foh")
    system = control.ss(A, B, np.eye(4), np.zeros((4, 1)))
    for omega_radps in (1.0, 3.0, 6.0):
        time_s = np.arange(20000) * dt_s
        wave = 0.02 * np.sin(omega_radps * time_s)[:, None]
        problem = OutputProblem(model, [Maneuver(dt_s, wave, np.zeros((len(wave), 4)))])
        response = problem.respond(np.concatenate([TRUTH, np.zeros(4)]))
        assert response is not None
        late = slice(17000, 20000)
        basis = np.column_stack([np.cos(omega_radps * time_s), np.sin(omega_radps * time_s)])
        part, *_ = np.linalg.lstsq(basis[late], response[0].y[:, late].T, rcond=None)
        ours = (part[1] + 1j * part[0]) / 0.02
        peer = system(1j * omega_radps)[:, 0]
        np.testing.assert_allclose(ours, peer, rtol=2e-3)
