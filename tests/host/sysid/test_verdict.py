"""The verdict: every parameter is under one heading, and none on a bound is trusted."""

from dataclasses import replace

import numpy as np
import pytest
from host.sysid.aircraft.airframe import Condition
from host.sysid.answer.verdict import words
from host.sysid.estimators.fit import fit
from host.sysid.flight.linear import Answer
from host.sysid.models.diagnostics import collinearity
from host.sysid.models.templates import Trim
from host.sysid.study.aircraft import navion_structured
from host.sysid.study.data import noisy


@pytest.fixture(scope="module")
def answer() -> Answer:
    model, record = navion_structured(), noisy(3, 0.05, duration_s=10.0)
    result = fit("equation-error", model, [record])
    return Answer(
        template="own", method="equation-error", model=model, trim=Trim(50.0, 0.0, 0.0),
        condition=Condition(50.0, 1500.0), maneuvers=(record,), used=(), held_out=(),
        result=result, fits=(), validation=(), refused=(), together=collinearity(result),
        modes=(), coefficients=(), still=(), delays={},
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
    lines = words([replace(answer, result=result)], [])
    headed = {line.split(":  ")[0].strip(): line.split(":  ")[-1] for line in lines}
    assert names[0] in headed["trust (within 10 %)"].split(", ")
    assert headed["use with care (10 to 30 %)"] == names[1]
    assert headed["do not rely on (above 30 %)"] == f"{names[2]} (50 %), {names[3]} (300 %)"
    assert names[4] not in "".join(lines)


def test_collinear_data_without_a_pair_are_no_empty_brackets(answer: Answer) -> None:
    severe = replace(answer.together, condition=1e9, pairs=())
    assert "  the data are close to collinear" in words([replace(answer, together=severe)], [])
