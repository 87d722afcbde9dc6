"""What is fitted to what, and what comes back.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.models.all_free import free_model
    from host.sysid.models.equation_file import equations_from
    from host.sysid.models.fit_result import FitResult
    from host.sysid.models.maneuver import Maneuver
    from host.sysid.models.model_file import model_from, read_model
    from host.sysid.models.nonlinear_model import NonlinearModel
    from host.sysid.models.state_space_model import LinearModel, Parameter, Term
    from host.sysid.models.templates import Trim, template

__all__ = [
    "FitResult",
    "LinearModel",
    "Maneuver",
    "NonlinearModel",
    "Parameter",
    "Term",
    "Trim",
    "equations_from",
    "free_model",
    "model_from",
    "read_model",
    "template",
]

__getattr__ = lazily(
    __name__,
    {
        "FitResult": "fit_result",
        "LinearModel": "state_space_model",
        "Maneuver": "maneuver",
        "NonlinearModel": "nonlinear_model",
        "Parameter": "state_space_model",
        "Term": "state_space_model",
        "Trim": "templates",
        "equations_from": "equation_file",
        "free_model": "all_free",
        "model_from": "model_file",
        "read_model": "model_file",
        "template": "templates",
    },
)
