"""The verdict: every parameter is under one heading, and none on a bound is trusted."""

from dataclasses import replace

import numpy as np
import pytest
from host.aircraft.mass_properties import Condition
from host.sysid.answer.estimate_lines import model_lines
from host.sysid.answer.linear_rules import unpredicted_states
from host.sysid.answer.marks import share_text
from host.sysid.estimators import fit
from host.sysid.linear import Answer
from host.sysid.models import Trim
from host.sysid.models.collinearity import collinearity
from host.sysid.models.diagnostics import SignalFit, reference_values
from host.sysid.models.modal_analysis import modes, modes_of
from host.sysid.models.templates import TEMPLATES
from studies.data import noisy
from studies.navion import navion_structured

from tests.host.sysid.verdicts import verdict_lines, verdict_of


@pytest.fixture(scope="module")
def answer() -> Answer:
    model, record = navion_structured(), noisy(3, 0.05, duration_s=10.0)
    result = fit("equation-error", model, [record])
    return Answer(
        template="own", method="equation-error", model=model, trim=Trim(50.0, 0.0, 0.0),
        condition=Condition(50.0, 1500.0), maneuvers=(record,), used=(), held_out=(),
        result=result, fits=(), validation=(), identifiability_flags=(), modes=(),
        collinearity=collinearity(result), coefficients=(), constant_inputs=(), delays={},
    )  # fmt: skip


def test_a_wide_interval_is_named_and_a_bound_is_not_trusted(answer: Answer) -> None:
    names = answer.model.parameter_names
    widths = np.array([0.05, 0.2, 0.5, 3.0, 0.0] + [0.05] * (len(names) - 5))
    wide = np.zeros(len(answer.result.names))
    wide[: len(names)] = widths * np.abs(answer.result.estimate[: len(names)]) / 1.96
    result = replace(
        answer.result,
        covariance=np.diag(wide**2),
        degrees_of_freedom=np.full(len(wide), np.inf),
    )
    lines = verdict_lines([replace(answer, result=result)], [])
    headed = {line.split(":  ")[0].strip(): line.split(":  ")[-1] for line in lines}
    assert names[0] in headed["good (within 10 %)"].split(", ")
    assert headed["fair (10 to 30 %)"] == names[1]
    assert headed["not known (interval above 30 %)"] == f"{names[2]} (50 %), {names[3]} (300 %)"
    on_bound = [line for line in lines if names[4] in line]
    assert on_bound == [f"  not known: {names[4]}: the estimate is on its bound"]


def test_collinear_data_without_a_pair_are_no_empty_brackets(answer: Answer) -> None:
    severe = replace(answer.collinearity, condition=1e9, pairs=())
    assert "  the data are close to collinear" in verdict_lines(
        [replace(answer, collinearity=severe)], []
    )


def test_a_mode_that_is_not_predicted_is_not_to_be_relied_on(answer: Answer) -> None:
    """An interval counts noise: of an equation that does not carry over it says nothing."""
    sure = replace(answer.result, covariance=1e-12 * np.eye(len(answer.result.names)))
    speed = answer.model.states[0]
    failing = SignalFit(speed, 0.0, 0.8, 0.5, 0.0, 0.0)
    lost = replace(answer, result=sure, validation=(failing,), modes=modes(sure))
    assert list(unpredicted_states(lost)) == [speed]
    shown = model_lines(lost, verdict_of(lost))
    marked = [line for line in shown if ", not: " in line]
    assert [line.split(":")[0].strip() for line in marked] == ["phugoid"]
    assert not any("no maneuver was left" in line for line in verdict_lines([lost], []))
    alone = verdict_lines([replace(lost, validation=())], [])
    assert any("no maneuver was left to predict" in line for line in alone)


def test_a_small_entry_is_not_called_trustworthy(answer: Answer) -> None:
    """Its interval is within 5 % of the row, not of its own size."""
    estimate = answer.result.estimate.copy()
    estimate[1] = 0.0
    floor = reference_values(answer.model, answer.maneuvers, estimate)[1]
    estimate[1] = 0.01 * floor
    half = np.full(len(estimate), 1e-9)
    half[1] = 0.1 * floor / 1.96
    result = replace(answer.result, estimate=estimate, covariance=np.diag(half**2))
    lines = verdict_lines([replace(answer, result=result)], [])
    little = next(line for line in lines if "  tiny (" in line)
    assert answer.model.parameter_names[1] in little.split(":  ")[1].split(", ")


def test_a_roll_model_has_no_spiral() -> None:
    model = TEMPLATES["roll"](Trim(17.0, 0.1, 0.1))
    A = np.array([[-20.0, 0.0], [1.0, 0.0]])
    found = modes_of(model, A, np.zeros((len(model.parameters),) * 2))
    assert [m.name for m in found] == ["roll", "bank"]


@pytest.mark.parametrize(
    ("share", "shown"),
    [(0.344, "34 %"), (0.098, "10 %"), (0.1004, "10.0 %"), (0.103, "10.3 %"), (0.304, "30.4 %"),
     (0.296, "30 %"), (12.0, "> 999 %")],
)  # fmt: skip
def test_verdict_and_table_round_a_share_alike(share: float, shown: str) -> None:
    """The verdict said 35 % of what the table beneath called 34 %."""
    assert share_text(share) == shown
