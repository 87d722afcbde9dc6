"""Modes of a linear model are those about level flight, whatever pitch angle was measured."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.sysid.errors.systematic_errors import in_level_flight
from host.sysid.models.modal_analysis import modes, modes_of
from host.sysid.models.reduced_model import without_inputs
from host.sysid.models.state_space_model import LinearModel
from host.sysid.models.templates import Trim, template

import host
from tests.answers.stored_input import opened

LEVEL = Trim(17.0, 0.1, 0.1)
TRUE = {
    "longitudinal": "D_V -0.33 D_alpha -7.3 D_de -1.2 Z_V -0.066 Z_alpha -6.9 Z_q -0.1 Z_de -0.9"
    " M_V 0.1 M_alpha -262 M_q -13.3 M_de -205",
    "lateral": "Y_beta -0.2 Y_p 0 Y_r 0 Y_da 0 Y_dr 0.17 L_beta -66 L_p -21.8 L_r 5 L_da 320"
    " L_dr 1.2 N_beta 31.6 N_p -0.6 N_r -1.3 N_da 1.5 N_dr -28",
}


@pytest.mark.parametrize("name", TRUE)
def test_a_pitch_angle_that_is_off_moves_no_mode(name: str) -> None:
    """A tilt of 0.1 rad moved the damping of the phugoid by a fifth, the spiral by half."""
    tilted = replace(LEVEL, theta_rad=0.2)
    true, found = template(name, LEVEL), in_level_flight(template(name, tilted), tilted)
    assert poles(found, name) == pytest.approx(poles(true, name), rel=1e-12)
    assert poles(template(name, tilted), name) != pytest.approx(poles(true, name), rel=0.02)


def test_a_wing_without_a_rudder_has_level_modes_too() -> None:
    """Its spiral stayed about the pitch angle that was measured."""
    tilted = replace(LEVEL, theta_rad=0.2)
    true, off = (without_inputs(template("lateral", x), ["rudder_rad"]) for x in (LEVEL, tilted))
    found = in_level_flight(off, tilted)
    assert poles(found, "lateral") == pytest.approx(poles(true, "lateral"), rel=1e-12)


def test_a_lateral_model_without_airspeed_stays_as_it_is() -> None:
    """It may be a user's file of that name; a template of it cannot be made."""
    unknown = replace(LEVEL, airspeed_mps=float("nan"))
    own = template("lateral", LEVEL)
    assert in_level_flight(own, unknown) is own


def test_an_answer_has_level_modes(tmp_path: Path) -> None:
    found = host.identify(opened("inputs/trainer-pitch.npz", tmp_path), models="longitudinal")
    [answer] = found.linear
    assert abs(answer.trim.theta_rad - answer.trim.alpha_rad) > 1e-3
    level = in_level_flight(answer.model, answer.trim)
    for mode, own, flown in zip(
        answer.modes, modes(answer.result, level), modes(answer.result), strict=True
    ):
        assert mode.eigenvalue == own.eigenvalue != flown.eigenvalue


def test_a_model_of_the_users_own_stays_as_it_is() -> None:
    own = replace(template("longitudinal", LEVEL), name="mine")
    assert in_level_flight(own, LEVEL) is own


def poles(model: LinearModel, name: str) -> list[complex]:
    words = TRUE[name].split()
    true = dict(zip(words[::2], map(float, words[1::2]), strict=True))
    values = np.array([true[p.name] for p in model.parameters])
    none = np.zeros((len(model.parameters),) * 2)
    return [m.eigenvalue for m in modes_of(model, model.matrices(values)[0], none)]
