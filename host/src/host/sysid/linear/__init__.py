"""Linear models of a flight: fitted, their intervals, validated.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.linear.linear_answer import Answer
    from host.sysid.linear.linear_estimator import LinearEstimator
    from host.sysid.linear.linear_stages import LinearEstimate
    from host.sysid.linear.model_names import AXIS_OF, DEFAULT_METHOD, STAGED

__all__ = [
    "AXIS_OF",
    "DEFAULT_METHOD",
    "STAGED",
    "Answer",
    "LinearEstimate",
    "LinearEstimator",
]

__getattr__ = lazily(
    __name__,
    {
        "AXIS_OF": "model_names",
        "DEFAULT_METHOD": "model_names",
        "STAGED": "model_names",
        "Answer": "linear_answer",
        "LinearEstimate": "linear_stages",
        "LinearEstimator": "linear_estimator",
    },
)
