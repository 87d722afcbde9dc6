"""What errors of instrument, sampling and trim leave open in an estimate.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.errors.error_list import (
        ErrorSource,
        by_cause,
        error_kinds,
        error_sources,
        errors_by_file,
    )
    from host.sysid.errors.systematic_errors import (
        add_systematic_covariance,
        systematic_error_shifts,
        systematic_residuals,
    )

__all__ = [
    "ErrorSource",
    "add_systematic_covariance",
    "by_cause",
    "error_kinds",
    "error_sources",
    "errors_by_file",
    "systematic_error_shifts",
    "systematic_residuals",
]

__getattr__ = lazily(
    __name__,
    {
        "ErrorSource": "error_list",
        "add_systematic_covariance": "systematic_errors",
        "by_cause": "error_list",
        "error_kinds": "error_list",
        "error_sources": "error_list",
        "errors_by_file": "error_list",
        "systematic_error_shifts": "systematic_errors",
        "systematic_residuals": "systematic_errors",
    },
)
