"""The aerodynamic model straight from flight, errors of the instrument beside it.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.coefficients.coefficient_estimator import (
        CoefficientAnswer,
        CoefficientEstimator,
    )
    from host.sysid.coefficients.coefficient_fit import CoefficientFit
    from host.sysid.models.coefficient_model import CoefficientModel, standard_model

__all__ = [
    "CoefficientAnswer",
    "CoefficientEstimator",
    "CoefficientFit",
    "CoefficientModel",
    "standard_model",
]

__getattr__ = lazily(
    __name__,
    {
        "CoefficientAnswer": "coefficient_estimator",
        "CoefficientEstimator": "coefficient_estimator",
        "CoefficientFit": "coefficient_fit",
        "CoefficientModel": ".models.coefficient_model",
        "standard_model": ".models.coefficient_model",
    },
)
