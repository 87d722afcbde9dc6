"""The search alone: a bent valley, a model that fails on the way, bounds, flat directions."""

from dataclasses import dataclass

import numpy as np
import pytest
from host.arrays import Array, BoolArray
from host.errors import IdentificationError
from host.sysid.numerics.gauss_newton import Objective, free_of_bounds, gauss_newton
from scipy import optimize


@dataclass
class Residuals:
    """Residuals of a trial, and half their squares."""

    values: Array
    cost: float


class Valley(Objective[Residuals]):
    """Rosenbrock's valley as residuals, failing or bounded where a test says so."""

    def __init__(self, *, fails_above: float = np.inf, lower: float = -np.inf) -> None:
        self.fails_above, self.lower = fails_above, np.array([lower, -np.inf])
        self.released = 0

    def evaluate(self, theta: Array) -> Residuals | None:
        if theta[1] > self.fails_above:
            return None
        values = np.array([10.0 * (theta[1] - theta[0] ** 2), 1.0 - theta[0]])
        return Residuals(values, 0.5 * float(values @ values))

    def normal(self, theta: Array, trial: Residuals) -> tuple[Array, Array]:
        J = np.array([[-20.0 * theta[0], 10.0], [-1.0, 0.0]])
        return J.T @ J, -(J.T @ trial.values)

    def free(self, theta: Array, gradient: Array) -> BoolArray:
        return free_of_bounds(theta, gradient, self.lower, np.full(2, np.inf))

    def apply_step(self, theta: Array, step: Array) -> Array:
        return np.asarray(np.maximum(theta + step, self.lower))

    def release(self, trial: Residuals) -> None:
        self.released += 1


def test_it_walks_a_bent_valley_to_its_end() -> None:
    found = gauss_newton(Valley(), np.array([-1.2, 1.0]), max_iterations=60)
    assert found is not None
    assert found.converged
    # Ends when a step is below a hundredth of a bound, and the bounds are 1 and 2.
    np.testing.assert_allclose(found.theta, [1.0, 1.0], atol=1e-3)


def test_every_trial_but_the_last_is_given_back() -> None:
    valley = Valley()
    found = gauss_newton(valley, np.array([-1.2, 1.0]), max_iterations=60)
    assert found is not None
    assert valley.released >= found.iterations


def test_steps_into_a_failing_model_are_shortened() -> None:
    # Undamped, the first step from here goes to theta[1] = -3.8, and the second beyond 1.5.
    found = gauss_newton(Valley(fails_above=1.1), np.array([-1.2, 1.0]), max_iterations=100)
    assert found is not None
    assert found.converged
    np.testing.assert_allclose(found.theta, [1.0, 1.0], atol=1e-3)


def test_a_bound_holds_and_says_so() -> None:
    lower = 1.5
    found = gauss_newton(Valley(lower=lower), np.array([3.0, 1.0]), max_iterations=60)
    assert found is not None

    def residuals(x: Array) -> Array:
        return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])

    reference = optimize.least_squares(
        residuals,
        [3.0, 1.0],
        bounds=([lower, -np.inf], [np.inf, np.inf]),
    )
    np.testing.assert_allclose(found.theta, reference.x, atol=1e-3)
    assert not found.free[0]
    assert found.free[1]


def test_nothing_is_returned_where_the_start_fails() -> None:
    assert gauss_newton(Valley(fails_above=0.0), np.array([0.0, 1.0]), max_iterations=9) is None


def test_no_iteration_leaves_the_start_with_its_information() -> None:
    found = gauss_newton(Valley(), np.array([2.0, 2.0]), max_iterations=0)
    assert found is not None
    assert not found.converged
    assert found.theta.tolist() == [2.0, 2.0]
    assert found.information[1, 1] == pytest.approx(100.0)


def test_an_information_of_nan_is_refused() -> None:
    class Blind(Valley):
        def normal(self, theta: Array, trial: Residuals) -> tuple[Array, Array]:
            return np.full((2, 2), np.nan), np.ones(2)

    with pytest.raises(IdentificationError, match="not finite"):
        gauss_newton(Blind(), np.zeros(2), max_iterations=9)
