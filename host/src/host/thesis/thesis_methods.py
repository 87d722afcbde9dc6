"""What of the thesis is plugged into `host.identify`: its methods, its printed models."""

from __future__ import annotations

from pathlib import Path

from host.files.quantities import Quantity
from host.sysid.estimators import Method, MethodOption, number, numbers, one_of, whole_number

MODELS = Path(__file__).with_name("models")

_SIZE = Quantity("", -1e12, 1e12, "the thesis has -200 to 200")
_GAIN = Quantity("", 0.0, 1e6, "the thesis has 1e-3, its program 1e-5", above=True)
_COUNT = Quantity("", 1.0, 1e8, "the thesis has 200 000")
_LAMBDA = MethodOption("lambda", number(_GAIN), "lambda_")
_RHO = MethodOption("rho", numbers(_SIZE))
_ITERATIONS = MethodOption("iterations", whole_number(_COUNT))
_START = MethodOption("start", one_of(("least-squares", "model", "zero")))

_NETWORK = "host.thesis.hopfield:fit_hopfield"
_SETTLING = "host.sysid.estimators.settling:settling_lines"

HOPFIELD = Method(
    function=_NETWORK,
    about="the printed network iteration",
    options=(_LAMBDA, _RHO, _ITERATIONS, _START),
    history=_SETTLING,
)
LINE_SEARCH = Method(
    function=_NETWORK,
    about="the original program",
    settings={"variant": "line-search"},
    options=(_LAMBDA, _RHO, _ITERATIONS, _START),
    history="host.thesis.search_lines:search_lines",
)
WHITENED = Method(
    function=_NETWORK,
    about="the network, preconditioned",
    settings={"variant": "whitened"},
    options=(_ITERATIONS, _START),
    history=_SETTLING,
)
GENETIC = Method(
    function="host.thesis.genetic:fit_genetic",
    about="differential evolution, polished",
    valid_in=("white",),
)
NEURAL = Method(
    function="host.thesis.neural_delta:fit_neural",
    about="derivatives of a trained network",
    ties=False,
)
UNSCENTED = Method(
    function="host.thesis.unscented:fit_unscented",
    about="joint states and parameters, sigma points",
    valid_in=("white",),
    holds_starts=False,
)
