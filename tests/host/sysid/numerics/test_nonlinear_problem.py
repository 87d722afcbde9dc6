"""Equations between samples: steps short enough wherever a search ends."""

from __future__ import annotations

import numpy as np
import pytest
from host.sysid.estimators import fit_output_error
from host.sysid.models import Maneuver, equations_from
from host.sysid.numerics import NonlinearProblem
from scipy import signal

DT_S = 0.04
TRUTH = {"bandwidth": 40.0, "M_q": -2.0, "M_de": -25.0}


@pytest.fixture(autouse=True)
def interpreted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run the equations as Python: that takes no compiler's time."""
    monkeypatch.setattr("host.compiled.has_compiler", lambda: False)


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
