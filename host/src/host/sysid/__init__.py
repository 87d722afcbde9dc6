"""System identification: from a maneuver to a model with honest uncertainties.

The front door is `fit(method, model, maneuvers)`; a `LinearModel` says what is known and what is
free, a `Maneuver` holds the samples, a `FitResult` is the answer of every method alike.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.estimators.estimation_method import Method, MethodOption, number
    from host.sysid.estimators.method_fit import fit
    from host.sysid.estimators.method_registry import methods
    from host.sysid.models.fit_result import FitResult
    from host.sysid.models.maneuver import Maneuver
    from host.sysid.models.state_space_model import LinearModel, Parameter, Term

__all__ = [
    "FitResult",
    "LinearModel",
    "Maneuver",
    "Method",
    "MethodOption",
    "Parameter",
    "Term",
    "fit",
    "methods",
    "number",
]

__getattr__ = lazily(
    __name__,
    {
        "FitResult": "models.fit_result",
        "LinearModel": "models.state_space_model",
        "Maneuver": "models.maneuver",
        "Method": "estimators.estimation_method",
        "MethodOption": "estimators.estimation_method",
        "Parameter": "models.state_space_model",
        "Term": "models.state_space_model",
        "fit": "estimators.method_fit",
        "methods": "estimators.method_registry",
        "number": "estimators.estimation_method",
    },
)
