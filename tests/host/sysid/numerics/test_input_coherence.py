"""What inputs drive beside a model is told from noise of any colour, and false alarms are few."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from host.sysid.estimators import fit
from host.sysid.models import LinearModel, Maneuver, equations_from
from host.sysid.numerics import OutputProblem, autocovariance, minimise, output_problem
from host.sysid.numerics.input_coherence import (
    InputCoherence,
    block_means,
    input_coherence,
    input_regressors,
    lag_knots_s,
)
from scipy import signal
from studies.coverage import coloured_noise
from studies.inputs import multistep_3211
from studies.navion import navion_structured

DT_S, DURATION_S = 0.05, 20.0
COLOURS = {"white": [], "AR(1) 0.5": [0.5], "AR(1) 0.9": [0.9]}


def record(seed: int, colour: str, *, lag_s: float = 0.0, snr: float = 10.0) -> Maneuver:
    model = navion_structured()
    u = multistep_3211(0.05, DT_S, DURATION_S)
    pole = np.exp(-DT_S / lag_s) if lag_s else 0.0
    late = signal.lfilter([1.0 - pole], [1.0, -pole], u, axis=0)
    blank = OutputProblem(model, [Maneuver(DT_S, late, np.zeros((len(u), 4)))])
    response = blank.respond(np.concatenate([model.start, np.zeros(4)]))
    assert response is not None
    y = response[0].y.T
    deviation = np.sqrt(np.mean(y**2, axis=0) / snr)
    rng = np.random.default_rng([14, seed])
    noise = coloured_noise(rng, np.array(COLOURS[colour]), len(u), deviation)
    return Maneuver(DT_S, u, y + noise)


def coherence_of(maneuver: Maneuver, model: LinearModel | None = None) -> InputCoherence:
    model = model or navion_structured()
    problem = OutputProblem(model, [maneuver])
    found = minimise(problem, np.concatenate([model.start, np.zeros(4)]))
    return input_coherence(problem, found.responses, found.theta)


@pytest.mark.parametrize("colour", COLOURS)
def test_a_hidden_lag_is_seen_and_named(colour: str) -> None:
    found = [coherence_of(record(seed, colour, lag_s=0.5, snr=40.0)) for seed in range(5)]
    assert sum("q_radps" in one.coherent for one in found) >= 4
    named = {one.likely_error for one in found}
    assert colour == "AR(1) 0.9" or "a lag of elevator_rad" in named


@pytest.mark.parametrize(("lag_s", "seen"), [(0.0, False), (0.5, True)])
def test_an_error_that_is_known_elsewhere_accuses_no_model(lag_s: float, seen: bool) -> None:
    """A gyro 3 % off by its file: the inputs drive what it leaves, and no model lacks it."""
    maneuver = record(4, "white", lag_s=lag_s, snr=2000.0)
    wrong = maneuver.outputs * np.where(np.arange(4) == 2, 1.03, 1.0)
    problem = OutputProblem(navion_structured(), [replace(maneuver, outputs=wrong)])
    found = minimise(problem, np.concatenate([navion_structured().start, np.zeros(4)]))
    allowed = np.zeros((4, maneuver.samples, 1))
    allowed[2, :, 0] = 0.03 * found.responses[0].y[2]
    alone = input_coherence(problem, found.responses, found.theta)
    known = input_coherence(problem, found.responses, found.theta, nuisance=[allowed])
    assert alone.coherent
    assert bool(known.coherent) == seen
    assert known.information.shape == alone.information.shape
    assert known.shift.shape == alone.shift.shape


def test_the_noise_beside_the_inputs_is_that_of_a_right_model() -> None:
    """The lag's residual has a memory of its own; white noise beside it stays white."""
    right, wrong = (coherence_of(record(1, "white", lag_s=lag_s)) for lag_s in (0.0, 0.3))
    assert max(n.order for n in right.noise) <= 2
    assert np.all(wrong.innovation_variance < 2.0 * right.innovation_variance)


