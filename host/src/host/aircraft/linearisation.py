"""Numerical linearisation about a trim, and its modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host.aircraft.airframe import ELEVATOR, Q0, STATE_COUNT, Airframe, Array
from host.aircraft.attitude import euler, euler_rates, quaternion
from host.aircraft.mode_names import DUTCH_ROLL, PHUGOID, ROLL, ROLL_SPIRAL, SHORT_PERIOD, SPIRAL
from host.aircraft.rigid_body import derivative
from host.aircraft.trim import Trim


@dataclass(frozen=True, slots=True)
class Linear:
    """x' = A x + B u in dimensional states; rotor speed held.

    Attributes
    ----------
    longitudinal_a, longitudinal_b : (4, 4), (4, 1) arrays
        States u, w, q, theta; input elevator. SI, radians.
    lateral_a, lateral_b : (4, 4), (4, 2) arrays
        States v, p, r, phi; inputs aileron, rudder.
    """

    longitudinal_a: Array
    longitudinal_b: Array
    lateral_a: Array
    lateral_b: Array


@dataclass(frozen=True, slots=True)
class Mode:
    """One mode: eigenvalue (1/s), natural frequency (rad/s), damping ratio."""

    name: str
    eigenvalue: complex
    frequency_radps: float
    damping: float


def linearise(frame: Airframe, trim: Trim, width: float = 1e-5) -> Linear:
    """Linearise by central differences of the equations of motion.

    Parameters
    ----------
    frame : Airframe
    trim : Trim
    width : float
        Step in m/s, rad/s and rad.

    Returns
    -------
    Linear
    """
    angles = np.array(euler(trim.state[Q0 : Q0 + 4]))
    still = np.zeros(9)

    def rates(values: Array) -> Array:
        """Return the time derivatives of u v w p q r phi theta at these states and surfaces."""
        x = trim.state.copy()
        x[:6] = values[:6]
        phi, theta = values[6], values[7]
        x[Q0 : Q0 + 4] = quaternion(phi, theta, angles[2])
        x[ELEVATOR : ELEVATOR + 3] = values[8:]
        command = trim.command.copy()
        command[:3] = values[8:]
        out = np.empty(STATE_COUNT + 4)
        derivative(frame, x, command, still, trim.density_kgpm3, out)
        return np.concatenate([out[:6], euler_rates(phi, theta, *values[3:6])[:2]])

    point = np.concatenate([trim.state[:6], angles[:2], trim.state[ELEVATOR : ELEVATOR + 3]])
    slopes = np.empty((8, 11))
    for k in range(11):
        shift = np.zeros(11)
        shift[k] = width
        slopes[:, k] = (rates(point + shift) - rates(point - shift)) / (2 * width)
    lon, lat = [0, 2, 4, 7], [1, 3, 5, 6]
    return Linear(
        longitudinal_a=slopes[np.ix_(lon, lon)],
        longitudinal_b=slopes[np.ix_(lon, [8])],
        lateral_a=slopes[np.ix_(lat, lat)],
        lateral_b=slopes[np.ix_(lat, [9, 10])],
    )


def linear_aircraft_derivatives(frame: Airframe, trim: Trim) -> dict[str, float]:
    """Return the dimensional derivatives of a linear aircraft, ``X_u`` ... ``N_dr``, SI, radians.

    Parameters
    ----------
    frame : Airframe
        A linear one: it has no coefficients.
    trim : Trim
    """
    linear = linearise(frame, trim)
    found: dict[str, float] = {}
    for rows, states, controls, a, b in (
        ("XZM", "uwq", ("de",), linear.longitudinal_a, linear.longitudinal_b),
        ("YLN", "vpr", ("da", "dr"), linear.lateral_a, linear.lateral_b),
    ):
        for i, row in enumerate(rows):
            found |= {f"{row}_{name}": float(a[i, j]) for j, name in enumerate(states)}
            found |= {f"{row}_{name}": float(b[i, j]) for j, name in enumerate(controls)}
    # The matrices of these four contain W0, U0 of the turning axes, which are no derivatives.
    u, w = trim.state[0], trim.state[2]
    for name, turn in (("X_q", w), ("Z_q", -u), ("Y_p", -w), ("Y_r", u)):
        found[name] += float(turn)
    return found


def modes(linear: Linear) -> list[Mode]:
    """Return short period, phugoid, roll, dutch roll and spiral, as far as they exist.

    Two real roots in place of an oscillation get the oscillation's name with ``1`` (faster) and
    ``2`` behind it.
    """
    found = []
    for matrix, fast, slow in (
        (linear.longitudinal_a, SHORT_PERIOD, PHUGOID),
        (linear.lateral_a, "", ""),
    ):
        roots = np.linalg.eigvals(matrix)
        pairs = sorted((s for s in roots if s.imag > 1e-9), key=abs, reverse=True)
        real = sorted((s for s in roots if abs(s.imag) <= 1e-9), key=abs, reverse=True)
        if fast:
            names = [fast, slow] if len(pairs) == 2 else [slow if len(real) == 2 else fast]
            named = list(zip(names, pairs, strict=False))
            spare = fast if len(pairs) < 2 else slow
            named += [(f"{spare} {i + 1}", s) for i, s in enumerate(real)]
        else:
            named = [(DUTCH_ROLL, s) for s in pairs[:1]] + [(ROLL_SPIRAL, s) for s in pairs[1:]]
            named += list(zip((ROLL, SPIRAL, "third", "fourth"), real, strict=False))
        found += [
            Mode(name, complex(s), abs(s), float(-s.real / abs(s)) if abs(s) > 0 else 0.0)
            for name, s in named
        ]
    return found
