"""Derivatives and coefficients of each other.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.conversion.conversion_table import (
        FlightCondition,
        conversion_document,
        conversion_lines,
        convert,
        saved_values,
    )
    from host.sysid.conversion.derivative_conversion import (
        ConversionPoint,
        to_coefficients,
        to_derivatives,
    )

__all__ = [
    "ConversionPoint",
    "FlightCondition",
    "conversion_document",
    "conversion_lines",
    "convert",
    "saved_values",
    "to_coefficients",
    "to_derivatives",
]

__getattr__ = lazily(
    __name__,
    {
        "ConversionPoint": "derivative_conversion",
        "FlightCondition": "conversion_table",
        "conversion_document": "conversion_table",
        "conversion_lines": "conversion_table",
        "convert": "conversion_table",
        "saved_values": "conversion_table",
        "to_coefficients": "derivative_conversion",
        "to_derivatives": "derivative_conversion",
    },
)
