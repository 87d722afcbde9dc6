"""Figures of fit, refusals and modes against definitions and Monte Carlo."""

from dataclasses import replace

import numpy as np
import pytest
from host.aircraft.mass_properties import Condition
from host.sysid import Maneuver, fit
from host.sysid.answer import answer_document
from host.sysid.answer.estimate_lines import model_lines
from host.sysid.linear import Answer
from host.sysid.models import Parameter, Term, Trim, model_from
from host.sysid.models.collinearity import collinearity, constant_inputs
from host.sysid.models.diagnostics import (
    NOT_IDENTIFIABLE,
    WEAKLY_IDENTIFIABLE,
    assess_identifiability,
    bound_exceedance_probability,
    identifiability_flags,
    reference_values,
    signal_fits,
)
from host.sysid.models.modal_analysis import modes
from scipy import stats
from studies.data import noisy
from studies.navion import navion, navion_free, navion_structured

from tests.host.sysid.verdicts import verdict_lines, verdict_of


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


def test_navion_is_answered_and_the_thesis_example_is_refused() -> None:
    result = fit("output-error", navion_structured(), [noisy(3, 0.01)])
    assert identifiability_flags(result, [noisy(3, 0.01)]) == ()
    still = noisy(3, 0.01, duration_s=2.0)  # one second of motion: too little for the slow mode
    short = fit("output-error", navion_structured(), [still])
    named = {r.name for r in identifiability_flags(short, [still])}
    assert "X_alpha" in named
    assert "M_de" not in named


@pytest.mark.parametrize(
    ("ratio", "grade"),
    [(0.7, NOT_IDENTIFIABLE), (1.2, WEAKLY_IDENTIFIABLE), (1.6, WEAKLY_IDENTIFIABLE), (3.0, None)],
)
def test_probability_of_exceeding_is_that_of_a_normal_value_over_its_bound(
    ratio: float, grade: str | None
) -> None:
    """One parameter, far above its floor: P(|theta| < sigma) of a normal theta by its formula."""
    maneuver = noisy(3, 0.01)
    result = fit("output-error", navion_structured(), [maneuver])
    k = result.index("Z_alpha")
    covariance = result.covariance.copy()
    covariance[k, :] = covariance[:, k] = 0.0
    covariance[k, k] = (result.estimate[k] / ratio) ** 2
    doubted = replace(result, covariance=covariance)
    single, any_of_them = bound_exceedance_probability(doubted, [maneuver])
    # The prior pulls it a little: three times the whole state rate, here about its own size.
    expected = stats.norm.cdf(1.0 - ratio) - stats.norm.cdf(-1.0 - ratio)
    assert single[k] == pytest.approx(expected, abs=0.1)
    assert any_of_them == pytest.approx(float(single[k]), abs=0.03)
    found = assess_identifiability(doubted, [maneuver])
    assert found.not_identifiable == (grade == NOT_IDENTIFIABLE)
    assert {r.name: r.grade for r in found.flags} == ({"Z_alpha": grade} if grade else {})
    for named in found.flags:
        assert named.probability == pytest.approx(float(single[k]))
        if ratio > 1.0:
            assert f"probability of {100.0 * single[k]:.0f} %" not in named.reason
            assert "of its value" in named.reason


def test_collinear_parameters_are_named_with_their_partner_and_grade() -> None:
    rng = np.random.default_rng(9)
    maneuver = noisy(9, 0.05)
    twin = maneuver.inputs + 1e-4 * rng.standard_normal(maneuver.inputs.shape)
    one = navion_structured()
    two = replace(
        one,
        inputs=(*one.inputs, "tab_rad"),
        B=np.hstack([one.B, np.zeros((4, 1))]),
        D=np.zeros((4, 2)),
        terms=(*one.terms, Term("B", 2, 1, "M_tab")),
        parameters=(*one.parameters, Parameter("M_tab", 0.0)),
    )
    doubled = Maneuver(maneuver.dt_s, np.hstack([maneuver.inputs, twin]), maneuver.outputs)
    found = assess_identifiability(fit("output-error", two, [doubled]), [doubled])
    named = {r.name: r for r in found.flags}
    assert found.not_identifiable
    assert {"M_de", "M_tab"} <= set(found.names(NOT_IDENTIFIABLE))
    assert "its correlation with M_de is" in named["M_tab"].reason
    assert "Z_alpha" not in named