def test_a_sensor_slower_than_the_rows_keeps_its_noise() -> None:
    """Every fourth sample of q alone was measured, a line between: as noisy as the whole column."""
    full = record(1, "AR(1) 0.9")
    rows = np.arange(full.samples)
    seen = np.ones(full.outputs.shape, dtype=bool)
    q = navion_structured().outputs.index("q_radps")
    seen[:, q] = rows % 4 == 0
    y = full.outputs.copy()
    y[:, q] = np.interp(rows, rows[::4], y[::4, q])
    deviations = []
    for maneuver in (full, replace(full, outputs=y, sampled=seen)):
        problem = OutputProblem(navion_structured(), [maneuver])
        found = minimise(problem, np.concatenate([navion_structured().start, np.zeros(4)]))
        one = input_coherence(problem, found.responses, found.theta, block_s=0.2)
        memory = autocovariance(one.noise[q].coefficient, 1)[0]
        deviations.append(float(np.sqrt(one.innovation_variance[q] * memory)))
    assert 0.7 < deviations[1] / deviations[0] < 1.6


def test_output_error_widens_by_what_its_noise_had_explained() -> None:
    maneuver = record(2, "AR(1) 0.9", lag_s=0.5, snr=40.0)
    result = fit("output-error", navion_structured(), [maneuver])
    assert any("follows the inputs" in w for w in result.warnings)
    k, truth = result.index("M_de"), navion_structured().start[-1]
    noise = fit("output-error", navion_structured(), [maneuver], model_error=False)
    factor = result.standard_error[k] / noise.standard_error[k]
    assert factor > 1.5
    assert abs(result.estimate[k] - truth) > result.half_width()[k] / factor  # it was too narrow
    right = fit("output-error", navion_structured(), [record(3, "AR(1) 0.9", snr=40.0)])
    assert not any("follows the inputs" in w for w in right.warnings)


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize(("kind", "named"), [("columns", ()), ("inputs", ("p_radps",))])
def test_a_measured_column_is_no_input_of_a_pilot(kind: str, named: tuple[str, ...]) -> None:
    """Thrust follows the air that the output feels: no error of the model."""
    document: dict[str, Any] = {
        "kind": "equations",
        "inputs": ["aileron_rad"],
        "constants": {"none": 0.0},
        "rates": {"p_radps": "L_p*p_radps + L_da*aileron_rad + none*thrust_n"},
        "outputs": {"p_radps": "p_radps"},
        "parameters": {"L_p": -4.0, "L_da": 30.0},
    }
    document[kind] = [*document.get(kind, ()), "thrust_n"]
    rng = np.random.default_rng(5)
    aileron = multistep_3211(0.05, DT_S, DURATION_S)
    thrust = signal.lfilter([1.0], [1.0, -0.95], rng.standard_normal((len(aileron), 1)), axis=0)
    u = np.hstack([aileron, thrust])
    model = equations_from(document, "roll")
    theta = np.array([-4.0, 30.0, 0.0])
    clean = output_problem(model, [Maneuver(DT_S, u, np.zeros((len(u), 1)))]).outputs(theta)
    assert clean is not None
    measured = clean[0].T + 0.2 * thrust + 0.1 * rng.standard_normal((len(u), 1))
    problem = output_problem(model, [Maneuver(DT_S, u, measured)])
    responses = problem.respond(theta)
    assert responses is not None
    assert input_coherence(problem, responses, theta).coherent == named


def test_lags_reach_seconds_in_few_columns() -> None:
    knots_s = lag_knots_s(0.02, 20.0)
    assert knots_s[0] == 0.0
    assert knots_s[-1] == pytest.approx(3.2)
    assert lag_knots_s(0.02, 4.0)[-1] <= 1.0
    step = np.ones((200, 1))
    step[0] = 0.0
    columns = input_regressors(step, np.zeros((200, 0)), 0.02, knots_s)
    assert columns.shape == (200, len(knots_s))
    # The hats add up to one at every lag: together they are the sum of the input's past.
    assert np.allclose(columns.sum(axis=1), np.minimum(np.arange(200), 161))


def test_means_of_blocks_leave_the_rest_out() -> None:
    assert np.allclose(block_means(np.arange(7.0)[:, None], 3)[:, 0], [1.0, 4.0])
