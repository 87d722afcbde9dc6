"""Trim and linear models of the virtual aircraft against python-control's own.

The equations of motion are handed to it as one non-linear system of eight states (u v w p q r phi
theta) and three surfaces, the rotor's speed held; the search for a trim and the linearisation are
then its.
"""

import control
import numpy as np
import pytest
from host.aircraft import file as aircraft
from host.aircraft.airframe import ELEVATOR, Q0, STATE_COUNT, Airframe
from host.aircraft.attitude import euler, quaternion
from host.aircraft.linearisation import linearise, modes
from host.aircraft.rigid_body import derivative
from host.aircraft.trim import Trim, solve

LONGITUDINAL, LATERAL = [0, 2, 4, 7], [1, 3, 5, 6]


def system(frame: Airframe, trim: Trim) -> control.NonlinearIOSystem:
    """Return body rates and Euler angles by the equations of motion, air still."""

    def rates(t: float, x: np.ndarray, surfaces: np.ndarray, params: object) -> np.ndarray:
        state, command = trim.state.copy(), trim.command.copy()
        state[:6] = x[:6]
        state[Q0 : Q0 + 4] = quaternion(x[6], x[7], 0.0)
        state[ELEVATOR : ELEVATOR + 3] = command[:3] = surfaces
        out = np.empty(STATE_COUNT + 4)
        derivative(frame, state, command, np.zeros(9), trim.density_kgpm3, out)
        p, q, r = x[3:6]
        turn = q * np.sin(x[6]) + r * np.cos(x[6])
        angles = [p + turn * np.tan(x[7]), q * np.cos(x[6]) - r * np.sin(x[6])]
        return np.concatenate([out[:6], angles])

    def airspeed(t: float, x: np.ndarray, surfaces: np.ndarray, params: object) -> float:
        return float(np.hypot(x[0], x[2]))

    return control.nlsys(rates, airspeed, inputs=3, states=8, outputs=1)


def point(trim: Trim) -> tuple[np.ndarray, np.ndarray]:
    phi, theta, _ = euler(trim.state[Q0 : Q0 + 4])
    return np.concatenate([trim.state[:6], [phi, theta]]), trim.state[ELEVATOR : ELEVATOR + 3]


@pytest.mark.parametrize("airspeed_mps", [14.0, 20.0])
def test_trim_is_where_python_control_finds_an_equilibrium(airspeed_mps: float) -> None:
    frame = aircraft.load("ultrastick25e").airframe()
    trim = solve(frame, airspeed_mps)
    states, surfaces = point(trim)
    away = states + np.array([0.5, 0.0, 0.3, 0.0, 0.0, 0.0, 0.02, 0.03])
    # Airspeed, no sideslip and no turn are asked for; all eight rates of change are to vanish.
    found, inputs = control.find_operating_point(
        system(frame, trim), away, surfaces + 0.02, airspeed_mps, iu=[], ix=[1, 5]
    )
    np.testing.assert_allclose(found, states, atol=1e-4)
    np.testing.assert_allclose(inputs, surfaces, atol=1e-5)


def test_linear_models_and_their_modes_are_those_of_python_control() -> None:
    frame = aircraft.load("ultrastick25e").airframe()
    trim = solve(frame, 18.0)
    linear = linearise(frame, trim)
    peer = control.linearize(system(frame, trim), *point(trim), eps=1e-6)
    A, B = np.asarray(peer.A), np.asarray(peer.B)
    for ours_A, ours_B, rows, columns in (
        (linear.longitudinal_a, linear.longitudinal_b, LONGITUDINAL, [0]),
        (linear.lateral_a, linear.lateral_b, LATERAL, [1, 2]),
    ):
        # Differences: one-sided of 1e-6 there, central of 1e-5 here.
        np.testing.assert_allclose(ours_A, A[np.ix_(rows, rows)], rtol=1e-4, atol=1e-3)
        np.testing.assert_allclose(ours_B, B[np.ix_(rows, columns)], rtol=1e-4, atol=1e-3)
    found = {m.name: m for m in modes(linear)}
    for matrix, names in (
        (linear.longitudinal_a, ("short period", "phugoid")),
        (linear.lateral_a, ("dutch roll", "roll", "spiral")),
    ):
        frequency, damping, pole = control.damp(
            control.ss(matrix, np.zeros((4, 1)), np.eye(4), np.zeros((4, 1))), doprint=False
        )
        for name in names:
            k = int(np.argmin(np.abs(pole - found[name].eigenvalue)))
            assert found[name].frequency_radps == pytest.approx(frequency[k], rel=1e-8)
            assert found[name].damping == pytest.approx(damping[k], rel=1e-8)
