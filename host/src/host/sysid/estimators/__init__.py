"""Methods of estimation behind one door, and what a method of another package is made of.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.estimators.equation_error import fit_equation_error
    from host.sysid.estimators.estimation_method import (
        Method,
        MethodOption,
        number,
        numbers,
        one_of,
        whole_number,
    )
    from host.sysid.estimators.method_fit import fit
    from host.sysid.estimators.method_options import read_options
    from host.sysid.estimators.method_registry import methods
    from host.sysid.estimators.output_error_fit import fit_output_error
    from host.sysid.estimators.regression import regression_equations

__all__ = [
    "Method",
    "MethodOption",
    "fit",
    "fit_equation_error",
    "fit_output_error",
    "methods",
    "number",
    "numbers",
    "one_of",
    "read_options",
    "regression_equations",
    "whole_number",
]

__getattr__ = lazily(
    __name__,
    {
        "Method": "estimation_method",
        "MethodOption": "estimation_method",
        "fit": "method_fit",
        "fit_equation_error": "equation_error",
        "fit_output_error": "output_error_fit",
        "methods": "method_registry",
        "number": "estimation_method",
        "numbers": "estimation_method",
        "one_of": "estimation_method",
        "read_options": "method_options",
        "regression_equations": "regression",
        "whole_number": "estimation_method",
    },
)
