"""Every method behind one door: truth recovered, peers agreed with, failures in one line."""

import numpy as np
import pytest
from host.errors import IdentificationError
from host.sysid import FitResult, Maneuver, fit, methods
from host.sysid.estimators.kalman import innovation_inflation
from host.sysid.numerics import FilterProblem, OutputProblem, minimise
from scipy import linalg, signal
from studies.data import TRUTH, clean, gusty, noisy
from studies.navion import navion, navion_free, navion_structured

CHEAP = [m for m in methods() if m not in ("hopfield-line-search", "hopfield")]


def quiet(dt_s: float = 0.02, snr: float = 1e6) -> Maneuver:
    return noisy(77, dt_s, snr=snr)


@pytest.mark.parametrize("method", CHEAP)
def test_every_method_recovers_the_strong_derivatives(method: str) -> None:
    settings: dict[str, dict[str, object]] = {
        "genetic": {"generations": 5},
        "neural-delta": {"repeats": 3},
        "recursive-fourier": {"limits_hz": (0.05, 1.5)},
    }
    options = settings.get(method, {})
    start = navion_structured().with_start(TRUTH * 1.2)
    result = fit(method, start, [quiet()], **options)
    assert isinstance(result, FitResult)
    assert len(result.names) == len(result.estimate) == len(result.covariance)
    assert np.isfinite(result.estimate).all()
    assert len(result.residuals) == 1
    share = 0.15 if method in ("neural-delta", "recursive-fourier", "stepwise") else 0.06
    for name in ("Z_alpha", "M_alpha", "M_q", "M_de"):
        truth = TRUTH[[p.name for p in start.parameters].index(name)]
        assert result.value(name) == pytest.approx(truth, rel=share), name


def test_unknown_method_and_parameter_are_named() -> None:
    with pytest.raises(IdentificationError, match="unknown method 'magic'"):
        fit("magic", navion_structured(), [quiet()])
    result = fit("equation-error", navion_structured(), [quiet()])
    with pytest.raises(IdentificationError, match="no parameter 'Q_alpha'"):
        result.value("Q_alpha")
    with pytest.raises(IdentificationError, match="no maneuver"):
        fit("output-error", navion_structured(), [])
    with pytest.raises(IdentificationError, match="forgetting"):
        fit("recursive", navion_free(), [quiet()], forgetting=1.5)


def test_frequency_output_error_is_exact_without_noise_and_knows_its_error() -> None:
    u, y = clean(0.05)
    exact = fit("frequency-output-error", navion_structured(), [Maneuver(0.05, u, y)])
    np.testing.assert_allclose(exact.estimate, TRUTH, rtol=1e-6)
    time_domain = fit("output-error", navion_structured(), [noisy(200)])
    frequency = fit("frequency-output-error", navion_structured(), [noisy(200)])
    ratio = np.median(frequency.standard_error / time_domain.standard_error[:9])
    assert 0.8 < ratio < 1.3
    assert np.max(np.abs(frequency.estimate - TRUTH) / frequency.standard_error) < 4.0


def test_stepwise_drops_what_is_not_there() -> None:
    u, y = clean(0.02)
    A, B = navion()
    rng = np.random.default_rng(2)
    rates = y @ A.T + u @ B.T
    rates += 0.01 * rates.std(axis=0) * rng.standard_normal(rates.shape)
    maneuver = Maneuver(0.02, u, y, rates=rates)
    result = fit("stepwise", navion_free(), [maneuver])
    kept = {n for n, v in zip(result.names, result.estimate, strict=True) if v != 0.0}
    assert {"a14", "a22", "a23", "a32", "a33", "a43", "b31"} <= kept
    assert not kept & {"a13", "a24", "a34", "a41", "a42", "a44", "b41"}
    assert "set to zero" in result.warnings[0]


def turbulent(seed: int, dt_s: float = 0.02) -> Maneuver:
    """NAVION in white vertical and pitching disturbances, little sensor noise."""
    u, y = clean(dt_s)
    A, B = navion()
    fine = 4
    F = linalg.expm(A * dt_s / fine)
    G = np.linalg.solve(A, F - np.eye(4)) @ B
    rng = np.random.default_rng(seed)
    q = np.array([0.0, 0.02, 0.1, 0.0]) * np.sqrt(dt_s / fine)
    x, states = np.zeros(4), np.zeros_like(y)
    for k in range(len(u)):
        states[k] = x
        for _ in range(fine):
            x = F @ x + G @ u[k] + q * rng.standard_normal(4)
    deviation = np.sqrt(np.mean(y**2, axis=0) / 400.0)
    return Maneuver(dt_s, u, states + deviation * rng.standard_normal(y.shape))


def test_filter_error_beats_output_error_in_turbulence_and_knows_its_error() -> None:
    model, maneuver = navion_structured(), turbulent(0)
    result = fit("filter-error", model, [maneuver], process=("alpha_rad", "q_radps"))
    assert result.converged
    problem = OutputProblem(model, [maneuver])
    plain = minimise(problem, problem.first_guess()).theta[:9] - TRUTH
    ours = result.estimate[:9] - TRUTH
    assert np.max(np.abs(ours / plain)[[3, 5, 6]]) < 0.85  # Z_alpha, M_alpha, M_q
    assert np.max(np.abs(ours) / result.standard_error[:9]) < 4.0
    np.testing.assert_allclose(result.details["process_deviation"], [0.02, 0.1], rtol=0.25)


@pytest.mark.parametrize("log_noise", [-400.0, 340.0])
def test_a_filter_that_has_no_gain_is_no_answer(log_noise: float) -> None:
    problem = FilterProblem(navion_structured(), [noisy(12)], ("alpha_rad",))
    theta = np.concatenate([TRUTH, np.zeros(4), [0.0], np.log([1.0, 0.1, 0.1, 0.1])])
    assert problem.evaluate(theta) is not None
    theta[-4] = log_noise
    theta[-5] = abs(log_noise)
    assert problem.evaluate(theta) is None


def test_kalman_filters_say_when_their_noise_model_is_wrong() -> None:
    """Gusts leave innovations that last: intervals must say so, and hold the truth."""
    calm = fit("extended-kalman", navion_structured(), [noisy(13, 0.02)])
    assert calm.warnings == ()
    assert calm.details["innovation_inflation"] < 1.3
    held, before = [], []
    for seed in range(2):
        result = fit("extended-kalman", navion_structured(), [gusty(seed, 0.05)])
        assert "innovations" in result.warnings[0]
        miss = np.abs(result.estimate - TRUTH)
        held.append(miss <= result.half_width())
        before.append(miss <= 1.96 * np.sqrt(np.diag(result.covariance_white)))
    assert np.mean(held) > 0.7
    assert np.mean(before) < 0.4


def test_inflation_is_power_times_the_time_a_correlation_lasts() -> None:
    rng = np.random.default_rng(4)
    white = rng.standard_normal((20000, 2))
    assert innovation_inflation([white]) == pytest.approx(1.0, abs=0.05)
    assert innovation_inflation([2.0 * white[:9000], 2.0 * white[9000:]]) == pytest.approx(
        4.0, rel=0.05
    )
    slow = signal.lfilter([1.0], [1.0, -0.8], white, axis=0)
    # The factor of an AR(1) process: its variance times (1 + a) / (1 - a), which is 1 / (1 - a)^2.
    assert innovation_inflation([slow]) == pytest.approx(25.0, rel=0.15)
