"""Regression against statsmodels: estimates, covariances, partial F, recursion."""

import numpy as np
import pytest
import statsmodels.api as sm
from host.sysid import FitResult, LinearModel, Maneuver, Parameter, Term, fit
from host.sysid.estimators import regression_equations
from host.sysid.estimators.recursive import START_VARIANCE, update
from host.sysid.estimators.stepwise import F_IN, GAIN_LIMIT, choose_terms
from host.sysid.models.diagnostics import signal_fits, whiteness
from scipy import linalg, signal
from statsmodels.regression.recursive_ls import RecursiveLS
from statsmodels.stats.diagnostic import acorr_ljungbox
from statsmodels.tsa import stattools
from studies.data import with_rates
from studies.navion import navion_free

PITCH = ("a31", "a32", "a33", "a34", "b31")


def design(maneuver: Maneuver) -> tuple[np.ndarray, np.ndarray]:
    """Return regressors and measured pitch acceleration of the NAVION."""
    return np.hstack([maneuver.outputs, maneuver.inputs]), np.asarray(maneuver.rates)[:, 2]


def with_outliers(seed: int) -> Maneuver:
    maneuver = with_rates(seed, snr=100.0)
    rates = np.array(maneuver.rates)
    rng = np.random.default_rng(seed)
    hit = rng.random(len(rates)) < 0.05
    rates[hit] += 20.0 * rates.std(axis=0) * rng.standard_normal((hit.sum(), 4))
    return Maneuver(maneuver.dt_s, maneuver.inputs, maneuver.outputs, rates=rates)


