"""A flight log as one thing: what it holds, what it lost, how good it is."""

from host.log.flight_log import FlightLog
from host.log.reading import read_log

__all__ = ["FlightLog", "read_log"]
