"""Tables without accelerometers: a late vane and the forces of turning look alike.

The trainer of another simulator, airspeed varying by what the inputs do.
"""

import numpy as np
import pytest
from host.instrument.instrument_errors import usual_errors
from host.physical.recording import FOREIGN
from host.sysid.linear import Answer
from studies.foreign.flight import Air, derivatives, fly

from tests.host.sysid.at_hand import identify
from tests.host.sysid.held import assert_held

FORCES = ("ax_mps2", "ay_mps2", "az_mps2")
LATE_S = 0.02
ENDS_S = {"longitudinal": (0.0, 42.5), "lateral": (41.0, 100.0)}
Columns = dict[str, np.ndarray]


@pytest.fixture(scope="module")
def calm() -> tuple[Columns, Columns]:
    return fly(Air(), 31000)


def answer(flight: tuple[Columns, Columns], axis: str) -> Answer:
    measured, true = flight
    t, (first, last) = true["t_s"], ENDS_S[axis]
    late = {
        y: np.interp(t - LATE_S, t, true[y]) + measured[y] - true[y]
        for y in ("alpha_rad", "beta_rad")
    }
    there = (t >= first) & (t < last)
    cut = {k: v[there][::2] for k, v in {**measured, **late}.items() if k not in FORCES}
    usual = usual_errors(FOREIGN)
    exact = usual.scaled(0.0, *(error.name for error in usual))
    [found] = identify(cut, names=(axis,), maker=FOREIGN, errors=exact)
    return found


@pytest.mark.parametrize(
    ("axis", "known"),
    [
        # M_alpha was known to 94 %, M_q to 221 %, M_de to 21 %.
        ("longitudinal", {"M_alpha": 0.08, "M_q": 0.12, "M_de": 0.03}),
        # N_r was known to 115 %, N_beta to 13 %.
        ("lateral", {"N_beta": 0.03, "N_r": 0.10, "N_dr": 0.02, "L_p": 0.08}),
    ],
)
def test_moments_are_known_beside_a_late_vane(
    calm: tuple[Columns, Columns], axis: str, known: dict[str, float]
) -> None:
    found = answer(calm, axis)
    assert_held(found.result, derivatives(found.trim.airspeed_mps), known=known)
    assert 0.010 < found.result.value("delay_vanes_s") < 0.025
