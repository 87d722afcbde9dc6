"""Size of every error in a flight, where it comes from, and what the error belongs to.

Flights read with one calibration share its errors, and flights of one aircraft file share its
tolerances. Averaging such flights does not reduce these errors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from host.aircraft.mass_properties import AirframeData
from host.instrument.deviations import POTS, VANES, SensorErrorModel, deviations
from host.instrument.error_list import NOT_PAID, ErrorKind, error_kinds
from host.instrument.instrument_errors import InstrumentErrors

AIRCRAFT_FILE, INSTRUMENT, FLIGHT = "aircraft file", "instrument", "flight"
TYPE = "type"
ASSUMED = "assumed of this flight"  # because its columns lack what would tell
# Relations of a drawing are the same in every aircraft of a type.
_OF_TYPE = (
    "elevator_arm_share", "rudder_arm_share", "sidewash_share", "pitching_drag_share",
)  # fmt: skip
# Error of the list -> error of `standard.toml` that it follows from, and its sensors there; of
# several the first one named. Names that are alike in both are left out.
_MADE_OF: dict[str, tuple[str, tuple[str, ...]]] = {
    **{f"i{axis}{axis}_share": ("inertia_share", (axis,)) for axis in "xyz"},
    **{f"cg_{axis}_m": ("cg_m", (axis,)) for axis in "xyz"},
    **{f"imu_{axis}_m": ("place_m", ("imu",)) for axis in "xyz"},
    **{f"vane_{axis}_m": ("place_m", ("vane_a", "vane_b")) for axis in "xz"},
    **{f"gyro_{axis}_scale": ("gyro_scale", (axis,)) for axis in "xyz"},
    **{f"gyro_{axis}_bias_radps": ("gyro_bias_radps", (axis,)) for axis in "xyz"},
    **{f"accel_{axis}_scale": ("accel_scale", (axis,)) for axis in "xyz"},
    **{f"accel_{axis}_bias_mps2": ("accel_bias_mps2", (axis,)) for axis in "xyz"},
    **{f"imu_tilt_{axis}_rad": ("misalignment_rad", (axis,)) for axis in "xyz"},
    **{f"{flow}_scale": ("vane_scale", vanes) for flow, vanes in VANES.items()},
    **{f"{flow}_zero_rad": ("vane_zero_rad", vanes) for flow, vanes in VANES.items()},
    **{f"{flow}_lag_share": ("delay_share", vanes) for flow, vanes in VANES.items()},
    **{f"{surface}_scale": ("pot_scale", pots) for surface, pots in POTS.items()},
    **{f"{surface}_servo_scale": ("servo_scale", (surface,)) for surface in POTS},
    "imu_delay_s": ("delay_least_s", ("imu",)),
    "pitot_delay_s": ("delay_least_s", ("dp_a", "dp_b")),
    "vane_delay_s": ("delay_share", VANES["alpha"]),
    "friction_share": ("vane_friction_share", ()),
    "airspeed_share": ("pitot_scale", ()),
    "clock_share": ("clock_share", ("mega",)),
}


@dataclass(frozen=True, slots=True)
class ErrorSource:
    """An error of one flight: its kind, one standard deviation, and where that comes from.

    Attributes
    ----------
    name : str
        Ends in the unit of `deviation`; a share or scale has none.
    deviation : float
        One standard deviation.
    origin : str
        Where the deviation comes from: calibration file, aircraft file, a default with its source,
        or what the flight itself left of it.
    belongs_to : str
        `TYPE`, `AIRCRAFT_FILE`, `INSTRUMENT` or `FLIGHT`: who has the error in common.
    kind : ErrorKind
    """

    name: str
    deviation: float
    origin: str
    belongs_to: str
    kind: ErrorKind

    def document(self) -> dict[str, Any]:
        """Return it for programs."""
        return {"name": self.name, "deviation": self.deviation, "origin": self.origin}


def errors_by_file(
    instrument: SensorErrorModel,
    airframe: AirframeData,
    assumed: Mapping[str, float] | None = None,
) -> tuple[ErrorSource, ...]:
    """Return the errors that calibration and aircraft file leave open, as coefficients pay them.

    Parameters
    ----------
    instrument : SensorErrorModel
    airframe : AirframeData
        Gives tolerances of mass and inertia.
    assumed : mapping, optional
        Standard deviations of errors that are larger than the instrument's.
    """
    sizes = deviations(instrument, airframe)
    larger = {n: least for n, least in (assumed or {}).items() if least > sizes[n]}
    listed = error_sources(sizes | larger, instrument, dict.fromkeys(larger, ASSUMED))
    return tuple(e for e in listed if e.kind.coefficients != NOT_PAID)


def error_sources(
    sizes: Mapping[str, float],
    instrument: SensorErrorModel,
    origins: Mapping[str, str] | None = None,
) -> tuple[ErrorSource, ...]:
    """Return errors of the list with their standard deviations.

    Parameters
    ----------
    sizes : mapping
        Name to one standard deviation. A name that the list does not have raises `KeyError`.
    instrument : SensorErrorModel
        Tells where each comes from and what it belongs to.
    origins : mapping, optional
        Name to origin, where a deviation is not the instrument's own.
    """
    kinds, errors, own = error_kinds(), instrument.errors, origins or {}
    return tuple(
        ErrorSource(
            name,
            size,
            own.get(name) or error_origin(name, errors),
            error_owner(name, errors),
            kinds[name],
        )
        for name, size in sizes.items()
    )


def error_origin(name: str, errors: InstrumentErrors) -> str:
    """Return where the deviation of an error of the list comes from, a default with its source."""
    made_of, sensors = _MADE_OF.get(name, (name, ()))
    return errors[made_of].origin(*sensors)


def error_owner(name: str, errors: InstrumentErrors) -> str:
    """Return what an error belongs to: `TYPE`, `AIRCRAFT_FILE`, `INSTRUMENT` or `FLIGHT`.

    Parameters
    ----------
    name : str
        A name of the list.
    errors : InstrumentErrors
        Errors of the flight. A name that they do not have belongs to the instrument.
    """
    if name in _OF_TYPE:
        return TYPE
    made_of, _ = _MADE_OF.get(name, (name, ()))
    if made_of not in errors.named:
        return INSTRUMENT
    error = errors[made_of]
    if error.aircraft_file:
        return AIRCRAFT_FILE
    return FLIGHT if error.drawn == "flight" else INSTRUMENT
