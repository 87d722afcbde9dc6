"""What errors of instrument, sampling and trim leave open in an estimate.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.errors.one_step import one_step_of
    from host.sysid.errors.systematic_errors import (
        add_systematic_covariance,
        systematic_error_shifts,
        systematic_residuals,
    )

__all__ = [
    "add_systematic_covariance",
    "one_step_of",
    "systematic_error_shifts",
    "systematic_residuals",
]

__getattr__ = lazily(
    __name__,
    {
        "add_systematic_covariance": "systematic_errors",
        "one_step_of": "one_step",
        "systematic_error_shifts": "systematic_errors",
        "systematic_residuals": "systematic_errors",
    },
)
