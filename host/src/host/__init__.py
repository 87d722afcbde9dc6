"""Flight-test host tool: decode logs, fly virtual tests, identify the aircraft.

>>> import host
>>> log = host.read_log("flight.bin")  # doctest: +SKIP
>>> table = log.table()  # doctest: +SKIP
>>> found = host.identify("flight.bin", aircraft="ultrastick25e")  # doctest: +SKIP
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.control import Tuning, tune
    from host.errors import CalibrationError, IdentificationError, LogError, NotALogError
    from host.log import FlightLog, read_log
    from host.sysid.pipeline import Identification, Prediction, identify, predict

__all__ = [
    "CalibrationError",
    "FlightLog",
    "Identification",
    "IdentificationError",
    "LogError",
    "NotALogError",
    "Prediction",
    "Tuning",
    "__version__",
    "identify",
    "predict",
    "read_log",
    "tune",
]
__version__ = "0.1.0"


# Loaded on first use: numpy, pandas and scipy keep `host --help` from its 0.3 s.
__getattr__ = lazily(
    __name__,
    {
        "CalibrationError": "errors",
        "FlightLog": "log",
        "Identification": "sysid.pipeline.identification",
        "IdentificationError": "errors",
        "LogError": "errors",
        "NotALogError": "errors",
        "Prediction": "sysid.pipeline.prediction",
        "Tuning": "control.tuning",
        "identify": "sysid.pipeline.stages",
        "predict": "sysid.pipeline.prediction",
        "read_log": "log",
        "tune": "control.tuning",
    },
)


def __dir__() -> list[str]:
    return __all__
