"""Registry of the estimation methods: `fit(method, model, maneuvers)`.

A method is imported when it is first used.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from host.errors import IdentificationError
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.nonlinear_model import NonlinearModel
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.output_error_problem import check_shapes

KNOWN_NOISE = ("output-error", "output-error-white")
OWN_STARTS = ("extended-kalman", "unscented-kalman")
NO_MOTION = 1e-30  # in any unit: an output that moves less holds nothing, and its square underflows


@dataclass(frozen=True, slots=True)
class Method:
    """Module and function of a method.

    `options` are the settings with which the function is this method.
    """

    module: str
    function: str
    about: str
    options: tuple[tuple[str, object], ...] = ()


METHODS: dict[str, Method] = {
    "equation-error": Method("equation_error", "fit_equation_error", "ordinary least squares"),
    "equation-error-weighted": Method(
        "equation_error",
        "fit_equation_error",
        "least squares, equations weighted by their residuals",
        (("variant", "weighted"),),
    ),
    "equation-error-robust": Method(
        "equation_error", "fit_equation_error", "Huber M-estimate", (("variant", "robust"),)
    ),
    "equation-error-total": Method(
        "equation_error", "fit_equation_error", "total least squares", (("variant", "total"),)
    ),
    "output-error": Method(
        "output_error_fit",
        "fit_output_error",
        "maximum likelihood, memory of the noise estimated",
    ),
    "output-error-white": Method(
        "output_error_fit",
        "fit_output_error",
        "maximum likelihood for white noise, covariance corrected for colour",
        (("coloured_noise", False),),
    ),
    "filter-error": Method(
        "filter_error", "fit_filter_error", "maximum likelihood with process noise"
    ),
    "frequency-equation-error": Method(
        "frequency_domain", "fit_frequency_equation_error", "least squares on chirp-z transforms"
    ),
    "frequency-output-error": Method(
        "frequency_domain", "fit_frequency_output_error", "maximum likelihood on chirp-z transforms"
    ),
    "stepwise": Method("stepwise", "fit_stepwise", "terms chosen by partial F"),
    "recursive": Method(
        "recursive", "fit_recursive_least_squares", "recursive least squares, real time"
    ),
    "recursive-fourier": Method(
        "recursive", "fit_recursive_fourier", "regression on running transforms, real time"
    ),
    "extended-kalman": Method("kalman", "fit_extended", "joint states and parameters"),
    "unscented-kalman": Method(
        "kalman", "fit_unscented", "joint states and parameters, sigma points"
    ),
    "genetic": Method("genetic", "fit_genetic", "differential evolution, polished"),
    "neural-delta": Method("neural_delta", "fit_neural", "derivatives of a trained network"),
    "hopfield": Method("hopfield", "fit_hopfield", "the printed network iteration"),
    "hopfield-line-search": Method(
        "hopfield", "fit_hopfield", "the original program", (("variant", "line-search"),)
    ),
    "hopfield-whitened": Method(
        "hopfield", "fit_hopfield", "the network, preconditioned", (("variant", "whitened"),)
    ),
}

# Of a user's equations; output error takes both kinds of model.
OF_EQUATIONS: dict[str, Method] = {
    "output-error": METHODS["output-error"],
    "output-error-white": METHODS["output-error-white"],
    "filter-error": Method(
        "filter_error_equations", "fit_equation_filter_error", "maximum likelihood, process noise"
    ),
    "extended-kalman": Method(
        "kalman_equations", "fit_extended_equations", "joint states and parameters"
    ),
}


def methods() -> dict[str, str]:
    """Return the known methods and what each is in a few words."""
    return {name: method.about for name, method in METHODS.items()}


def fit(
    method: str, model: LinearModel, maneuvers: Sequence[Maneuver], **options: object
) -> FitResult:
    """Fit a model to one or several maneuvers jointly.

    Parameters
    ----------
    method : str
        A key of `methods()`.
    model : LinearModel
        What is known and what is free.
    maneuvers : sequence of Maneuver
        Data in the columns of the model.
    **options
        Settings of the method; see its own function.

    Returns
    -------
    FitResult
        Estimate, covariance, residuals and diagnostics.

    Raises
    ------
    IdentificationError
        If the method is unknown, columns do not fit the model, an output never moved, the data
        cannot carry the fit or its answer is not finite.

    Examples
    --------
    >>> from host.sysid import fit
    >>> result = fit("output-error", model, [maneuver])  # doctest: +SKIP
    """
    if method not in METHODS:
        raise IdentificationError(f"unknown method '{method}'; known: {', '.join(METHODS)}")
    if not maneuvers:
        raise IdentificationError("no maneuver to fit: give at least one")
    known = OF_EQUATIONS if isinstance(model, NonlinearModel) else METHODS
    entry = known.get(method, METHODS[method])
    function: Callable[..., Any] = getattr(
        import_module(f"host.sysid.estimators.{entry.module}"), entry.function
    )
    _check(method, model, maneuvers)
    try:
        # Every number of the result is checked below; during the search trials may overflow.
        with np.errstate(all="ignore"):
            result: FitResult = function(model, maneuvers, **{**dict(entry.options), **options})
    except (np.linalg.LinAlgError, ZeroDivisionError) as error:
        raise IdentificationError(
            f"{method}: the equations are singular ({str(error).lower().rstrip('.')}); these data"
            f" do not determine {model.name}"
        ) from error
    refuse_unless_finite(result, method)
    return result


def refuse_unless_finite(result: FitResult, method: str) -> None:
    """Raise if a fit ran away.

    Raises
    ------
    IdentificationError
        If estimate or covariance hold a number that is none.
    """
    for label in ("estimate", "covariance", "covariance_white"):
        if not np.isfinite(getattr(result, label)).all():
            raise IdentificationError(
                f"{method}: the {label.split('_')[0]} is not finite; these data do not determine"
                f" {result.model.name}"
            )


def _check(method: str, model: LinearModel, maneuvers: Sequence[Maneuver]) -> None:
    """Raise if no method can fit: columns that do not fit the model, outputs that never move."""
    own = isinstance(model, NonlinearModel) and model.own_parameters
    if not (model.parameter_names or own):
        raise IdentificationError(f"model {model.name} has no free parameter: nothing to fit")
    if isinstance(model, NonlinearModel) and method not in OF_EQUATIONS:
        raise IdentificationError(
            f"{method} takes linear models; {model.name} has equations, which"
            f" {', '.join(OF_EQUATIONS)} take"
        )
    if model.known_noise and method not in KNOWN_NOISE:
        raise IdentificationError(f"{method} cannot hold known noise; {', '.join(KNOWN_NOISE)} can")
    if (model.known_starts or model.shared_starts) and method in OWN_STARTS:
        raise IdentificationError(
            f"{method} starts from the first samples and cannot hold known or shared initial"
            " states; output-error and filter-error can"
        )
    for maneuver in maneuvers:
        check_shapes(model, maneuver)
    span = np.max([np.ptp(m.outputs, axis=0) for m in maneuvers], axis=0)
    constant = [y for y, size in zip(model.outputs, span, strict=True) if size < NO_MOTION]
    if constant:
        raise IdentificationError(
            f"{maneuvers[0].name}: {', '.join(constant)} never moved:"
            " a dead sensor, or not connected"
        )