def of_pitch(result: FitResult, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    place = [result.index(name) for name in PITCH]
    return result.estimate[place], covariance[np.ix_(place, place)]


def test_ordinary_least_squares_and_its_covariance_are_those_of_statsmodels() -> None:
    maneuver = with_rates(21, snr=10.0)
    result = fit("equation-error", navion_free(), [maneuver])
    X, y = design(maneuver)
    peer = sm.OLS(y, X).fit()
    theta, covariance = of_pitch(result, result.covariance_white)
    np.testing.assert_allclose(theta, peer.params, rtol=1e-8)
    np.testing.assert_allclose(covariance, peer.cov_params(), rtol=1e-6)
    # Degrees of freedom differ by definition: ours gives up one for each of the twenty unknowns
    # of the four equations, statsmodels one for each of the five of this equation.
    assert result.degrees_of_freedom[0] == peer.nobs - 20
    assert peer.df_resid == peer.nobs - 5


def tied() -> LinearModel:
    """Two equations of unlike noise that share one entry."""
    places = [("A", 0, 0, "shared"), ("A", 1, 1, "shared"), ("A", 0, 1, "a"), ("B", 1, 0, "b")]
    return LinearModel(
        name="tied",
        states=("x", "y"),
        inputs=("u",),
        outputs=("x", "y"),
        A=np.zeros((2, 2)),
        B=np.zeros((2, 1)),
        C=np.eye(2),
        D=np.zeros((2, 1)),
        terms=tuple(Term(*place) for place in places),
        parameters=tuple(Parameter(name) for name in ("shared", "a", "b")),
    )


def test_weighted_least_squares_and_its_covariance_are_those_of_statsmodels() -> None:
    rng = np.random.default_rng(22)
    x, u = rng.standard_normal((300, 2)), rng.standard_normal((300, 1))
    rates = np.column_stack([-1.5 * x[:, 0] + 0.4 * x[:, 1], -1.5 * x[:, 1] + 2.0 * u[:, 0]])
    rates += rng.standard_normal((300, 2)) * [3.0, 0.1]
    result = fit("equation-error-weighted", tied(), [Maneuver(0.02, u, x, rates=rates)])
    zero = np.zeros(300)
    X = np.vstack([np.column_stack([x, zero]), np.column_stack([x[:, 1], zero, u])])
    y, group = np.concatenate(rates.T), np.repeat([0, 1], 300)
    variance = np.ones(2)
    for _ in range(50):
        peer = sm.WLS(y, X, weights=1.0 / variance[group]).fit()
        variance = np.array([np.mean(peer.resid[group == k] ** 2) for k in (0, 1)])
    np.testing.assert_allclose(result.estimate, peer.params, rtol=1e-6)
    # Weights of the covariance divide by the degrees of freedom left, those of the fit by the
    # samples; either equation has two unknowns.
    unbiased = sm.WLS(y, X, weights=(1.0 - 2.0 / 300.0) / variance[group]).fit()
    np.testing.assert_allclose(result.covariance_white, unbiased.normalized_cov_params, rtol=1e-5)
    plain = fit("equation-error", tied(), [Maneuver(0.02, u, x, rates=rates)])
    assert np.linalg.norm(plain.estimate - peer.params) > 0.01


def test_huber_estimate_and_its_covariance_are_those_of_statsmodels() -> None:
    maneuver = with_outliers(23)
    result = fit("equation-error-robust", navion_free(), [maneuver])
    X, y = design(maneuver)
    peer = sm.RLM(y, X, M=sm.robust.norms.HuberT(1.345)).fit(maxiter=500, tol=1e-12, cov="H1")
    theta, covariance = of_pitch(result, result.covariance_white)
    # Scale: 1.4826 here, the fifteen-digit reciprocal of the normal quartile there.
    np.testing.assert_allclose(theta, peer.params, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(covariance, peer.bcov_scaled, rtol=2e-3)


def test_robust_interval_is_as_wide_as_the_scatter() -> None:
    """Over 40 draws of outliers, the Huber estimate scatters as its covariance says."""
    estimates, variances = [], []
    for seed in range(40):
        result = fit("equation-error-robust", navion_free(), [with_outliers(300 + seed)])
        theta, covariance = of_pitch(result, result.covariance_white)
        estimates.append(theta)
        variances.append(np.diag(covariance))
    ratio = np.var(estimates, axis=0) / np.mean(variances, axis=0)
    assert np.all((ratio > 0.4) & (ratio < 2.1))  # five standard deviations of 40 draws


@pytest.mark.parametrize("coefficient", [0.0, 0.5, 0.9])
def test_coloured_covariance_is_the_sandwich_of_the_residuals_autocovariance(
    coefficient: float,
) -> None:
    maneuver = with_rates(24, dt_s=0.02)
    X, y = design(maneuver)
    rng = np.random.default_rng(24)
    noise = signal.lfilter([1.0], [1.0, -coefficient], rng.standard_normal(y.shape))
    rates = np.array(maneuver.rates)
    rates[:, 2] += 0.1 * y.std() * noise / noise.std()
    dirty = Maneuver(maneuver.dt_s, maneuver.inputs, maneuver.outputs, rates=rates)
    result = fit("equation-error", navion_free(), [dirty])
    peer = sm.OLS(rates[:, 2], X).fit()
    lags = len(y) // 5
    autocovariance = stattools.acovf(peer.resid, demean=False, fft=True)
    autocovariance[lags + 1 :] = 0.0
    bread = peer.normalized_cov_params
    sandwich = bread @ X.T @ linalg.toeplitz(autocovariance) @ X @ bread
    _, covariance = of_pitch(result, result.covariance)
    np.testing.assert_allclose(covariance, sandwich, rtol=1e-5)
    # The textbook's HAC estimator multiplies residual and regressor before it correlates, and
    # weighs lags with a triangle: no assumption of one noise for the record, more scatter.
    hac = peer.get_robustcov_results("HAC", maxlags=40)
    share = np.sqrt(np.diag(covariance) / np.diag(hac.cov_params()))
    assert np.all((share > 0.5) & (share < 2.0))


def peer_choice(X: np.ndarray, y: np.ndarray, f_in: float, gain: float) -> list[int]:
    """Choose terms by partial F, every F and R2 from statsmodels."""
    chosen: list[int] = []
    total = float(y @ y)

    def full(columns: list[int]) -> sm.regression.linear_model.RegressionResults:
        return sm.OLS(y, X[:, columns] if columns else np.zeros((len(y), 1))).fit()

    while True:
        rss = full(chosen).ssr if chosen else total
        scores = []
        for k in [k for k in range(X.shape[1]) if k not in chosen]:
            larger = full([*chosen, k])
            f = larger.compare_f_test(full(chosen))[0] if chosen else larger.fvalue
            scores.append((f, k, rss - larger.ssr))
        if not scores:
            break
        f, k, drop = max(scores)
        if f < f_in or drop < gain * total:
            break
        chosen.append(k)
        if len(chosen) > 1:
            for k in list(chosen):
                rest = [c for c in chosen if c != k]
                if full(chosen).compare_f_test(full(rest))[0] < f_in:
                    chosen = rest
    return sorted(chosen)


def test_stepwise_chooses_by_the_partial_f_of_statsmodels() -> None:
    chosen = []
    for seed in range(15):
        rng = np.random.default_rng([25, seed])
        common = rng.standard_normal((18, 1))
        X = rng.standard_normal((18, 6)) + common
        theta = rng.choice([0.0, 0.4, 1.0], size=6)
        y = X @ theta + 0.8 * rng.standard_normal(18)
        for f_in, gain in ((F_IN, GAIN_LIMIT), (4.0, 0.0)):
            ours = choose_terms(X, y, np.zeros(6, dtype=bool), f_in=f_in, gain=gain)
            assert ours == peer_choice(X, y, f_in, gain)
            chosen.append(len(ours))
    assert len(set(chosen)) > 3  # the limits were tried from both sides


def test_recursive_least_squares_is_that_of_statsmodels_sample_by_sample() -> None:
    maneuver = with_rates(26, snr=10.0)
    X, y = design(maneuver)
    X = X / np.sqrt(np.mean(X**2, axis=0))
    theta, P = np.zeros(5), START_VARIANCE * np.eye(5)
    history = update(theta, P, np.ascontiguousarray(X), y, 1.0)
    peer = RecursiveLS(y, X).fit()
    # The start differs: a variance of 1e8 here, a diffuse one there; the input moves at 1 s.
    np.testing.assert_allclose(
        history[100:], peer.recursive_coefficients.filtered.T[100:], rtol=1e-3, atol=1e-4
    )
    np.testing.assert_allclose(theta, peer.params, rtol=1e-5)
    ordinary = sm.OLS(y, X).fit()
    np.testing.assert_allclose(P, ordinary.normalized_cov_params, rtol=1e-3, atol=1e-9)


def test_forgetting_weighs_the_past_as_weighted_least_squares_does() -> None:
    maneuver = with_rates(27, snr=10.0)
    X, y = design(maneuver)
    X = X / np.sqrt(np.mean(X**2, axis=0))
    theta, P = np.zeros(5), START_VARIANCE * np.eye(5)
    update(theta, P, np.ascontiguousarray(X), y, 0.99)
    weights = 0.99 ** np.arange(len(y))[::-1]
    np.testing.assert_allclose(theta, sm.WLS(y, X, weights=weights).fit().params, rtol=1e-4)


def test_ljung_box_and_autocorrelations_are_those_of_statsmodels() -> None:
    rng = np.random.default_rng(28)
    for coefficient in (0.0, 0.05, 0.1):
        e = signal.lfilter([1.0], [1.0, -coefficient], rng.standard_normal(1500))
        e -= e.mean()  # residuals have no mean to take off here; statsmodels takes it off
        outside, p_value = whiteness([e])
        peer = acorr_ljungbox(e, lags=[25])
        assert p_value == pytest.approx(float(peer["lb_pvalue"].iloc[0]), rel=1e-8)
        correlation = stattools.acf(e, nlags=25, fft=False)[1:]
        assert outside == pytest.approx(np.mean(np.abs(correlation) > 1.96 / np.sqrt(1500)))


def test_r_squared_is_that_of_statsmodels() -> None:
    rng = np.random.default_rng(29)
    X = sm.add_constant(rng.standard_normal((200, 3)))
    y = X @ [5.0, 1.0, -2.0, 0.5] + rng.standard_normal(200)
    peer = sm.OLS(y, X).fit()
    figures = signal_fits(["y"], [y[:, None]], [peer.resid[:, None]])[0]
    assert figures.r_squared == pytest.approx(peer.rsquared, rel=1e-12)
    assert figures.nrmse == pytest.approx(np.sqrt(1.0 - peer.rsquared), rel=1e-12)


def test_regression_equations_are_the_rows_of_the_design() -> None:
    maneuver = with_rates(30, snr=10.0)
    names, rows = regression_equations(navion_free(), [maneuver])
    X, y = design(maneuver)
    pitch = next(row for row in rows if row.label == "q_radps")
    np.testing.assert_allclose(pitch.regressors[:, [names.index(n) for n in PITCH]], X)
    np.testing.assert_allclose(pitch.dependent, y)
