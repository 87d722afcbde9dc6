"""Registry of the estimation methods.

A method is imported when it is first used. Installed packages plug in theirs by entry point; they
are looked for when methods are listed, or one is named that is not of this room.
"""

from __future__ import annotations

from host.errors import IdentificationError
from host.files.quantities import Quantity
from host.plugins import Plug, plugged_in
from host.sysid.estimators.estimation_method import Method, MethodOption, number

GROUP = "host.identification_methods"

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
