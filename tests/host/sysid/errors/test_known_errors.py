"""What an instrument's file leaves open is in the intervals, and accuses no right model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from host.instrument.deviations import unknown_sensors
from host.instrument.instrument_errors import instrument_errors
from host.physical.calibration import load_calibration
from host.physical.recording import FOREIGN, Recording
from host.sysid.answer import TRUSTED
from host.sysid.errors import systematic_residuals
from host.sysid.linear import Answer
from host.sysid.models import Maneuver, Trim, template
from host.sysid.numerics import OutputProblem
from host.sysid.reconstruction.reconstruction import by_calibration_alone
from studies.foreign.flight import Air
from studies.foreign.instrument import SENSORS_FILE
from studies.independent import NAMES, answer_with_file
from studies.wrong_flights import TRUTH

from tests.host.sysid.recorded import linear_flight

SEED = 24310


# The aircraft is not linear: in pitch that may be said.
@pytest.mark.parametrize(("axis", "may_be_said"), [("longitudinal", True), ("lateral", False)])
def test_a_right_flight_in_calm_air_stays_under_trust(axis: str, may_be_said: bool) -> None:
    """Three of six lateral flights had lost N_beta, five were accused."""
    identified = answer_with_file(Air(), SEED, axis)
    [(answer, verdict)] = [
        (a, v)
        for a, v in zip(identified.answers, identified.verdicts, strict=True)
        if isinstance(a, Answer) and a.template == axis
    ]
    assert answer.coherence is not None
    assert may_be_said or not answer.coherence.coherent
    marks = verdict.marks
    assert [name for name in NAMES[axis] if marks[name] != TRUSTED] == []


def test_a_deviation_of_a_scale_is_a_share_of_what_was_simulated() -> None:
    """A share of the measured output would be found by the noise that it has of it."""
    flight = linear_flight("short-period", "none", "white", 3)
    trim = Trim(17.0, 0.06, 0.06)
    model = template("short-period", trim)
    names = model.outputs
    rows = slice(0, 300)
    cut = {k: v[rows] for k, v in flight.columns.items()}
    u, y = (np.column_stack([cut[c] for c in of]) for of in (model.inputs, names))
    problem = OutputProblem(model, [Maneuver(0.02, u, y)])
    theta = problem.first_guess()
    theta[: problem.n_common] = [TRUTH["short-period"][p.name] for p in model.parameters]
    told = instrument_errors(None, load_calibration(SENSORS_FILE), maker=FOREIGN)
    sensors = replace(unknown_sensors(Recording(maker=FOREIGN)), errors=told)
    [found] = systematic_residuals(problem, theta, [cut], [by_calibration_alone(sensors)], trim)
    assert found.shape[:2] == (len(names), 300)
    simulated = problem.outputs(theta)
    assert simulated is not None
    alpha = simulated[0][names.index("alpha_rad")]
    columns = found[names.index("alpha_rad")]
    largest = columns[:, np.argmax(np.std(columns, axis=0))]  # scale of the vane, 1 %
    share = np.std(largest - largest.mean()) / np.std(alpha)
    assert 0.005 < share < 0.02
    assert abs(np.corrcoef(largest, alpha)[0, 1]) > 1.0 - 1e-6
