"""An answer beside the truth: what is averaged, what an error is relative to, what is outside."""

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from host.sysid.aerodynamics import Coefficient, CoefficientTable
from host.sysid.answer.truth_comparison import (
    as_flown,
    compared_coefficients,
    mode_comparisons,
    mode_truth_lines,
    true_derivatives,
    truth_lines,
    truth_summary,
)
from host.sysid.linear import Answer
from host.sysid.models.modal_analysis import mode_of

DOCUMENT = {
    "maneuver": [
        {"axes": ["elevator"], "derivatives": {"CL_alpha": 4.0, "CD_de": 0.0},
         "modes": {"short_period": [10.0, 0.5], "phugoid": [0.7, 0.1], "spiral": [9.0, 1.0]}},
        {"axes": ["elevator"], "derivatives": {"CL_alpha": 4.4, "CD_de": 0.0},
         "modes": {"short_period": [12.0, 0.7], "spiral": [9.0, 1.0]}},
        {"axes": ["aileron"], "derivatives": {"CL_alpha": 99.0, "Cl_p": -0.4},
         "modes": {"roll": [20.0, 1.0], "spiral": [0.1, -1.0], "short_period": [99.0, 0.1]}},
    ]
}  # fmt: skip


def table(**values: tuple[float, float]) -> CoefficientTable:
    found = tuple(Coefficient(n, v, h / 2, h) for n, (v, h) in values.items())
    return CoefficientTable("longitudinal", "by hand", 0.1, found)


def test_truth_is_the_mean_of_the_maneuvers_of_the_axis() -> None:
    (lift,) = compared_coefficients(table(CL_alpha=(4.41, 0.2)), DOCUMENT, {})
    assert lift.truth == pytest.approx(4.2)
    assert lift.error == pytest.approx(0.05)
    assert not lift.covered


def test_a_coefficient_next_to_nothing_is_not_judged_by_its_size() -> None:
    (drag,) = compared_coefficients(table(CD_de=(0.01, 0.02)), DOCUMENT, {})
    assert math.isnan(drag.error)
    (drag,) = compared_coefficients(table(CD_de=(0.01, 0.02)), DOCUMENT, {"CD_de": 0.04})
    assert drag.error == pytest.approx(0.25)
    lines = truth_lines([drag])
    assert "+25.0 % of what would be 5 % of its equation  inside" in lines[1]
    assert lines[-1].strip() == "1 of 1 intervals hold the truth"


def test_modes_are_compared_with_those_of_their_axis() -> None:
    spread = np.diag([0.01, 0.01])
    modes = (
        mode_of("short period", complex(-6.0, 9.0), spread),
        mode_of("phugoid", complex(-0.1, 0.7), spread),  # not in every maneuver's truth
        mode_of("roll", complex(-21.0, 0.0), spread),
        mode_of("spiral", complex(0.12, 0.0), spread),
    )
    found = mode_comparisons(modes, DOCUMENT, ("longitudinal", "lateral"))
    names = {c.name: c for c in found}
    assert list(names) == ["short period", "short period, damping", "roll", "spiral"]
    assert names["short period"].truth == pytest.approx(11.0)
    assert names["roll"].truth == pytest.approx(-20.0)
    assert names["spiral"].truth == pytest.approx(0.1)
    assert (names["spiral"].covered, names["roll"].covered) == (True, False)
    held = sum(c.covered for c in found)
    assert (
        mode_truth_lines(found)[-1].strip() == f"{held} of 4 intervals of the modes hold the truth"
    )
    (line, *_) = truth_summary("lateral", found[2:])
    assert line.startswith("  lateral: 1 of 2 intervals hold the truth; outside: roll -21 +- 0.2,")


def test_the_truth_is_that_of_the_maneuvers_of_the_fit() -> None:
    """A doublet that was held out flew 0.7 m/s slower: M_alpha 8 % less.

    Older files count from power-on, and say when the log's first row came.
    """
    document: dict[str, Any] = {
        "first_row_s": 3.5,
        "maneuver": [
            {"axes": ["elevator"], "start_s": 12.0, "input_end_s": 13.9, "end_s": 16.9,
             "dimensional": {"M_alpha": -288.0}},
            {"axes": ["elevator"], "start_s": 26.5, "input_end_s": 27.1, "end_s": 30.1,
             "dimensional": {"M_alpha": -264.0}},
        ],
    }  # fmt: skip
    used = SimpleNamespace(start_s=8.6, end_s=13.3)
    answer = cast(Answer, SimpleNamespace(used=(used,)))
    fitted = as_flown(document, answer)
    assert true_derivatives(fitted, "longitudinal") == {"M_alpha": -288.0}
    later = [
        m | {n: m[n] - 3.5 for n in ("start_s", "input_end_s", "end_s")}
        for m in document["maneuver"]
    ]
    newer = as_flown({"power_on_s": -3.5, "maneuver": later}, answer)
    assert true_derivatives(newer, "longitudinal") == {"M_alpha": -288.0}
    several = {"maneuver": document["maneuver"]}
    assert true_derivatives(as_flown(several, answer), "longitudinal") == {"M_alpha": -276.0}
