"""One axis of an identified aircraft with all that its data leave open, at any airspeed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from host.arrays import Array
from host.constants import NORMAL_95
from host.control.control_error import ControlError
from host.control.plant import RATES
from host.sysid.models import LinearModel, Trim, template

if TYPE_CHECKING:
    from host.sysid.pipeline import Identification

# Models with the motion of an axis, the whole one first.
TEMPLATES = {"roll": ("lateral", "roll"), "pitch": ("longitudinal", "short-period")}
# Power of the airspeed in a dimensional derivative at constant density (Klein & Morelli, Aircraft
# System Identification, 2nd ed., section 3.8: of each, dynamic pressure, mass and airspeed).
_FORCE = {"V": 0, "alpha": 1, "beta": 1, "p": 0, "q": 0, "r": 0, "de": 1, "da": 1, "dr": 1, "dt": 0}
_MOMENT = {name: power + 1 for name, power in _FORCE.items()}
POWERS = {
    **{f"{row}_{name}": power for row in "ZY" for name, power in _FORCE.items()},
    **{f"{row}_{name}": power for row in "DLMN" for name, power in _MOMENT.items()},
}


@dataclass(frozen=True, slots=True)
class UncertainAxis:
    """Derivatives of one axis, their joint covariance and the condition they hold at.

    Attributes
    ----------
    axis : str
        ``roll`` or ``pitch``.
    template : str
        The linear model they are parameters of.
    trim : Trim
    names : tuple of str
        Derivatives, shape (P,).
    mean : Array, shape (P,)
        rad, s, m.
    covariance : Array, shape (P, P)
        With all widening; what is not to be relied on has its full width in it.
    correlated : bool
        Whether the covariance is joint; a saved model keeps half-widths alone.
    """

    axis: str
    template: str
    trim: Trim
    names: tuple[str, ...]
    mean: Array
    covariance: Array
    correlated: bool = True

    def drawn(self, rng: np.random.Generator, count: int) -> Array:
        """Return derivatives drawn from their joint distribution, shape (count, P)."""
        # The square root by eigenvalues holds where the covariance is singular (a known value).
        values, vectors = np.linalg.eigh(self.covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        return np.asarray(self.mean + rng.standard_normal((count, len(self.mean))) @ root.T)

    def matrices(self, values: Array, airspeed_mps: float) -> tuple[Array, Array, tuple[str, ...]]:
        """Return A, B with its own surface first, and the states, at another airspeed.

        Coefficients are those of the trim: what changes them with the angle of attack is left out.

        Parameters
        ----------
        values : Array, shape (P,)
            Derivatives at the airspeed of the trim.
        airspeed_mps : float
        """
        at = Trim(airspeed_mps, self.trim.alpha_rad, self.trim.theta_rad)
        model = _model(self.template, at)
        ratio = airspeed_mps / self.trim.airspeed_mps
        scaled = {
            name: value * ratio ** POWERS[name]
            for name, value in zip(self.names, values.tolist(), strict=True)
        }
        full = [scaled.get(one.name, 0.0) for one in model.parameters]
        a, b, _, _ = model.matrices(np.array(full))
        return a, b, model.states

    @property
    def sense(self) -> float:
        """1 or -1: the sign of the surface's moment as estimated."""
        _, b, states = self.matrices(self.mean, self.trim.airspeed_mps)
        return float(np.copysign(1.0, b[states.index(RATES[self.axis]), 0]))

    def half_width(self, name: str) -> float:
        """Return the 95 % half-width of one derivative."""
        k = self.names.index(name)
        return NORMAL_95 * float(np.sqrt(self.covariance[k, k]))


@cache
def _model(name: str, at: Trim) -> LinearModel:
    """Return a template; thousands of aircraft are drawn of one."""
    return template(name, at, accelerometers=True)


def axes_of(identified: Identification) -> dict[str, UncertainAxis]:
    """Return roll and pitch of an answer, of each the most complete model that was fitted.

    Raises
    ------
    ControlError
        The answer has neither.
    """
    found: dict[str, UncertainAxis] = {}
    for axis, names in TEMPLATES.items():
        answers = {one.template: one for one in identified.linear if not one.own_model}
        whole = next((answers[name] for name in names if name in answers), None)
        if whole is None:
            continue
        result = whole.result
        kept = [k for k, name in enumerate(result.names) if name in POWERS]
        # Intervals are Student's; a normal of the same 95 % half-width stands for them.
        sd = result.half_width()[kept] / NORMAL_95
        covariance = result.correlation[np.ix_(kept, kept)] * np.outer(sd, sd)
        found[axis] = UncertainAxis(
            axis,
            whole.template,
            whole.trim,
            tuple(result.names[k] for k in kept),
            result.estimate[kept],
            covariance,
        )
    if not found:
        models = ", ".join(one.template for one in identified.linear) or "none"
        raise ControlError(
            f"the answer has the linear models {models}, expected lateral or roll, and longitudinal"
            " or short-period: identify with one of these"
        )
    return found


def axes_of_models(paths: Sequence[Path]) -> dict[str, UncertainAxis]:
    """Return roll and pitch of models that `host identify --save-model` wrote.

    A saved model keeps half-widths and no correlation: its derivatives count as independent.

    Raises
    ------
    ControlError
        A file is of neither axis, or two are of one.
    host.errors.HostError
        A file is no model.
    """
    from host.sysid.conversion import saved_values
    from host.sysid.models import read_model
    from host.sysid.models.model_file import read_trim

    found: dict[str, UncertainAxis] = {}
    for path in paths:
        model, at, values = read_model(path), read_trim(path), saved_values(path)
        named = [axis for axis, names in TEMPLATES.items() if model.name in names]
        if not named:
            raise ControlError(
                f"{path}: model '{model.name}', expected lateral, roll, longitudinal or"
                " short-period of `host identify --save-model`"
            )
        if named[0] in found:
            raise ControlError(f"{path}: a second model of {named[0]}; name one of each axis")
        given = {
            one.name: values.get(one.name, (start, 0.0))
            for one, start in zip(model.parameters, model.start.tolist(), strict=True)
            if one.name in POWERS
        }
        names = tuple(given)
        mean, half = np.array(list(given.values())).T
        sd = half / NORMAL_95
        found[named[0]] = UncertainAxis(
            named[0], model.name, at, names, mean, np.diag(sd**2), correlated=False
        )
    return found
