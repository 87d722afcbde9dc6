"""From an answer to gains with margins: knows answers and aircraft, no estimator."""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.control.asked import check_asked
    from host.control.autopilots.known import AUTOPILOTS
    from host.control.control_error import ControlError
    from host.control.parameter_file import read_parameters
    from host.control.releases import release_in
    from host.control.tuning import Tuning, tune

__all__ = [
    "AUTOPILOTS",
    "ControlError",
    "Tuning",
    "check_asked",
    "read_parameters",
    "release_in",
    "tune",
]

__getattr__ = lazily(
    __name__,
    {
        "AUTOPILOTS": "autopilots.known",
        "check_asked": "asked",
        "ControlError": "control_error",
        "Tuning": "tuning",
        "read_parameters": "parameter_file",
        "release_in": "releases",
        "tune": "tuning",
    },
)
