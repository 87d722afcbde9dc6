"""Fits of several flights as one: noise averages out, sensor errors do not.

Each flight is fitted alone. The part of its covariance P that is correlated with the sensor errors,
L L' with L = P_xe P_ee^(-1/2), is the same error in every flight and is not averaged. The rest is
the flight's own noise, and its inverse is the weight of the flight. An error that is new at every
power-on is treated as common too, so intervals are rather too wide. An error that only some flights
have (of servos, of a clock without GPS) is zero and certain in the others. Where flights scatter
more than noise and errors allow, the interval is widened (`numerics/maneuver_agreement`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from host.arrays import Array
from host.constants import NORMAL_95
from host.errors import IdentificationError
from host.sysid.coefficients.coefficient_fit import (
    CoefficientFit,
    CoefficientHistory,
    Derivative,
    MeanCondition,
    ThrustEffect,
)
from host.sysid.coefficients.deletion_diagnostics import CrossValidation
from host.sysid.models.uncertainty import Uncertainty, consider_covariance
from host.sysid.numerics.maneuver_agreement import ManeuverAgreement, scatter_test

LEAST_EIGENVALUE = 1e-12  # of the largest; below it is rounding


def pool_fits(fits: Sequence[CoefficientFit]) -> CoefficientFit:
    """Return one fit of several flights by the same terms and instrument.

    Parameters
    ----------
    fits : sequence of CoefficientFit
        At least one; one alone is returned as it is.
    """
    if len(fits) == 1:
        return fits[0]
    _check_same_terms(fits)
    errors = tuple(dict.fromkeys(name for fit in fits for name in fit.errors))
    has = np.array([[name in fit.errors for name in errors] for fit in fits], dtype=np.float64)
    fits = [_with_all_errors(fit, errors) for fit in fits]
    state, covariance, agreement = _pooled(fits, has)
    count = len(fits[0].derivatives)
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    known = zip(errors, state[count:].tolist(), sd[count:].tolist(), strict=True)
    return CoefficientFit(
        derivatives=_pooled_derivatives(fits, state, sd),
        covariance=covariance,
        errors={name: (value, deviation) for name, value, deviation in known},
        condition=_mean_condition([fit.condition for fit in fits]),
        histories=_joined_histories(fits),
        prediction=_predictions([fit.prediction for fit in fits]),
        maneuver_agreement=agreement,
    )


def _check_same_terms(fits: Sequence[CoefficientFit]) -> None:
    names = [d.name for d in fits[0].derivatives]
    for number, fit in enumerate(fits, start=1):
        if [d.name for d in fit.derivatives] != names:
            raise IdentificationError(
                f"flight 1 and flight {number} do not tell the same coefficients (another axis"
                " flown, another surface moved, thrust not known in one): fit them one at a time"
            )


def _pooled(fits: Sequence[CoefficientFit], has: Array) -> tuple[Array, Array, ManeuverAgreement]:
    """Return state and covariance of all flights, and how far the flights agree.

    Parameters
    ----------
    fits : sequence of CoefficientFit
        With the same errors.
    has : Array, shape (flights, errors)
        1 where a flight has an error.
    """
    count = len(fits[0].derivatives)
    found = np.stack([_state(fit) for fit in fits])
    common = np.stack([_common_error_root(fit.covariance, count) for fit in fits])
    own = np.stack([f.covariance - c @ c.T for f, c in zip(fits, common, strict=True)])
    noise = np.maximum(np.einsum("kii->ki", own), 1e-300)
    weight = np.full_like(found, 1.0 / len(fits))
    weight[:, count:] = has / has.sum(axis=0)
    weight[:, :count] = (1.0 / noise / np.sum(1.0 / noise, axis=0))[:, :count]
    state = np.sum(weight * found, axis=0)
    covariance = np.einsum("ki,kij,kj->ij", weight, own, weight)
    influence = weight[:, :count] * (found - state)[:, :count]
    total_variance = np.einsum("kii->ki", np.stack([fit.covariance for fit in fits]))
    expected = np.sum(weight**2 * total_variance, axis=0)[:count]
    names = tuple(d.name for d in fits[0].derivatives)
    agreement = scatter_test(names, influence, weight[:, :count], expected)
    covariance += consider_covariance(np.einsum("ki,kij->ji", weight, common))
    known = Uncertainty(covariance, np.full(len(covariance), np.inf))
    return state, known.with_model_error([agreement.in_normal_quantiles]).covariance, agreement


def _pooled_derivatives(
    fits: Sequence[CoefficientFit], state: Array, sd: Array
) -> tuple[Derivative, ...]:
    floors = np.mean([[_floor(d) for d in fit.derivatives] for fit in fits], axis=0)
    sizes = np.maximum(np.abs(state[: len(floors)]), floors)
    return tuple(
        Derivative(d.name, float(state[k]), float(NORMAL_95 * sd[k]), float(sizes[k]))
        for k, d in enumerate(fits[0].derivatives)
    )


def _joined_histories(fits: Sequence[CoefficientFit]) -> dict[str, CoefficientHistory]:
    return {
        name: CoefficientHistory(
            np.concatenate([fit.histories[name].measured for fit in fits]),
            np.concatenate([fit.histories[name].model for fit in fits]),
        )
        for name in fits[0].histories
    }


def _with_all_errors(fit: CoefficientFit, errors: Sequence[str]) -> CoefficientFit:
    """Return a fit with errors that its flight does not have, zero and certain, in this order."""
    if tuple(fit.errors) == tuple(errors):
        return fit
    count, own = len(fit.derivatives), list(fit.errors)
    at = [*range(count), *(count + list(errors).index(name) for name in own)]
    covariance = np.zeros((count + len(errors),) * 2)
    covariance[np.ix_(at, at)] = fit.covariance
    every = {name: fit.errors.get(name, (0.0, 0.0)) for name in errors}
    return replace(fit, covariance=covariance, errors=every)


def _state(fit: CoefficientFit) -> Array:
    """Return derivatives, then sensor errors, (n,)."""
    errors = [value for value, _ in fit.errors.values()]
    return np.array([*(d.value for d in fit.derivatives), *errors])


def _floor(d: Derivative) -> float:
    """Return the value that would contribute 5 % of its equation, where a derivative contributes
    less."""
    return d.reference if d.reference > abs(d.value) else 0.0


def _common_error_root(covariance: Array, count: int) -> Array:
    """Return L, (n, errors): shifts by one standard deviation of each principal sensor error."""
    errors = covariance[count:, count:]
    size, vectors = np.linalg.eigh(errors)
    regular = size > LEAST_EIGENVALUE * size[-1]
    root = (vectors[:, regular] / np.sqrt(size[regular])) @ vectors[:, regular].T
    return np.asarray(covariance[:, count:] @ root)


def _mean_condition(flights: Sequence[MeanCondition]) -> MeanCondition:
    def mean(*values: float) -> float:
        return float(np.mean(values))

    thrust = [f.thrust_effect for f in flights]
    return MeanCondition(
        mean(*(f.airspeed_mps for f in flights)),
        mean(*(f.qbar_pa for f in flights)),
        mean(*(f.alpha_rad for f in flights)),
        mean(*(f.lift for f in flights)),
        mean(*(f.drag for f in flights)),
        ThrustEffect(
            mean(*(p.thrust_n for p in thrust)),
            mean(*(p.slope_npmps for p in thrust)),
            mean(*(p.arm_m for p in thrust)),
        ),
        (min(f.alpha_range_rad[0] for f in flights), max(f.alpha_range_rad[1] for f in flights)),
        (
            mean(*(f.airspeed_ratio[0] for f in flights)),
            mean(*(f.airspeed_ratio[1] for f in flights)),
        ),
    )


def _predictions(found: Sequence[CrossValidation | None]) -> CrossValidation | None:
    """Return the cross-validation of all flights together; each maneuver within its flight."""
    known = [p for p in found if p is not None]
    if not known:
        return None
    counts = [len(p.windows) for p in known]

    def rms(tables: Sequence[dict[str, float]]) -> dict[str, float]:
        shared = [n for n in tables[0] if all(n in t for t in tables)]
        return {
            n: float(np.sqrt(np.average([t[n] ** 2 for t in tables], weights=counts)))
            for n in shared
        }

    windows = tuple(range(sum(counts)))
    return CrossValidation(
        windows, rms([p.fitted for p in known]), rms([p.left_out for p in known])
    )
