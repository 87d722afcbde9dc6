"""Two models that contradict each other do not both stand under trust."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from host.sysid.aerodynamics import Coefficient
from host.sysid.answer import CAREFUL, TRUSTED
from host.sysid.answer.marks import UNSURE
from host.sysid.answer.model_agreement import derivative_of, disagreements_of_models


def both(
    linear: tuple[float, float], direct: tuple[float, float], marks: tuple[str, str]
) -> tuple[list[Any], list[Any]]:
    """Compare Cm_q, value and half-width, of a linear answer and of coefficients."""
    own, theirs = (Coefficient("Cm_q", value, 0.0, half) for value, half in (linear, direct))
    return disagreements_of_models(
        SimpleNamespace(coefficients=(own,), template="longitudinal"),  # type: ignore[arg-type]
        SimpleNamespace(tables=[SimpleNamespace(coefficients=(theirs,))]),  # type: ignore[arg-type]
        {"M_q": marks[0]},
        {"Cm_q": marks[1]},
    )


def test_beyond_the_joint_interval_both_are_doubted_and_both_values_said() -> None:
    about_linear, about_direct = both((-11.0, 0.9), (-9.5, 0.5), (TRUSTED, CAREFUL))
    assert [d.names for d in (*about_linear, *about_direct)] == [("M_q",), ("Cm_q",)]
    assert "longitudinal says Cm_q -11, coefficients fitted directly -9.5" in about_linear[0].reason


@pytest.mark.parametrize(
    ("linear", "direct", "marks"),
    [
        ((-11.0, 0.9), (-10.0, 0.5), (TRUSTED, TRUSTED)),  # 1.0 apart, 1.03 allowed
        ((-11.0, 0.9), (-9.5, 0.5), (UNSURE, TRUSTED)),
        ((-11.0, 0.9), (-9.5, 0.5), (TRUSTED, UNSURE)),
    ],
)
def test_what_agrees_or_is_doubted_already_doubts_nothing(
    linear: tuple[float, float], direct: tuple[float, float], marks: tuple[str, str]
) -> None:
    assert both(linear, direct, marks) == ([], [])


def test_each_coefficient_stands_in_one_derivative() -> None:
    names = [derivative_of(n) for n in ("CL_alpha", "CD_de", "CY_beta", "Cl_p", "Cm_q", "Cn_dr")]
    assert names == ["Z_alpha", "D_de", "Y_beta", "L_p", "M_q", "N_dr"]
