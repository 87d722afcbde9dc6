"""Linear flights of the study of wrong models are those of their equations."""

from __future__ import annotations

import numpy as np
import pytest
from host.sysid.models import Trim, template
from scipy import signal
from studies.wrong_flights import DT_S, MANEUVER_S, NOISE_SD, TRUTH, fly

PER = round(MANEUVER_S / DT_S)


@pytest.mark.parametrize("name", ["short-period", "lateral"])
def test_a_right_flight_moves_as_its_equations_say(name: str) -> None:
    # By steps of second order of 5 ms L_p and L_da were 0.13 % small, of intervals of 0.5 %.
    flight = fly(name, "none", "white", 0, scale=0.0)
    model = template(name, Trim(17.0, 0.06, 0.06))
    system = model.matrices(np.array([TRUTH[name][p.name] for p in model.parameters]))
    u = np.column_stack([flight.columns[i][:PER] for i in model.inputs])
    y = np.real(signal.lsim(system, u, DT_S * np.arange(PER))[1])
    for k, output in enumerate(model.outputs):
        moved = flight.columns[output][:PER] - flight.columns[output][0]
        assert np.max(np.abs(moved - y[:, k])) < 1e-3 * NOISE_SD[output]
