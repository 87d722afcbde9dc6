"""The one door of identification, and the stages behind it in their order.

`identify` reads flights, `identify_columns` takes what a program has at hand; both run the same
stages. `predict` flies a saved model over other flights.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.pipeline.flight_at_hand import FlightAtHand, at_hand, read_flight
    from host.sysid.pipeline.flight_preparation import prepare
    from host.sysid.pipeline.identification import Identification
    from host.sysid.pipeline.known_aircraft import AircraftData, aircraft_data
    from host.sysid.pipeline.prediction import Prediction, predict
    from host.sysid.pipeline.reading_options import ReadingOptions
    from host.sysid.pipeline.stages import identify, identify_columns

__all__ = [
    "AircraftData",
    "FlightAtHand",
    "Identification",
    "Prediction",
    "ReadingOptions",
    "aircraft_data",
    "at_hand",
    "identify",
    "identify_columns",
    "predict",
    "prepare",
    "read_flight",
]

__getattr__ = lazily(
    __name__,
    {
        "AircraftData": "known_aircraft",
        "FlightAtHand": "flight_at_hand",
        "Identification": "identification",
        "Prediction": "prediction",
        "ReadingOptions": "reading_options",
        "aircraft_data": "known_aircraft",
        "at_hand": "flight_at_hand",
        "identify": "stages",
        "identify_columns": "stages",
        "predict": "prediction",
        "prepare": "flight_preparation",
        "read_flight": "flight_at_hand",
    },
)