def test_both_grades_reach_the_words_the_table_and_the_document() -> None:
    maneuver = noisy(3, 0.01, duration_s=2.0)
    result = fit("output-error", navion_structured(), [maneuver])
    found = assess_identifiability(result, [maneuver])
    cannot, doubtful = found.names(NOT_IDENTIFIABLE), found.names(WEAKLY_IDENTIFIABLE)
    assert cannot
    assert doubtful
    answer = Answer(
        template="longitudinal",
        method="output-error",
        model=result.model,
        trim=Trim(17.0),
        condition=Condition(17.0, 177.0),
        maneuvers=(maneuver,),
        used=(),
        held_out=(),
        result=result,
        fits=(),
        validation=(),
        identifiability_flags=found.flags,
        collinearity=collinearity(result),
        modes=(),
        coefficients=(),
        constant_inputs=(),
        delays={},
    )
    text = verdict_lines([answer], [])
    table = model_lines(answer, verdict_of(answer))
    document = answer_document(answer, text, verdict_of(answer))
    for named in found.flags:
        assert f"  not known: {named.name} ({named.reason})" in text
        assert any(line.split()[0] == named.name and " not" in line for line in table)
    trusted = next(line for line in text if "good (" in line)
    assert not set(cannot + doubtful) & {w.strip(",") for w in trusted.split()}
    assert {r["name"]: r["grade"] for r in document["refused"]} == {
        **dict.fromkeys(cannot, NOT_IDENTIFIABLE),
        **dict.fromkeys(doubtful, WEAKLY_IDENTIFIABLE),
    }
    assert all(0.05 < r["probability"] <= 1.0 for r in document["refused"])


def test_small_parameters_are_measured_by_what_would_matter() -> None:
    model = navion_free()
    A, B = navion()
    theta = np.concatenate([A.ravel(), B.ravel()])
    maneuver = noisy(4, 0.01, snr=1e6)
    reference = reference_values(model, [maneuver], theta)
    spread = np.std(np.hstack([maneuver.outputs, maneuver.inputs]), axis=0)
    largest = np.max(np.abs(np.concatenate([A[0], B[0]])) * spread)
    assert reference[model.parameter_names.index("b11")] == pytest.approx(
        0.05 * largest / spread[4], rel=1e-3
    )
    assert reference[model.parameter_names.index("a33")] == pytest.approx(abs(A[2, 2]))
    plain = reference_values(model, [maneuver], theta, small_share=0.0)
    np.testing.assert_array_equal(plain, np.abs(theta))


def test_a_state_that_nobody_measured_sets_no_scale() -> None:
    """The unit of a user's `w` is not known: M_q and M_de were "small" beside it."""
    model = model_from(
        {
            "name": "hidden",
            "states": ["w", "q_radps"],
            "inputs": ["elevator_rad"],
            "outputs": ["q_radps"],
            "delays": [],
            "A": [[-4.0, 1.0], ["M_alpha", "M_q"]],
            "B": [[0.0], ["M_de"]],
            "parameters": {"M_alpha": -50.0, "M_q": -6.0, "M_de": -40.0},
        }
    )
    t = np.arange(400) * 0.02
    wave = np.sin(3.0 * t)[:, None]
    maneuver = Maneuver(0.02, 0.05 * wave, 0.2 * np.roll(wave, 20, axis=0))
    values = reference_values(model, [maneuver], model.start)
    np.testing.assert_array_equal(values, np.abs(model.start))


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
