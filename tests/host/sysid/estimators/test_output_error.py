"""Output error: the optimum of an independent solver, the bound, invariances, refusals."""

import dataclasses

import numpy as np
import pytest
from host.errors import IdentificationError
from host.sysid import Maneuver, Parameter, fit
from host.sysid.estimators import fit_output_error
from host.sysid.estimators.start_values import start_values
from host.sysid.numerics import OutputProblem, covariance_of_free, minimise
from studies.data import TRUTH, clean, noisy
from studies.navion import navion_structured


def test_errors_reach_the_bound_and_a_wrong_bound_shows() -> None:
    model = navion_structured()
    ratios = []
    for seed in range(120):
        problem = OutputProblem(model, [noisy(1000 + seed)])
        found = minimise(problem, start_values(problem))
        bound = np.sqrt(np.diag(covariance_of_free(found.information, found.free, problem.names)))
        ratios.append((found.theta - np.concatenate([TRUTH, np.zeros(4)])) / bound)
    rms = np.sqrt(np.mean(np.square(ratios), axis=0))
    # 120 runs scatter by 1/sqrt(240) = 6.5 %; four of those for the worst of fourteen.
    assert np.all(np.abs(rms - 1.0) < 0.26)
    assert abs(rms.mean() - 1.0) < 0.06
    halved = 2.0 * rms  # the fault: a bound half as long
    assert not np.all(np.abs(halved - 1.0) < 0.26)


def test_a_bound_holds_and_says_so() -> None:
    model = navion_structured()
    limited = tuple(
        Parameter(p.name, p.start, lower=-2.0 if p.name == "M_q" else -np.inf)
        for p in model.parameters
    )
    result = fit("output-error", dataclasses.replace(model, parameters=limited), [noisy(31)])
    assert result.value("M_q") == -2.0
    assert result.standard_error[result.index("M_q")] == 0.0
    assert any("M_q" in w for w in result.warnings)


def test_an_unstable_aircraft_is_identified_and_a_wild_start_survives() -> None:
    u, _ = clean(0.02, 6.0)
    model = navion_structured()
    unstable = TRUTH.copy()
    unstable[5] = 2.0  # M_alpha: statically unstable
    problem = OutputProblem(model, [Maneuver(0.02, u, np.zeros((len(u), 4)))])
    response = problem.respond(np.concatenate([unstable, np.zeros(4)]))
    assert response is not None
    y = response[0].y.T
    rng = np.random.default_rng(9)
    noise = 0.01 * y.std(axis=0) * rng.standard_normal(y.shape)
    wild = model.with_start(TRUTH * 3.0 + 1.0)
    result = fit("output-error", wild, [Maneuver(0.02, u, y + noise)])
    assert result.converged
    assert result.value("M_alpha") == pytest.approx(2.0, abs=0.1)


def test_unidentifiable_pair_is_refused_as_singular() -> None:
    model = navion_structured()
    both = dataclasses.replace(model, state_biases=("q_radps",), output_biases=model.outputs)
    stuck = Maneuver(0.05, np.zeros((200, 1)), np.ones((200, 4)))
    with pytest.raises(IdentificationError, match=r"singular information|not act|told apart"):
        fit_output_error(both, [stuck])
    with pytest.raises(IdentificationError, match="never moved"):
        fit("output-error", both, [stuck])
