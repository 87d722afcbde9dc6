"""Writers of the same flight as logs of other autopilots, by the name of the format."""

from __future__ import annotations

from pathlib import Path

from host.errors import UsageError
from host.extras import install_hint
from host.twin.flight.fly import FlightRecord
from host.twin.outcome.ardupilot_log import write_ardupilot_log
from host.twin.outcome.px4_log import write_px4_log
from host.twin.sensors.local_flow import AirData

# Not `flight.BIN`: where case does not count, that is the recorder's own `flight.bin`.
NAMES = {"ulog": ".ulg", "dataflash": ".ardupilot.bin", "tlog": ".tlog"}


def write_autopilot_log(
    kind: str, record: FlightRecord, data: AirData, stem: Path, *, airframe: str
) -> Path:
    """Write a log next to the flight's other files; return its path.

    Parameters
    ----------
    kind : str
        A key of `NAMES`.
    record : FlightRecord
    data : AirData
    stem : Path
        Without ending.
    airframe : str
        One of `autopilot_outputs.AIRFRAMES`.

    Raises
    ------
    UsageError
        If a library is missing.
    OSError
        The file cannot be written.
    """
    path = stem.with_name(stem.name + NAMES[kind])
    if kind == "ulog":
        write_px4_log(record, data, path, airframe=airframe)
    elif kind == "dataflash":
        write_ardupilot_log(record, data, path, airframe=airframe)
    else:
        try:
            from host.twin.outcome.mavlink_log import write_mavlink_log
        except ModuleNotFoundError as error:
            if error.name is None or error.name.startswith("host"):
                raise
            raise UsageError(f"tlog needs {error.name}: {install_hint(error.name)}") from None
        write_mavlink_log(record, data, path, airframe=airframe)
    return path
