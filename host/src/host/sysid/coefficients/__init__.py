"""The aerodynamic model straight from flight, errors of the instrument beside it.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.coefficients.coefficient_fit import CoefficientFit
    from host.sysid.models.coefficient_model import CoefficientModel
    from host.sysid.models.model_file import standard_model

__all__ = [
    "CoefficientAnswer",
    "CoefficientFit",
    "CoefficientModel",
    "standard_model",
]

__getattr__ = lazily(
    __name__,
    {
        "CoefficientAnswer": "coefficient_estimator",
        "CoefficientFit": "coefficient_fit",
        "CoefficientModel": "coefficient_search",
        "standard_model": "coefficient_search",
    },
)
