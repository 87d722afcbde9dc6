"""Intervals of a fit whose residual the inputs drive: widened by what the model lacks.

Noise that a model's error was taken for narrows the interval two to three times. Where the inputs
drive the residual (`numerics.input_coherence`), its power above noise counts in the covariance.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from host.arrays import Array
from host.sysid.estimators.gust_penetration import PREFIX
from host.sysid.models.fit_result import FitResult
from host.sysid.models.uncertainty import ModelError, Uncertainty
from host.sysid.numerics.input_coherence import InputCoherence

REPORTED_FACTOR = 1.05  # times wider


@dataclass(frozen=True)
class NoiseExcess:
    """A residual that is larger than the noise and gust model of its fit predicts.

    Attributes
    ----------
    power : dict
        Output to the power of the residual over what is predicted.
    variance_ratio : Array, shape (P,)
        Variance of each parameter in that residual over that in what is predicted.
    """

    power: dict[str, float]
    variance_ratio: Array


def driven_by_inputs(
    result: FitResult,
    noise: Uncertainty,
    found: InputCoherence | None,
    excess: NoiseExcess | None = None,
) -> ModelError | None:
    """Return what the inputs drive outside the model.

    Intervals hold it where it is suspected at 10 %, and it is said at 1 %. The bias by the error
    that the residual looks most like is a shift: of output error as it is, of other methods in
    deviations of a free simulation, whose bias it is. In gusts that knows N_r eight times worse
    than the filter, which its bias of 30 % would widen 38 times for an error of 1 %.

    Output error is widened to the covariance of that residual, other methods by its ratio to the
    covariance in noise alone, or by what a residual larger than they predict makes of each
    parameter's variance: slow gusts widen what rests on slow motion. No interval becomes narrower.
    The degrees of freedom are those of the columns that showed it.

    Parameters
    ----------
    result : FitResult
    noise : Uncertainty
        What noise leaves open of it.
    found : InputCoherence or None
        Coherence of its free simulation. None is returned without, or if no output is coherent.
    excess : NoiseExcess, optional
        Outputs whose residual is larger than the fit's own noise and gust model predicts.
    """
    if found is None or not (found.suspected or excess):
        return None
    count = len(result.model.parameter_names)
    own = noise.variance[:count]
    wide = np.diag(found.widened_covariance())[:count]
    moved = found.shift[:count]
    least, factor = wide, np.ones(count)
    if result.residual_kind != "output":
        simulated = np.maximum(np.diag(found.covariance())[:count], 1e-300)
        ratio = wide / simulated
        if excess is not None:
            ratio = np.maximum(ratio, excess.variance_ratio[:count])
        least, factor = np.zeros(count), np.sqrt(np.maximum(ratio, 1.0))
        moved = moved * np.sqrt(own / simulated)
    # What gusts do is no derivative: the model of the gust is not what the inputs drive.
    known = (own > 0.0) & [not n.startswith(PREFIX) for n in result.names[:count]]
    factor = np.where(known, factor, 1.0)
    least, shift = (np.where(known, x, 0.0) for x in (least, moved))
    larger = np.maximum(factor**2 * own, least) + shift**2
    total = np.sqrt(larger / np.where(known, own, 1.0), where=known, out=np.ones(count))
    pairs = zip(found.outputs, found.columns, strict=True)
    columns = min((float(c) for n, c in pairs if n in found.suspected), default=np.inf)
    freedom = np.where(total > 1.0, columns, np.inf)
    lines = _lines(result, found, total, excess)
    return ModelError(factor, least, shift, freedom=freedom, warnings=tuple(lines))


def widened_to(known: Uncertainty, covariance: Array) -> Uncertainty:
    """Return a covariance in place of another, no parameter known better than by either, (P, P)."""
    own = np.diag(covariance)
    ratio = np.where(own > 0.0, known.variance / np.maximum(own, 1e-300), 1.0)
    return replace(known, covariance=covariance).times(np.sqrt(np.maximum(ratio, 1.0)))


def _lines(
    result: FitResult, found: InputCoherence, factor: Array, excess: NoiseExcess | None
) -> list[str]:
    """Return the warning: outputs that fail the test, and the inflation of the intervals."""
    widened = {
        p.name: float(times)
        for p, times in zip(result.model.parameters, factor, strict=False)
        if times >= REPORTED_FACTOR and not p.name.startswith("imu_")
    }
    like = f", most like {found.likely_error}" if found.likely_error else ""
    reasons = []
    if found.coherent:
        reasons.append(f"the residual of {', '.join(found.coherent)} follows the inputs{like}")
    if excess:
        larger = ", ".join(
            f"{name} by {np.sqrt(power):.1f} times" for name, power in excess.power.items()
        )
        reasons.append(f"free simulation misses {larger} what gusts and noise allow")
    return [f"{'; '.join(reasons)}; {_widening(widened)}"] if reasons else []


def _widening(factors: Mapping[str, float]) -> str:
    """Return how much intervals were widened, and which one most."""
    if not factors:
        return "no interval needs to be wider for it"
    most = max(factors, key=lambda name: factors[name])
    count = f"{len(factors)} intervals are" if len(factors) > 1 else "1 interval is"
    return f"{count} wider for it, that of {most} most ({factors[most]:.1f} times)"
