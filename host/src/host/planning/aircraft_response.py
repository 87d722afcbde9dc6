"""What a movement of the surfaces says of this aircraft, before anybody looks at its response.

The aircraft file's linear model turns the movement into motion; the information of that motion
about each derivative is that of a regression (Klein & Morelli, Aircraft System Identification,
chapter 5). Only its ratio to that of the card's own input is used, so neither noise nor scale of
the model is needed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from scipy.linalg import expm
from scipy.signal import butter, lfilter

from host.aircraft.air import atmosphere
from host.aircraft.air import density_kgpm3 as density_at
from host.aircraft.file import Aircraft
from host.aircraft.linear_aircraft import load
from host.aircraft.linearisation import linearise, modes
from host.aircraft.mode_names import DUTCH_ROLL, SHORT_PERIOD
from host.aircraft.trim import solve
from host.arrays import Array
from host.twin.testcard.cards import Card

STEP_S = 0.01
# Gusts are slow: motion slower than this share of the mode's frequency drowns in them.
FAST_SHARE = 0.3
SLOW_HZ = 0.5
_SURFACES = {"longitudinal": ("elevator",), "lateral": ("aileron", "rudder")}
# Rows of the equations of motion -> motion, and columns of what multiplies their derivatives.
_ROWS = {
    "CL": ("longitudinal", ("alpha", "q", "de")),
    "Cm": ("longitudinal", ("alpha", "q", "de")),
    "Cl": ("lateral", ("beta", "p", "r", "da", "dr")),
    "Cn": ("lateral", ("beta", "p", "r", "da", "dr")),
}
_LEAST_RAD = 1e-4  # of a regressor: without any movement nothing is known, but not infinitely so


class AircraftResponse:
    """The nominal aircraft about one trim.

    Parameters
    ----------
    aircraft : Aircraft
    airspeed_mps : float
    height_m : float
        For the air's density.

    Attributes
    ----------
    linear : Linear
        Its motion about the trim.

    Raises
    ------
    TrimError
        It cannot be trimmed there.
    """

    def __init__(self, aircraft: Aircraft, airspeed_mps: float, height_m: float = 100.0) -> None:
        frame = aircraft.airframe()
        rho = density_at(atmosphere(101325.0, 15.0), height_m)
        linear = linearise(frame, solve(frame, airspeed_mps, density_kgpm3=rho))
        self.linear = linear
        self.airspeed_mps = airspeed_mps
        self.servo_radps = float(frame.servo_bandwidth_radps)
        self.modes = {mode.name: mode for mode in modes(linear)}
        self._fast = {
            name: butter(2, FAST_SHARE * self._mode_hz(mode) * 2.0 * STEP_S, "high")
            for name, mode in (("longitudinal", SHORT_PERIOD), ("lateral", DUTCH_ROLL))
        }
        self._steps = {
            "longitudinal": _discrete(linear.longitudinal_a, linear.longitudinal_b),
            "lateral": _discrete(linear.lateral_a, linear.lateral_b),
        }

    def _mode_hz(self, name: str) -> float:
        """Return a mode's frequency; a slow one where the aircraft does not oscillate so."""
        if name not in self.modes:
            return SLOW_HZ
        return max(self.modes[name].frequency_radps / (2.0 * np.pi), SLOW_HZ)

    def motion(self, name: str, surfaces: Mapping[str, Array]) -> dict[str, Array]:
        """Return the motion that deflections from the trim cause.

        Parameters
        ----------
        name : str
            ``longitudinal`` or ``lateral``.
        surfaces : dict of str to (n,) Array
            ``elevator``, ``aileron``, ``rudder``, rad, every `STEP_S`.
        """
        a, b = self._steps[name]
        moved = np.stack([surfaces[one] for one in _SURFACES[name]], axis=1)
        driven = moved @ b.T
        x = np.zeros((len(moved), 4))
        for k in range(1, len(x)):
            x[k] = a @ x[k - 1] + driven[k - 1]
        if name == "longitudinal":
            return {"alpha": x[:, 1] / self.airspeed_mps, "q": x[:, 2], "de": moved[:, 0]}
        return {
            "beta": x[:, 0] / self.airspeed_mps, "p": x[:, 1], "r": x[:, 2],
            "da": moved[:, 0], "dr": moved[:, 1],
        }  # fmt: skip

    def deviations(self, names: tuple[str, ...], surfaces: Mapping[str, Array]) -> Array:
        """Return the standard deviation of each derivative for unit noise.

        Parameters
        ----------
        names : tuple of str
            Such as ``Cm_q``.
        surfaces : dict
            As `motion` takes them.
        """
        of = self.information({name.partition("_")[0] for name in names}, surfaces)
        return deviations(names, of)

    def information(self, rows: Iterable[str], surfaces: Mapping[str, Array]) -> dict[str, Array]:
        """Return the information matrix of each equation's derivatives for unit noise.

        Parameters
        ----------
        rows : iterable of str
            Such as ``Cm``; that of several inputs is the sum.
        surfaces : dict
            As `motion` takes them.
        """
        moved: dict[str, dict[str, Array]] = {}
        found: dict[str, Array] = {}
        for row in rows:
            motion, columns = _ROWS[row]
            if motion not in moved:
                moved[motion] = self.motion(motion, surfaces)
            x = np.stack([moved[motion][one] for one in columns], axis=1)
            b, a = self._fast[motion]
            x = lfilter(b, a, x - x[0], axis=0)
            found[row] = np.asarray(x.T @ x * STEP_S)
        return found


def card_response(card: Card) -> AircraftResponse:
    """Return the card's aircraft about the card's trim.

    Raises
    ------
    AircraftError, TrimError
        It cannot be read or trimmed.
    """
    aircraft = load(card.aircraft)
    speed = card.flight.airspeed_mps or aircraft.scalar("trim.airspeed_mps")
    return AircraftResponse(aircraft, speed, card.flight.height_m)


def deviations(names: Sequence[str], information: Mapping[str, Array]) -> Array:
    """Return the standard deviation of each derivative, of information by equation."""
    found = []
    for name in names:
        row, _, of = name.partition("_")
        columns = _ROWS[row][1]
        at = columns.index(of)
        least = np.eye(len(columns)) * _LEAST_RAD**2
        found.append(float(np.sqrt(np.linalg.inv(information[row] + least)[at, at])))
    return np.array(found)


def _discrete(a: Array, b: Array) -> tuple[Array, Array]:
    """Return the step of a model whose inputs are held over `STEP_S`."""
    n, m = b.shape
    whole = np.zeros((n + m, n + m))
    whole[:n, :n], whole[:n, n:] = a, b
    step = expm(whole * STEP_S)
    return step[:n, :n], step[:n, n:]
