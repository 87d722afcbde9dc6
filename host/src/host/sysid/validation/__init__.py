"""Unseen data predicted: how far a right model may miss.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.validation.free_simulation import free_responses, free_runs
    from host.sysid.validation.noise_model_limits import random_errors
    from host.sysid.validation.prediction_limits import Prediction
    from host.sysid.validation.window_prediction import window_errors

__all__ = [
    "Prediction",
    "free_responses",
    "free_runs",
    "random_errors",
    "window_errors",
]

__getattr__ = lazily(
    __name__,
    {
        "Prediction": "prediction_limits",
        "free_responses": "free_simulation",
        "free_runs": "free_simulation",
        "random_errors": "noise_model_limits",
        "window_errors": "window_prediction",
    },
)
