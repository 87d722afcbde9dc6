"""Figures of fit, refusals and modes against definitions and Monte Carlo."""

from dataclasses import replace

import numpy as np
import pytest
from host.sysid import Maneuver, fit
from host.sysid.models.diagnostics import (
    collinearity,
    constant_inputs,
    exceedance,
    references,
    refusals,
    signal_fits,
    thesis_program_error_percent,
    thesis_sum_of_mean_errors,
    whiteness,
)
from host.sysid.models.modes import modes, modes_of
from host.sysid.study.aircraft import navion, navion_free, navion_structured
from host.sysid.study.data import TRUTH, noisy
from scipy import signal, stats


def test_figures_of_fit_equal_their_definitions() -> None:
    rng = np.random.default_rng(1)
    y = rng.standard_normal((500, 1)) + 3.0
    e = 0.1 * rng.standard_normal((500, 1))
    figures = signal_fits(["a"], [y[:200], y[200:]], [e[:200], e[200:]])[0]
    centred = np.concatenate([y[:200] - y[:200].mean(), y[200:] - y[200:].mean()])
    assert figures.r_squared == pytest.approx(1.0 - np.sum(e**2) / np.sum(centred**2))
    assert figures.nrmse == pytest.approx(np.sqrt(np.mean(e**2) / np.mean(centred**2)))
    model = y - e
    expected = np.sqrt(np.mean(e**2)) / (np.sqrt(np.mean(y**2)) + np.sqrt(np.mean(model**2)))
    assert figures.theil == pytest.approx(expected)


def test_whiteness_tells_white_from_coloured() -> None:
    rng = np.random.default_rng(2)
    p_values = [whiteness([rng.standard_normal(1000)])[1] for _ in range(200)]
    assert 0.01 <= np.mean(np.array(p_values) < 0.05) <= 0.10
    coloured = signal.lfilter([1.0], [1.0, -0.3], rng.standard_normal(1000))
    outside, p_value = whiteness([coloured])
    assert p_value < 1e-6
    assert outside > 0.04


def test_thesis_figures_show_what_the_second_division_hides() -> None:
    measured = np.column_stack([np.full(77, 2.0), np.full(77, -4.0)])
    simulated = measured * 0.72
    honest = 2 * 28.0
    assert thesis_program_error_percent(measured, simulated) == pytest.approx(honest / 77)
    assert thesis_sum_of_mean_errors(measured, simulated) == pytest.approx(0.28 * 6.0)


def test_navion_is_answered_and_the_thesis_example_is_refused() -> None:
    result = fit("output-error", navion_structured(), [noisy(3, 0.01)])
    assert refusals(result, [noisy(3, 0.01)]) == ()
    still = noisy(3, 0.01, duration_s=2.0)  # one second of motion: too little for the slow mode
    short = fit("output-error", navion_structured(), [still])
    named = {r.name for r in refusals(short, [still])}
    assert "X_alpha" in named
    assert "M_de" not in named


def test_probability_of_exceeding_is_that_of_a_normal_value_over_its_bound() -> None:
    """One parameter, far above its floor: P(|theta| < sigma) of a normal theta by its formula."""
    result = fit("output-error", navion_structured(), [noisy(3, 0.01)])
    k = result.index("Z_alpha")
    for ratio in (0.7, 1.0, 1.6):
        estimate, covariance = result.estimate.copy(), result.covariance.copy()
        covariance[k, :] = covariance[:, k] = 0.0
        covariance[k, k] = (estimate[k] / ratio) ** 2
        single, any_of_them = exceedance(replace(result, covariance=covariance), [noisy(3, 0.01)])
        # The prior pulls it a little: three times the whole state rate, here about its own size.
        expected = stats.norm.cdf(1.0 - ratio) - stats.norm.cdf(-1.0 - ratio)
        assert single[k] == pytest.approx(expected, abs=0.1)
        assert any_of_them == pytest.approx(float(single[k]), abs=0.03)
        named = {r.name for r in refusals(replace(result, covariance=covariance), [noisy(3, 0.01)])}
        assert ("Z_alpha" in named) == (any_of_them > 0.5)


def test_small_parameters_are_measured_by_what_would_matter() -> None:
    model = navion_free()
    A, B = navion()
    theta = np.concatenate([A.ravel(), B.ravel()])
    maneuver = noisy(4, 0.01, snr=1e6)
    reference = references(model, [maneuver], theta)
    spread = np.std(np.hstack([maneuver.outputs, maneuver.inputs]), axis=0)
    largest = np.max(np.abs(np.concatenate([A[0], B[0]])) * spread)
    assert reference[model.parameter_names.index("b11")] == pytest.approx(
        0.05 * largest / spread[4], rel=1e-3
    )
    assert reference[model.parameter_names.index("a33")] == pytest.approx(abs(A[2, 2]))


def test_an_input_that_repeats_another_is_named_as_collinear() -> None:
    rng = np.random.default_rng(5)
    first = noisy(6)
    model = navion_structured()
    result = fit("output-error", model, [first])
    assert not collinearity(result).severe
    still = Maneuver(first.dt_s, 0.0 * first.inputs, first.outputs + rng.standard_normal((400, 4)))
    assert constant_inputs(model, [still]) == ("elevator_rad",)
    assert constant_inputs(model, [first]) == ()


def test_mode_uncertainty_agrees_with_monte_carlo() -> None:
    model = navion_structured()
    result = fit("output-error", model, [noisy(8, 0.02)])
    count = len(model.parameters)
    covariance = result.covariance[:count, :count]
    rng = np.random.default_rng(8)
    draws = rng.multivariate_normal(result.estimate[:count], covariance, 4000)
    found = modes(result)
    assert [m.name for m in found] == ["short period", "phugoid"]
    values = np.array([np.linalg.eigvals(model.matrices(d)[0]) for d in draws])
    for mode, lower, upper in ((found[0], 1.5, 10.0), (found[1], 0.0, 1.5)):
        picked = np.where((np.abs(values) > lower) & (np.abs(values) < upper), values, np.nan)
        frequency = np.nanmean(np.abs(picked), axis=1)
        damping = np.nanmean(-picked.real / np.abs(picked), axis=1)
        assert np.std(frequency) == pytest.approx(mode.frequency_sd_radps, rel=0.1)
        assert np.std(damping) == pytest.approx(mode.damping_sd, rel=0.1)


def test_navion_modes_are_the_published_ones() -> None:
    A, _ = navion()
    short, long = modes_of(navion_structured(), A, np.zeros((9, 9)))
    assert short.eigenvalue == pytest.approx(-2.49 + 2.60j, abs=0.01)
    assert long.eigenvalue == pytest.approx(-0.017 + 0.214j, abs=0.001)
    assert long.damping == pytest.approx(0.0796, abs=1e-3)
    assert len(TRUTH) == 9
