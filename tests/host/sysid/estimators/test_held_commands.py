"""Commands that are held from sample to sample and late by a part of one: they jump between."""

from __future__ import annotations

import numpy as np
import pytest
from host.arrays import Array
from host.sysid.estimators import fit
from host.sysid.models import Maneuver, NonlinearModel, equations_from
from host.sysid.numerics import EquationFilterProblem, NonlinearProblem
from scipy import linalg

from tests.host.sysid.held import assert_held

pytestmark = pytest.mark.usefixtures("interpreted")

DT_S, SAMPLES = 0.05, 60
L_P, L_DA, W_RADPS = -5.0, 40.0, 20.0
FINE = 50  # parts of a sample of which a delay is a multiple


def model() -> NonlinearModel:
    return equations_from(
        {
            "inputs": ["aileron_rad"],
            "hold": "zoh",
            "rates": {
                "p_radps": "L_p*p_radps + L_da*servo_rad",
                "servo_rad": "w_radps*(aileron_rad - servo_rad)",
            },
            "outputs": {"p_radps": "p_radps"},
            "parameters": {"L_p": -4.0, "L_da": 30.0, "w_radps": 12.0},
            "starts": {"servo_rad": "aileron_rad"},
            "delays": [
                {"name": "late_s", "outputs": ["aileron_rad"], "prior_sd_s": 0.1, "limit_s": 0.2}
            ],
        }
    )


def flown(late_s: float, noise: float = 0.0) -> Maneuver:
    """Return a record: exponentials of matrices from one multiple of the delay to the next."""
    u = 0.1 * np.sign(np.sin(2.5 * np.arange(SAMPLES) * DT_S))
    u[:6], u[-3:] = 0.0, u[-4]
    h, late = DT_S / FINE, round(late_s / DT_S * FINE)
    A = np.array([[L_P, L_DA, 0.0], [0.0, -W_RADPS, W_RADPS], [0.0, 0.0, 0.0]])
    ahead = linalg.expm(h * A)[:2]
    x, p = np.zeros(2), np.zeros(SAMPLES)
    for k in range(SAMPLES * FINE):
        if k % FINE == 0:
            p[k // FINE] = x[0]
        row = min(max((k - late) // FINE, 0), SAMPLES - 1)
        x = ahead @ np.append(x, u[row])
    p += noise * np.random.default_rng(5).standard_normal(SAMPLES)
    return Maneuver(DT_S, u[:, None], p[:, None])


def at_truth(problem: NonlinearProblem, late_s: float) -> Array:
    theta = np.zeros(len(problem.names))
    theta[:4] = L_P, L_DA, W_RADPS, late_s
    return theta


@pytest.mark.parametrize("late_s", [-0.02, 0.0, 0.015, 0.034, 0.05, 0.085])
def test_the_motion_is_exact_and_so_is_its_slope_by_the_delay(late_s: float) -> None:
    data = flown(late_s)
    problem = NonlinearProblem(model(), [data])
    theta = at_truth(problem, late_s)
    found = problem.respond(theta)
    assert found is not None
    np.testing.assert_allclose(found[0].y[0], data.outputs[:, 0], atol=1e-5)
    # At a whole sample the slope is that of a later jump.
    step_s = 1e-5
    late, early = theta.copy(), theta.copy()
    late[3] += step_s
    early[3] -= 0.0 if late_s in (0.0, 0.05) else step_s
    ahead, before = problem.outputs(late), problem.outputs(early)
    assert ahead is not None and before is not None
    slope = (ahead[0][0] - before[0][0]) / (late[3] - early[3])
    np.testing.assert_allclose(
        found[0].sensitivities[0, :, 3], slope, atol=2e-3 * np.max(np.abs(slope))
    )


@pytest.mark.parametrize("method", ["output-error-white", "extended-kalman"])
def test_a_part_of_a_sample_is_found(method: str) -> None:
    """Spread over the sample, 34 ms were 36.7 +- 1.0 and the servo 9 % too fast, known to 3.5."""
    result = fit(method, model(), [flown(0.034, noise=0.001)])
    truth = {"L_p": L_P, "L_da": L_DA, "w_radps": W_RADPS, "late_s": 0.034}
    assert_held(result, truth)
    assert {name: result.value(name) for name in truth} == pytest.approx(truth, rel=0.01)


def test_the_likelihood_of_the_filter_is_best_at_the_part_of_a_sample() -> None:
    problem = EquationFilterProblem(model(), [flown(0.035, noise=0.002)], ("p_radps",))
    cost = {}
    for late_s in (0.03, 0.033, 0.035, 0.037, 0.04):
        theta = np.zeros(len(problem.names))
        theta[:4] = L_P, L_DA, W_RADPS, late_s
        theta[-2:] = np.log(1e-4), np.log(0.002)
        point = problem.evaluate(theta)
        assert point is not None
        cost[late_s] = point.cost
    assert min(cost, key=lambda at: cost[at]) == 0.035
