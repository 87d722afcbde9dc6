"""A filter of outputs that are measured at some samples only, against the dense Gaussian."""

from dataclasses import replace

import numpy as np
import pytest
from host.arrays import BoolArray
from host.sysid.models import LinearModel, Maneuver, Parameter, Term
from host.sysid.numerics import FilterProblem, InnovationLikelihood

DT_S, SAMPLES = 0.05, 40
PROCESS = ("gust_rad",)


def gusty_pitch() -> LinearModel:
    """Return two states of pitch and a gust, three outputs of which one reads the input too."""
    return LinearModel(
        name="pitch in gusts",
        states=("alpha_rad", "q_radps", "gust_rad"),
        inputs=("elevator_rad",),
        outputs=("alpha_rad", "q_radps", "az_mps2"),
        A=np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, -1.5]]),
        B=np.zeros((3, 1)),
        C=np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]),
        D=np.zeros((3, 1)),
        terms=(
            Term("A", 0, 0, "Z_alpha"),
            Term("A", 0, 2, "Z_alpha"),
            Term("A", 1, 0, "M_alpha"),
            Term("A", 1, 2, "M_alpha"),
            Term("A", 1, 1, "M_q"),
            Term("B", 1, 0, "M_de"),
            Term("C", 2, 0, "Z_alpha", 20.0),
            Term("C", 2, 2, "Z_alpha", 20.0),
        ),
        parameters=(
            Parameter("Z_alpha", -4.0),
            Parameter("M_alpha", -25.0),
            Parameter("M_q", -3.0),
            Parameter("M_de", -30.0),
        ),
        state_biases=("q_radps",),
        output_biases=("az_mps2",),
        initial_states=("alpha_rad", "q_radps"),
    )


def sampled(kind: str) -> BoolArray:
    """Return at which samples outputs were measured: each fifth of two of them, or any."""
    if kind == "all":
        return np.ones((SAMPLES, 3), bool)
    if kind == "at random":
        return np.random.default_rng(8).random((SAMPLES, 3)) > 0.6
    rows = np.arange(SAMPLES)
    return np.column_stack([rows % 5 == 2, np.ones(SAMPLES, bool), rows % 5 == 4])


def problem_of(kind: str, *, more: tuple[Maneuver, ...] = ()) -> tuple[FilterProblem, np.ndarray]:
    """Return a maneuver with missing outputs and unknowns away from any optimum."""
    rng = np.random.default_rng(5)
    inputs = 0.1 * np.sign(np.sin(0.7 * np.arange(SAMPLES)))[:, None]
    outputs = rng.standard_normal((SAMPLES, 3)) * [0.03, 0.2, 1.5]
    seen = sampled(kind)
    outputs[~seen] = 1e6  # whatever stands there is not looked at
    spoilt = Maneuver(DT_S, inputs, outputs, sampled=seen)
    problem = FilterProblem(gusty_pitch(), [spoilt, *more], PROCESS)
    theta = np.zeros(len(problem.output_problem.names))
    theta[:8] = [*gusty_pitch().start, 0.05, -0.2, 0.02, -0.1]
    return problem, np.concatenate([theta, np.log([0.08, 0.01, 0.03, 0.4])])


def known(point: InnovationLikelihood | None) -> InnovationLikelihood:
    """Return a point that must be there."""
    assert point is not None
    return point


def test_what_is_all_measured_is_the_steady_filter() -> None:
    problem, theta = problem_of("each fifth")
    whole = problem.maneuvers[0]
    rng = np.random.default_rng(6)
    whole = replace(whole, outputs=rng.standard_normal((SAMPLES, 3)), sampled=None)
    # One value that comes behind the last sample that counts.
    seen = np.ones((SAMPLES, 3), dtype=bool)
    seen[-1, 0] = False
    plain, late = (
        known(FilterProblem(problem.model, [m], PROCESS).evaluate(theta))
        for m in (whole, replace(whole, sampled=seen))
    )
    np.testing.assert_allclose(late.e[0][:-1], plain.e[0][:-1], rtol=1e-9, atol=1e-11)
    white = plain.whitened(0, plain.as_filtered(0))
    np.testing.assert_allclose(
        late.whitened(0, late.as_filtered(0))[:-1], white[:-1], rtol=1e-7, atol=1e-9
    )


def test_gradient_and_slopes_are_those_of_differences() -> None:
    whole = Maneuver(
        DT_S, np.ones((SAMPLES, 1)), np.random.default_rng(7).standard_normal((SAMPLES, 3))
    )
    problem, theta = problem_of("at random", more=(whole,))
    here = known(problem.evaluate(theta))
    information, gradient = problem.total(theta, *problem.scoring(theta, here))
    size = np.sqrt(np.diag(information))
    exact = problem.whitened_slopes(theta, here)[0]
    for k, name in enumerate(problem.names):
        width = np.zeros(len(theta))
        width[k] = 1e-4 / size[k]
        up, down = (known(problem.evaluate(theta + s * width)) for s in (1.0, -1.0))
        slope = (down.cost - up.cost) / (2.0 * width[k])
        assert gradient[k] / size[k] == pytest.approx(slope / size[k], abs=1e-4), name
        moved = (up.as_filtered(0) - down.as_filtered(0)) / (2.0 * width[k])
        np.testing.assert_allclose(
            exact[:, :, k] / size[k], here.whitened(0, moved) / size[k], atol=1e-6, err_msg=name
        )
