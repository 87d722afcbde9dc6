"""Derivatives where a maneuver was flown, against equations of motion integrated as they are."""

import numpy as np
import pytest
from host.aircraft.airframe import COMMAND_COUNT, Q0, ROTOR, STATE_COUNT, Airframe, Q, U, W
from host.aircraft.attitude import euler, quaternion
from host.aircraft.file import load
from host.aircraft.flown_derivatives import FlownCondition, flown_derivatives, flown_modes
from host.aircraft.linearisation import linearise, modes
from host.aircraft.rigid_body import derivative
from host.aircraft.trim import Trim, solve

SPEED_MPS, DENSITY_KGPM3 = 17.0, 1.2
NARROW_RAD = 1e-5


def trimmed() -> tuple[Airframe, Trim, FlownCondition]:
    frame = load("ultrastick25e").airframe()
    trim = solve(frame, SPEED_MPS, density_kgpm3=DENSITY_KGPM3)
    out = np.empty(STATE_COUNT + 4)
    derivative(frame, trim.state, trim.command, np.zeros(9), DENSITY_KGPM3, out)
    elevator, aileron, rudder = trim.command[:3].tolist()
    surfaces = (elevator, aileron, rudder)
    at = FlownCondition(SPEED_MPS, trim.alpha_rad, 0.0, surfaces, out[-1], DENSITY_KGPM3)
    return frame, trim, at


def with_the_rotor(frame: Airframe, trim: Trim) -> list[complex]:
    """Return the roots of u, w, q, theta and the rotor's speed: nothing is held."""
    phi, theta, psi = (float(a) for a in euler(trim.state[Q0 : Q0 + 4]))
    place = [U, W, Q, ROTOR]

    def rates(point: np.ndarray) -> np.ndarray:
        x, out = trim.state.copy(), np.empty(STATE_COUNT + COMMAND_COUNT)
        x[place] = point[:4]
        x[Q0 : Q0 + 4] = quaternion(phi, point[4], psi)
        derivative(frame, x, trim.command, np.zeros(9), trim.density_kgpm3, out)
        return np.array([*out[place], point[2]])

    point = np.array([*trim.state[place], theta])
    width = 1e-6 * np.maximum(np.abs(point), 1.0)
    slopes = [(rates(point + w) - rates(point - w)) / (2 * w.sum()) for w in np.diag(width)]
    return list(np.linalg.eigvals(np.column_stack(slopes)))


def test_the_phugoid_is_damped_as_the_aircraft_with_its_rotor_is() -> None:
    """A rotor that was held at its speed gave 0.42 for 0.21."""
    frame, trim, at = trimmed()
    [true] = [s for s in with_the_rotor(frame, trim) if 0.0 < s.imag < 2.0]
    held = {m.name: m for m in modes(linearise(frame, trim))}["phugoid"]
    found = {
        m.name: m
        for m in flown_modes(flown_derivatives(frame, at, NARROW_RAD), at, frame.gravity_mps2)
    }["phugoid"]
    assert found.damping == pytest.approx(-true.real / abs(true), rel=0.02)
    assert found.frequency_radps == pytest.approx(abs(true), rel=0.04)
    assert held.damping > 1.5 * found.damping


def test_what_the_rotor_does_not_move_is_that_of_the_trim() -> None:
    frame, trim, at = trimmed()
    found = flown_modes(flown_derivatives(frame, at, NARROW_RAD), at, frame.gravity_mps2)
    own = {m.name: m for m in found}
    for mode in modes(linearise(frame, trim)):
        if mode.name != "phugoid":
            assert own[mode.name].eigenvalue == pytest.approx(mode.eigenvalue, rel=2e-3)


def test_derivatives_go_with_the_square_of_the_airspeed() -> None:
    frame, _, at = trimmed()
    slow = flown_derivatives(frame, at)
    faster = FlownCondition(
        1.1 * SPEED_MPS, at.alpha_rad, 0.0, at.surfaces_rad, at.thrust_n, DENSITY_KGPM3
    )
    fast = flown_derivatives(frame, faster)
    for name, power in (("M_alpha", 2), ("M_de", 2), ("L_da", 2), ("N_beta", 2), ("M_q", 1)):
        assert fast[name] / slow[name] == pytest.approx(1.1**power, rel=0.01)
