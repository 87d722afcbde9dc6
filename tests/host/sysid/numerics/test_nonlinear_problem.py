"""Equations between samples: steps short enough wherever a search ends."""

from __future__ import annotations

import numpy as np
import pytest
from host.sysid.estimators import fit_output_error
from host.sysid.models import LinearModel, Maneuver, Parameter, Term, equations_from
from host.sysid.numerics import NonlinearProblem, OutputProblem
from scipy import signal

pytestmark = pytest.mark.usefixtures("interpreted")

DT_S = 0.04
TRUTH = {"bandwidth": 40.0, "M_q": -2.0, "M_de": -25.0}


def test_a_model_that_is_stiffer_than_at_its_start_is_stepped_finer() -> None:
    """A servo ten times as fast as first guessed; the record is exact."""
    model = equations_from(
        {
            "inputs": ["elevator_rad"],
            "rates": {
                "servo": "bandwidth*(elevator_rad - servo)",
                "q_radps": "M_q*q_radps + M_de*servo",
            },
            "outputs": {"q_radps": "q_radps"},
            "parameters": {"bandwidth": 4.0, "M_q": -1.0, "M_de": -10.0},
        }
    )
    a, m_q, m_de = TRUTH.values()
    system = ([[-a, 0.0], [m_de, m_q]], [[a], [0.0]], [[0.0, 1.0]], [[0.0]])
    t = np.arange(80) * DT_S
    u = 0.1 * np.sin(3.0 * t) + 0.1 * np.sin(11.0 * t + 1.0)
    _, q, _ = signal.lsim(system, u, t, X0=[u[0], 0.2])  # lines between samples, exactly
    result = fit_output_error(model, [Maneuver(DT_S, u[:, None], q[:, None])], coloured_noise=False)
    for name, value in TRUTH.items():
        k = result.index(name)
        assert abs(result.estimate[k] - value) < 0.1 * result.half_width()[k], name
    problem = NonlinearProblem(model, [Maneuver(DT_S, u[:, None], q[:, None])])
    problem.choose_step(problem.first_guess())
    assert problem.refine_step(result.estimate)
    assert not problem.refine_step(result.estimate)


@pytest.mark.parametrize("hold", ["foh", "zoh"])
def test_constant_matrices_are_a_case_of_equations(hold: str) -> None:
    """Outputs and slopes of random models by either, to rounding and Runge-Kutta's error."""
    rng = np.random.default_rng(7)
    for _ in range(2):
        A = rng.standard_normal((2, 2)) - 2.0 * np.eye(2)
        B, c = rng.standard_normal((2, 1)), float(rng.standard_normal())
        values = {f"a{i}{j}": float(A[i, j]) for i in range(2) for j in range(2)}
        values |= {"b0": float(B[0, 0]), "b1": float(B[1, 0]), "c": c}
        own = {"state_biases": ["x"], "output_biases": ["v"]}
        equations = equations_from(
            {
                "inputs": ["u"],
                "hold": hold,
                "rates": {"x": "a00*x + a01*z + b0*u", "z": "a10*x + a11*z + b1*u"},
                "outputs": {"x": "x", "v": "c*z + 0.5*u"},
                "parameters": values,
                **own,
            }
        )
        linear = LinearModel(
            "constant", ("x", "z"), ("u",), ("x", "v"),
            np.zeros((2, 2)), np.zeros((2, 1)), np.array([[1.0, 0.0], [0.0, 0.0]]),
            np.array([[0.0], [0.5]]),
            terms=(
                *(Term("A", i, j, f"a{i}{j}") for i in range(2) for j in range(2)),
                *(Term("B", i, 0, f"b{i}") for i in range(2)),
                Term("C", 1, 1, "c"),
            ),
            parameters=tuple(Parameter(name, start) for name, start in values.items()),
            state_biases=("x",), output_biases=("v",), initial_states=("x", "z"), hold=hold,
        )  # fmt: skip
        u = rng.standard_normal((30, 1))
        record = [Maneuver(DT_S, u, np.zeros((30, 2)))]
        by_steps, by_matrices = NonlinearProblem(equations, record), OutputProblem(linear, record)
        assert by_steps.names == by_matrices.names
        theta = np.concatenate([[*values.values()], 0.3 * rng.standard_normal(4)])
        by_steps.choose_step(theta)
        by_steps.substeps = 32
        [stepped], [exact] = by_steps.respond(theta) or [], by_matrices.respond(theta) or []
        assert stepped.y == pytest.approx(exact.y, abs=1e-10)
        assert stepped.sensitivities == pytest.approx(exact.sensitivities, abs=1e-10)
