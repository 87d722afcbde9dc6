"""Dimensional derivatives and non-dimensional coefficients, at a trim and away from it.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.aerodynamics.coefficient import Coefficient, CoefficientTable
    from host.sysid.aerodynamics.coefficient_table import (
        CoefficientParts,
        ShiftedEstimate,
        coefficient_parts,
        coefficients,
    )
    from host.sysid.aerodynamics.measured_thrust import with_thrust

__all__ = [
    "Coefficient",
    "CoefficientParts",
    "CoefficientTable",
    "ShiftedEstimate",
    "coefficient_parts",
    "coefficients",
    "with_thrust",
]

__getattr__ = lazily(
    __name__,
    {
        "Coefficient": "coefficient",
        "CoefficientParts": "coefficient_table",
        "CoefficientTable": "coefficient",
        "ShiftedEstimate": "coefficient_table",
        "coefficient_parts": "coefficient_table",
        "coefficients": "coefficient_table",
        "with_thrust": "measured_thrust",
    },
)
