"""Moments that a lag of surfaces behind their columns moves are not relied on."""

from __future__ import annotations

import numpy as np
import pytest
from host.sysid.answer import CAREFUL, TRUSTED
from host.sysid.coefficients import CoefficientAnswer
from studies.foreign.flight import fly
from studies.foreign.instrument import Columns
from studies.independent import cells, identified

from tests.host.sysid.verdicts import verdict_of

LAG_S, AHEAD_S = 0.05, -0.01
AIR = cells()["calm"]


@pytest.fixture(scope="module")
def measured() -> Columns:
    """A calm flight as ideal sensors see it."""
    return fly(AIR, 40)[0]


def coefficients(measured: Columns, lag_s: float) -> CoefficientAnswer:
    """Return the answer to columns of surfaces that stand behind them by a lag."""

    def commanded(columns: Columns) -> Columns:
        surfaces = ("elevator_rad", "aileron_rad", "rudder_rad")
        told = {n: columns[n] + lag_s * np.gradient(columns[n], columns["t_s"]) for n in surfaces}
        return columns | told

    found = identified(measured, AIR, 40, ("coefficients",), commanded).coefficients
    assert found is not None
    return found


def test_surfaces_that_lag_leave_no_moment_relied_on(measured: Columns) -> None:
    # Cm_alpha 42, Cm_de 52, Cl_p 55 % off, known to 4, stood under "trust".
    answer = coefficients(measured, LAG_S)
    moved = {"Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da"}
    assert answer.lagging == ("Cl", "Cm", "Cn")
    marks = verdict_of(answer).marks
    assert not {n for n in moved if marks[n] in (TRUSTED, CAREFUL)}


@pytest.mark.parametrize("lag_s", [0.0, AHEAD_S])
def test_surfaces_that_are_no_later_than_their_columns_say_nothing(
    measured: Columns, lag_s: float
) -> None:
    """The demonstration's aileron seems 5 ms early, known to 1.7: all of its Cl was doubted."""
    assert coefficients(measured, lag_s).lagging == ()
