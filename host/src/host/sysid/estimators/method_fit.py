"""`fit(method, model, maneuvers)`: one method applied, what it cannot fit refused."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.errors import IdentificationError
from host.sysid.estimators.estimation_method import Method, loaded
from host.sysid.estimators.method_registry import METHODS, find_method, methods
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel, has_equations
from host.sysid.numerics.output_error_problem import check_shapes

NO_MOTION = 1e-30  # in any unit: an output that moves less holds nothing, and its square underflows


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
    by = find_method(method)
    if by is None:
        raise IdentificationError(f"unknown method '{method}'; known: {', '.join(methods())}")
    if not maneuvers:
        raise IdentificationError("no maneuver to fit: give at least one")
    _check(method, by, model, maneuvers)
    place = by.equations if has_equations(model) and by.equations else by.function
    try:
        # Every number of the result is checked below; during the search trials may overflow.
        with np.errstate(all="ignore"):
            result = loaded(place)(model, maneuvers, **{**by.settings, **options})
    except (np.linalg.LinAlgError, ZeroDivisionError) as error:
        raise IdentificationError(
            f"{method}: the equations are singular ({str(error).lower().rstrip('.')}); these data"
            f" do not determine {model.name}"
        ) from error
    if not isinstance(result, FitResult):
        raise IdentificationError(
            f"{method} returned a {type(result).__name__}, expected a host.sysid.FitResult"
        )
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


def _check(method: str, by: Method, model: LinearModel, maneuvers: Sequence[Maneuver]) -> None:
    """Raise if the method cannot fit the model, or no method the data."""
    _refuse_what_it_cannot_hold(method, by, model)
    for maneuver in maneuvers:
        check_shapes(model, maneuver)
    span = np.max([np.ptp(m.outputs, axis=0) for m in maneuvers], axis=0)
    constant = [y for y, size in zip(model.outputs, span, strict=True) if size < NO_MOTION]
    if constant:
        raise IdentificationError(
            f"{maneuvers[0].name}: {', '.join(constant)} never moved:"
            " a dead sensor, or not connected"
        )


def _refuse_what_it_cannot_hold(method: str, by: Method, model: LinearModel) -> None:
    """Raise if a model has what a method cannot hold, or nothing to fit."""
    own = has_equations(model) and model.own_parameters
    if not (model.parameter_names or own):
        raise IdentificationError(f"model {model.name} has no free parameter: nothing to fit")
    if has_equations(model) and by.equations is None:
        able = ", ".join(name for name, other in METHODS.items() if other.equations)
        raise IdentificationError(
            f"{method} takes linear models; {model.name} has equations, which {able} take"
        )
    if model.known_noise and not by.holds_noise:
        able = ", ".join(name for name, other in METHODS.items() if other.holds_noise)
        raise IdentificationError(f"{method} cannot hold known noise; {able} can")
    if (model.known_starts or model.shared_starts) and not by.holds_starts:
        raise IdentificationError(
            f"{method} starts from the first samples and cannot hold known or shared initial"
            " states; output-error and filter-error can"
        )
