"""Coefficients of surfaces that lag behind their columns are not relied on."""

from __future__ import annotations

import numpy as np
import pytest
from host.sysid.answer.coefficient_rules import lag_beside
from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
from studies.foreign.aeroplane import TRAINER
from studies.foreign.flight import fly
from studies.foreign.instrument import Columns
from studies.independent import cells, identified

LAG_S = 0.05
AIR = cells()["calm"]


@pytest.fixture(scope="module")
def measured() -> Columns:
    """A calm flight as ideal sensors see it."""
    return fly(AIR, 40)[0]


def commanded(columns: Columns) -> Columns:
    """Return columns with what the servos were told in place of where surfaces were."""
    surfaces = ("elevator_rad", "aileron_rad", "rudder_rad")
    ahead = {n: columns[n] + LAG_S * np.gradient(columns[n], columns["t_s"]) for n in surfaces}
    return columns | ahead


def coefficients(measured: Columns, *, lagging: bool) -> CoefficientAnswer:
    spoil = commanded if lagging else dict
    found = identified(measured, AIR, 40, ("coefficients",), spoil).coefficients
    assert found is not None
    return found


def test_surfaces_that_lag_behind_their_columns_leave_no_moment_relied_on(
    measured: Columns,
) -> None:
    # Cm_alpha 42, Cm_de 52, Cl_p 55 % off, known to 4, stood under "trust".
    answer = coefficients(measured, lagging=True)
    doubted = {name for one in lag_beside(answer, {}) for name in one.names}
    off = {
        d.name
        for d in answer.fit.derivatives
        if d.name.startswith(("Cl_", "Cm_", "Cn_"))
        and abs(d.value - getattr(TRAINER, d.name, d.value)) > 3.0 * d.half_width
    }
    assert {"Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da"} <= off <= doubted


def test_surfaces_where_their_columns_are_say_nothing(measured: Columns) -> None:
    assert lag_beside(coefficients(measured, lagging=False), {}) == []
