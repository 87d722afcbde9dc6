"""Registry of the estimation methods: `fit(method, model, maneuvers)`.

A method is imported when it is first used. Installed packages plug in theirs by entry point; they
are looked for when methods are listed, or one is named that is not of this room.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.errors import IdentificationError
from host.files.quantities import Quantity
from host.plugins import Plug, plugged_in
from host.sysid.estimators.estimation_method import Method, MethodOption, loaded, number
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.nonlinear_model import NonlinearModel
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.output_error_problem import check_shapes

GROUP = "host.identification_methods"
NO_MOTION = 1e-30  # in any unit: an output that moves less holds nothing, and its square underflows

_HERE = "host.sysid.estimators"
_EQUATION_ERROR = f"{_HERE}.equation_error:fit_equation_error"
_OUTPUT_ERROR = f"{_HERE}.output_error_fit:fit_output_error"
_FILTER_ERROR = f"{_HERE}.filter_error:fit_filter_error"
_SETTLING = f"{_HERE}.settling:settling_lines"
_FORGETTING = Quantity("", 0.0, 1.0, "weight of the past per sample", above=True)

METHODS: dict[str, Method] = {
    "equation-error": Method(function=_EQUATION_ERROR, about="ordinary least squares"),
    "equation-error-weighted": Method(
        function=_EQUATION_ERROR,
        about="least squares, equations weighted by their residuals",
        settings={"variant": "weighted"},
    ),
    "equation-error-robust": Method(
        function=_EQUATION_ERROR, about="Huber M-estimate", settings={"variant": "robust"}
    ),
    "equation-error-total": Method(
        function=_EQUATION_ERROR,
        about="total least squares",
        settings={"variant": "total"},
        ties=False,
    ),
    "output-error": Method(
        function=_OUTPUT_ERROR,
        about="maximum likelihood, memory of the noise estimated",
        equations=_OUTPUT_ERROR,
        valid_in=("white", "coloured"),
        holds_noise=True,
        estimates_delays=True,
    ),
    "output-error-white": Method(
        function=_OUTPUT_ERROR,
        about="maximum likelihood for white noise, covariance corrected for colour",
        settings={"coloured_noise": False},
        equations=_OUTPUT_ERROR,
        valid_in=("white", "coloured", "gust"),  # in gusts nearly consistent, open loop
        holds_noise=True,
        estimates_delays=True,
    ),
    "filter-error": Method(
        function=_FILTER_ERROR,
        about="maximum likelihood with process noise",
        equations=_FILTER_ERROR,
        valid_in=("white", "gust"),
    ),
    "frequency-equation-error": Method(
        function=f"{_HERE}.frequency_domain:fit_frequency_equation_error",
        about="least squares on chirp-z transforms",
    ),
    "frequency-output-error": Method(
        function=f"{_HERE}.frequency_domain:fit_frequency_output_error",
        about="maximum likelihood on chirp-z transforms",
        valid_in=("white",),
    ),
    "stepwise": Method(
        function=f"{_HERE}.stepwise:fit_stepwise", about="terms chosen by partial F"
    ),
    "recursive": Method(
        function=f"{_HERE}.recursive:fit_recursive_least_squares",
        about="recursive least squares, real time",
        options=(MethodOption("forgetting", number(_FORGETTING)),),
        history=_SETTLING,
        ties=False,
    ),
    "recursive-fourier": Method(
        function=f"{_HERE}.recursive:fit_recursive_fourier",
        about="regression on running transforms, real time",
        history=_SETTLING,
    ),
    "extended-kalman": Method(
        function=f"{_HERE}.kalman:fit_extended",
        about="joint states and parameters",
        equations=f"{_HERE}.kalman_equations:fit_extended_equations",
        valid_in=("white",),
        holds_starts=False,
    ),
}


def find_method(name: str) -> Method | None:
    """Return a method by its name; None if there is none.

    Raises
    ------
    IdentificationError
        If a package plugs it in that cannot be used.
    """
    if name in METHODS:
        return METHODS[name]
    plug = plugged_in(GROUP).get(name)
    return _plugged(plug) if plug else None


def _plugged(plug: Plug) -> Method:
    found = plug.load(IdentificationError)
    if not isinstance(found, Method):
        raise IdentificationError(
            f"{plug.name}: {plug.place} is of type {type(found).__name__}, expected a"
            " host.sysid.Method"
        )
    return found


def all_methods() -> dict[str, Method]:
    """Return every method that can be used, by name; a name of this room stays this room's."""
    return {name: by for name, by in _each().items() if isinstance(by, Method)}


def methods() -> dict[str, str]:
    """Return the known methods and what each is in a few words, or why it cannot be used."""
    return {n: by.about if isinstance(by, Method) else str(by) for n, by in _each().items()}


def _each() -> dict[str, Method | IdentificationError]:
    found: dict[str, Method | IdentificationError] = dict(METHODS)
    for name, plug in plugged_in(GROUP).items():
        if name not in METHODS:
            try:
                found[name] = _plugged(plug)
            except IdentificationError as error:
                found[name] = error
    return found


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
    place = by.equations if isinstance(model, NonlinearModel) and by.equations else by.function
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
    """Raise if no method can fit: columns that do not fit the model, outputs that never move."""
    own = isinstance(model, NonlinearModel) and model.own_parameters
    if not (model.parameter_names or own):
        raise IdentificationError(f"model {model.name} has no free parameter: nothing to fit")
    if isinstance(model, NonlinearModel) and by.equations is None:
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
    for maneuver in maneuvers:
        check_shapes(model, maneuver)
    span = np.max([np.ptp(m.outputs, axis=0) for m in maneuvers], axis=0)
    constant = [y for y, size in zip(model.outputs, span, strict=True) if size < NO_MOTION]
    if constant:
        raise IdentificationError(
            f"{maneuvers[0].name}: {', '.join(constant)} never moved:"
            " a dead sensor, or not connected"
        )
