"""Filter error in Dryden gusts: the aircraft of the study, the gusts as states, the bound."""

import numpy as np
import pytest
from host.aircraft import file as aircraft
from host.aircraft import trim
from host.aircraft.linearisation import linearise
from host.sysid.estimators.filter_error import information_at
from host.sysid.numerics import FilterProblem
from scipy import linalg
from studies.gusts import AXES, fly, gusty_aircraft
from studies.turbulence import PROCESS, fitted_model, run_case, true_vector


@pytest.mark.parametrize("axis", list(AXES))
def test_coefficients_give_the_linearised_aircraft(axis: str) -> None:
    plane = gusty_aircraft()
    A, B, _, _ = plane.models[axis].matrices(plane.truth[axis])
    frame = aircraft.load("ultrastick25e").airframe()
    linear = linearise(frame, trim.solve(frame, plane.airspeed_mps))
    true_A, true_B = (
        (linear.longitudinal_a, linear.longitudinal_b)
        if axis == "longitudinal"
        else (linear.lateral_a, linear.lateral_b)
    )
    # A change of states leaves the roots and the steady response of the attitude's row.
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(A)), np.sort_complex(np.linalg.eigvals(true_A)), rtol=2e-3
    )
    gain = [np.linalg.solve(a, b)[3] for a, b in ((A, B), (true_A, true_B))]
    np.testing.assert_allclose(gain[0], gain[1], rtol=2e-3)


@pytest.mark.parametrize("axis", list(AXES))
def test_innovations_at_the_truth_are_white_and_of_their_size(axis: str) -> None:
    """The gust model is the twin's air: another spectrum or intensity would show here."""
    model, theta = fitted_model(axis), true_vector(axis, 1.0)
    outputs = len(model.outputs)
    square, lagged = np.zeros(outputs), np.zeros(outputs)
    flights = fly(axis, 1.0, range(6), with_pilot=True)
    for maneuver in flights:
        point = FilterProblem(model, [maneuver], PROCESS[axis]).evaluate(theta)
        assert point is not None
        white = linalg.solve_triangular(
            np.linalg.cholesky(point.filters[0].S), point.e[0].T, lower=True
        )
        white = white[:, 50:]  # the filter starts without knowing the gust
        square += np.mean(white**2, axis=1) / len(flights)
        lagged += np.mean(white[:, 1:] * white[:, :-1], axis=1) / len(flights)
    samples = 950 * len(flights)
    assert np.all(np.abs(square - 1.0) < 4.0 * np.sqrt(2.0 / samples))
    assert np.all(np.abs(lagged) < 4.0 / np.sqrt(samples))


def test_information_is_minus_the_mean_curvature() -> None:
    axis = "lateral"
    model, theta = fitted_model(axis), true_vector(axis, 1.0)
    k = [p.name for p in model.parameters].index("Cl_p")
    step = np.zeros(len(theta))
    step[k] = 1e-3
    expected = curvature = 0.0
    for maneuver in fly(axis, 1.0, range(8), with_pilot=False):
        problem = FilterProblem(model, [maneuver], PROCESS[axis])
        costs = [p.cost for s in (1.0, 0.0, -1.0) if (p := problem.evaluate(theta + s * step))]
        curvature += (costs[0] - 2.0 * costs[1] + costs[2]) / 1e-6
        expected += information_at(model, [maneuver], PROCESS[axis], theta)[k, k]
    assert curvature == pytest.approx(expected, rel=0.1)


def test_filter_error_knows_the_air_and_output_error_does_not() -> None:
    case = run_case(1.0, 6, pilot=True)
    assert case.failed == 0
    assert case.close.all()
    assert case.unbiased.all()
    assert case.filter_covered >= 0.8
    assert case.output_covered < case.filter_covered
    assert np.all(case.filter_rms < 0.5 * case.output_rms)
