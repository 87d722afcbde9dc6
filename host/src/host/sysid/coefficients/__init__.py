"""The aerodynamic model straight from flight, with errors of the instrument.

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
    from host.sysid.coefficients.coefficient_search import fit_coefficients
    from host.sysid.coefficients.window_spectra import (
        ResidualSpectra,
        Window,
        WindowTransform,
        window_transform,
    )
    from host.sysid.models.coefficient_model import CoefficientModel, standard_model

__all__ = [
    "CoefficientAnswer",
    "CoefficientEstimator",
    "CoefficientFit",
    "CoefficientModel",
    "ResidualSpectra",
    "Window",
    "WindowTransform",
    "fit_coefficients",
    "standard_model",
    "window_transform",
]

__getattr__ = lazily(
    __name__,
    {
        "CoefficientAnswer": "coefficient_estimator",
        "CoefficientEstimator": "coefficient_estimator",
        "CoefficientFit": "coefficient_fit",
        "CoefficientModel": ".models.coefficient_model",
        "ResidualSpectra": "window_spectra",
        "Window": "window_spectra",
        "WindowTransform": "window_spectra",
        "fit_coefficients": "coefficient_search",
        "standard_model": ".models.coefficient_model",
        "window_transform": "window_spectra",
    },
)
