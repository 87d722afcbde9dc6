"""Do linear models and coefficients fitted directly say the same of a coefficient?

Both come from the same flights by other equations. Beyond their joint interval one of them is
wrong, and nothing says which: neither stands under "trust" or "use with care" then. Only what both
would have let a reader use is compared; what one of them doubts already is no judge.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from host.sysid.answer.doubt import Doubt
from host.sysid.answer.marks import CAREFUL, TRUSTED

if TYPE_CHECKING:
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.linear.linear_answer import Answer

DIMENSIONAL = {"CL": "Z", "CD": "D", "CY": "Y", "Cl": "L", "Cm": "M", "Cn": "N"}
RELIED_ON = (TRUSTED, CAREFUL)


def derivative_of(coefficient: str) -> str:
    """Return the dimensional derivative that a coefficient stands in: ``M_q`` of ``Cm_q``."""
    row, _, by = coefficient.partition("_")
    return f"{DIMENSIONAL.get(row, row)}_{by}"


def disagreements_of_models(
    linear: Answer,
    direct: CoefficientAnswer,
    marks: Mapping[str, str],
    direct_marks: Mapping[str, str],
) -> tuple[list[Doubt], list[Doubt]]:
    """Return the doubts about the linear answer's derivatives, and about the coefficients.

    Parameters
    ----------
    linear : Answer
    direct : CoefficientAnswer
    marks, direct_marks : mapping
        Of both, each for itself.
    """
    theirs = {c.name: c for table in direct.tables for c in table.coefficients}
    about: tuple[list[Doubt], list[Doubt]] = ([], [])
    for own in linear.coefficients:
        name, other = derivative_of(own.name), theirs.get(own.name)
        if other is None or marks.get(name) not in RELIED_ON:
            continue
        if direct_marks.get(own.name) not in RELIED_ON:
            continue
        joint = float(np.hypot(own.half_width, other.half_width))
        if abs(own.value - other.value) <= joint:
            continue
        says = f"{own.name} {own.value:.3g}, coefficients fitted directly {other.value:.3g}"
        reason = f"models disagree: {linear.template} says {says}, beyond {joint:.2g} of both"
        about[0].append(Doubt((name,), reason))
        about[1].append(Doubt((own.name,), reason))
    return about
