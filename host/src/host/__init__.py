"""Flight-test host tool: decode logs, fly virtual tests, identify the aircraft.

>>> import host
>>> log = host.read_log("flight.bin")  # doctest: +SKIP
>>> table = log.table()  # doctest: +SKIP
>>> found = host.identify("flight.bin", aircraft="ultrastick25e")  # doctest: +SKIP
"""

TYPE_CHECKING = False  # of `typing`, whose import takes longer than the rest of this file
if TYPE_CHECKING:
    from host.errors import CalibrationError, IdentificationError, LogError, NotALogError
    from host.log import FlightLog, read_log
    from host.sysid.pipeline.identification import Identification
    from host.sysid.pipeline.prediction import Prediction, predict
    from host.sysid.pipeline.stages import identify

__all__ = [
    "CalibrationError",
    "FlightLog",
    "Identification",
    "IdentificationError",
    "LogError",
    "NotALogError",
    "Prediction",
    "__version__",
    "identify",
    "predict",
    "read_log",
]
__version__ = "0.1.0"


# Loaded on first use: numpy, pandas and scipy keep `host --help` from its 0.3 s.
_HOMES = {
    "CalibrationError": "host.errors",
    "FlightLog": "host.log",
    "Identification": "host.sysid.pipeline.identification",
    "IdentificationError": "host.errors",
    "LogError": "host.errors",
    "NotALogError": "host.errors",
    "Prediction": "host.sysid.pipeline.prediction",
    "identify": "host.sysid.pipeline.stages",
    "predict": "host.sysid.pipeline.prediction",
    "read_log": "host.log",
}


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'host' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(_HOMES[name]), name)
