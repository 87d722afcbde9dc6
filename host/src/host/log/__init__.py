"""A flight log: its frames and table, its losses, its quality."""

from host.log.flight_log import FlightLog
from host.log.reading import read_log

__all__ = ["FlightLog", "read_log"]
