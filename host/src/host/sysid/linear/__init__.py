"""Linear models of a flight: fitted, their intervals, validated.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.linear.linear_answer import Answer
    from host.sysid.linear.linear_estimator import LinearEstimator
    from host.sysid.linear.linear_model import AXIS_OF, DEFAULT_METHOD, STAGED
    from host.sysid.linear.linear_stages import LinearEstimate

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
        "AXIS_OF": "linear_model",
        "DEFAULT_METHOD": "linear_model",
        "STAGED": "linear_model",
        "Answer": "linear_answer",
        "LinearEstimate": "linear_stages",
        "LinearEstimator": "linear_estimator",
    },
)
