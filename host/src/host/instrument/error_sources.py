"""What each error belongs to: an aircraft type, an aircraft file, an instrument or one flight.

Flights read with one calibration share its errors, and flights of one aircraft file share its
tolerances. Averaging such flights does not reduce these errors.
"""

from __future__ import annotations

from host.instrument.instrument_errors import InstrumentErrors

AIRCRAFT_FILE, INSTRUMENT, FLIGHT = "aircraft file", "instrument", "flight"
TYPE = "type"
# Arms of control forces and the sidewash of ailerons are the same in every aircraft of a type.
_OF_TYPE = ("elevator_arm_share", "rudder_arm_share", "sidewash_share")
# Error in `deviations` -> error in `standard.toml` that it follows from.
_MADE_OF = {
    "mass_share": "mass_share",
    **{f"i{axis}{axis}_share": "inertia_share" for axis in "xyz"},
    **{f"cg_{axis}_m": "cg_m" for axis in "xyz"},
    **{f"imu_{axis}_m": "place_m" for axis in "xyz"},
    **{f"gyro_{axis}_scale": "gyro_scale" for axis in "xyz"},
    **{f"gyro_{axis}_bias_radps": "gyro_bias_radps" for axis in "xyz"},
    **{f"accel_{axis}_scale": "accel_scale" for axis in "xyz"},
    **{f"accel_{axis}_bias_mps2": "accel_bias_mps2" for axis in "xyz"},
    **{f"tilt_{axis}_rad": "misalignment_rad" for axis in "xyz"},
    "vane_x_m": "place_m", "vane_z_m": "place_m", "upwash_share": "upwash_share",
    "alpha_zero_rad": "vane_zero_rad", "pitot_drift_pa": "pitot_zero_pa",
    "density_share": "density_share",
}  # fmt: skip


def error_source(name: str, errors: InstrumentErrors) -> str:
    """Return what an error belongs to: `TYPE`, `AIRCRAFT_FILE`, `INSTRUMENT` or `FLIGHT`.

    Parameters
    ----------
    name : str
        A name in `host.instrument.deviations.deviations`.
    errors : InstrumentErrors
        Errors of the flight. A name that they do not have belongs to the instrument.
    """
    if name in _OF_TYPE:
        return TYPE
    made_of = _MADE_OF.get(name, name)
    if made_of not in errors.named:
        return INSTRUMENT
    error = errors[made_of]
    if error.aircraft_file:
        return AIRCRAFT_FILE
    return FLIGHT if error.drawn == "flight" else INSTRUMENT
