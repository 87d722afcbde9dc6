"""Columns of a flight, prepared once for both estimators.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.flight.column_change import ColumnChange, changed_columns
    from host.sysid.flight.filter_step import with_filter_step
    from host.sysid.flight.flight_selection import chosen_flights
    from host.sysid.flight.flight_tables import FlightColumns, read_columns, read_flight_columns
    from host.sysid.flight.flown_maneuver import FlownManeuver, flown_maneuvers
    from host.sysid.flight.reconstructed_flight import (
        ReconstructedFlight,
        maneuver_name,
        reconstruct_flight,
    )

__all__ = [
    "ColumnChange",
    "FlightColumns",
    "FlownManeuver",
    "ReconstructedFlight",
    "changed_columns",
    "chosen_flights",
    "flown_maneuvers",
    "maneuver_name",
    "read_columns",
    "read_flight_columns",
    "reconstruct_flight",
    "with_filter_step",
]

__getattr__ = lazily(
    __name__,
    {
        "ColumnChange": "column_change",
        "FlightColumns": "flight_tables",
        "FlownManeuver": "flown_maneuver",
        "ReconstructedFlight": "reconstructed_flight",
        "changed_columns": "column_change",
        "chosen_flights": "flight_selection",
        "flown_maneuvers": "flown_maneuver",
        "maneuver_name": "reconstructed_flight",
        "read_columns": "flight_tables",
        "read_flight_columns": "flight_tables",
        "reconstruct_flight": "reconstructed_flight",
        "with_filter_step": "filter_step",
    },
)
