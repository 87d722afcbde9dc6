"""Flight-test host tool: decode logs, fly virtual tests, identify the aircraft.

>>> import host
>>> log = host.read_log("flight.bin")  # doctest: +SKIP
>>> table = log.table()  # doctest: +SKIP
"""

TYPE_CHECKING = False  # of `typing`, whose import takes longer than the rest of this file
if TYPE_CHECKING:
    from host.errors import CalibrationError, LogError, NotALogError
    from host.log import FlightLog, read_log

__all__ = ["CalibrationError", "FlightLog", "LogError", "NotALogError", "__version__", "read_log"]
__version__ = "0.1.0"


def __getattr__(name: str) -> object:
    # numpy and pandas are loaded on first use, so that `host --help` stays under 0.3 s.
    if name in ("FlightLog", "read_log"):
        import host.log

        return getattr(host.log, name)
    if name in ("CalibrationError", "LogError", "NotALogError"):
        import host.errors

        return getattr(host.errors, name)
    raise AttributeError(f"module 'host' has no attribute {name!r}")
