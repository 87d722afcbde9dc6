"""One list of errors of instrument, aircraft, clock, servos and air, read by both estimators.

Each error has one name, the words people read, and how it changes data or model. Which estimator
pays it, and how, stands here too; how large it is in a flight, and why: `error_sources.py`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cache

# How an error changes data: a column's scale, its zero, its time, the axes or place it is read at.
SCALE, ZERO, TIME, AXES, PLACE = "scale", "zero", "time", "axes", "place"
# Or the model: mass properties, thrust, the drawing that control forces are placed by.
MASS, THRUST, GEOMETRY = "mass", "thrust", "geometry"
MODEL_CHANGES = (MASS, THRUST, GEOMETRY)
# How an estimator pays: as a consider parameter, as an unknown with a prior, or where derivatives
# become coefficients.
CONSIDERED, ESTIMATED, CONVERTED, NOT_PAID = "considered", "estimated", "converted", "not paid"
# What an error changes where derivatives become coefficients: what several change, its own
# quantity, or nothing.
QBAR, VANE, OWN, FIXED = "dynamic pressure", "vanes", "own", ""


@dataclass(frozen=True, slots=True)
class ErrorKind:
    """What is the same of an error in every flight.

    Attributes
    ----------
    label : str
        In words.
    cause : str
        Under which coefficients name it as what widens them; those that no flight tells apart have
        one in common. Empty: it is not named.
    conversion : str
        What it changes where derivatives become coefficients: `QBAR`, `VANE`, `OWN` or `FIXED`.
    change : str
        What it changes: `SCALE`, `ZERO`, `TIME`, `AXES`, `PLACE` of data; `MASS`, `THRUST` or
        `GEOMETRY` of the model.
    linear, coefficients : str
        How each estimator pays it: `CONSIDERED`, `ESTIMATED`, `CONVERTED` or `NOT_PAID`.
    """

    label: str
    cause: str
    conversion: str
    change: str
    linear: str
    coefficients: str

    @property
    def changes_data(self) -> bool:
        """Whether corrected signals depend on it."""
        return self.change not in MODEL_CHANGES


@cache
def error_kinds() -> Mapping[str, ErrorKind]:
    """Return the kind of every error that an estimator may pay, by name."""
    return {
        name.format(axis): ErrorKind(label.format(axis), *kind)
        for name, label, *kind in _ROWS
        for axis in ("xyz" if "{}" in name else "-")
    }


def error_label(name: str) -> str:
    """Return an error in words; its name if the list does not have it."""
    kind = error_kinds().get(name)
    return name if kind is None else kind.label


def conversion_cause(name: str) -> str:
    """Return the cause that a converted coefficient names: what an error changes, or itself."""
    kind = error_kinds().get(name)
    if kind is None:
        return name
    return kind.conversion if kind.conversion in {QBAR, VANE} else kind.label


@cache
def conversion_errors() -> tuple[str, ...]:
    """Return the errors that a conversion between derivatives and coefficients considers.

    No table of derivatives states thrust, so its error is not among them.
    """
    return tuple(n for n, k in error_kinds().items() if k.conversion != FIXED)


def by_cause(names: Collection[str]) -> dict[str, tuple[str, ...]]:
    """Return these errors under the causes that coefficients name, in the order of the list."""
    found: dict[str, tuple[str, ...]] = {}
    for name, kind in error_kinds().items():
        if kind.cause and name in names:
            found[kind.cause] = (*found.get(kind.cause, ()), name)
    return found


# Name, label, cause, conversion, change, how linear models and how coefficients pay; {} is an axis.
# Considered by coefficients: a vane's lag of 0.5 ms looks like an arm of 8 mm, and estimating the
# arm biased CL_de by 15 % and CY_beta by 11 % (simulated flights, seeds 300-303). Pitot and density
# stay as calibrated too: the flight determines them no better, and estimating them biased CL_alpha
# by 0.5 % and CD_0 (seeds 900-939). A delay of the servos looks like one of IMU and vanes, and
# nothing tells the clock alone.
_X, _Y, _Z = (f"place of CG and IMU along {axis}" for axis in "xyz")
_TILT_X, _TILT_Y, _TILT_Z = "IMU tilt about x", "IMU tilt and vane zero about y", "IMU tilt about z"
_FLOW, _VANES = "vane scale and upwash", "places of the vanes"
_FORCE, _FORCES = "accelerometer along {}", "zeros of the accelerometers"
_POTS, _SERVOS = "surface pots", "servos"
_ROWS: tuple[tuple[str, str, str, str, str, str, str], ...] = (
    ("cg_x_m", "place of the CG along x", _X, OWN, PLACE, CONSIDERED, CONSIDERED),
    ("imu_x_m", "place of the IMU along x", _X, FIXED, PLACE, CONSIDERED, CONSIDERED),
    ("mass_share", "mass", "mass", OWN, MASS, CONVERTED, ESTIMATED),
    ("ixx_share", "Ixx", "Ixx", OWN, MASS, CONVERTED, CONSIDERED),
    ("iyy_share", "Iyy", "Iyy", OWN, MASS, CONVERTED, CONSIDERED),
    ("izz_share", "Izz", "Izz", OWN, MASS, CONVERTED, CONSIDERED),
    ("cg_y_m", "place of the CG along y", _Y, FIXED, PLACE, CONSIDERED, ESTIMATED),
    ("imu_y_m", "place of the IMU along y", _Y, FIXED, PLACE, CONSIDERED, ESTIMATED),
    ("cg_z_m", "place of the CG along z", _Z, OWN, PLACE, CONSIDERED, ESTIMATED),
    ("imu_z_m", "place of the IMU along z", _Z, FIXED, PLACE, CONSIDERED, ESTIMATED),
    ("imu_tilt_x_rad", "tilt of the IMU about x", _TILT_X, FIXED, AXES, CONSIDERED, ESTIMATED),
    ("imu_tilt_y_rad", "tilt of the IMU about y", _TILT_Y, FIXED, AXES, CONSIDERED, ESTIMATED),
    ("alpha_zero_rad", "zero of the alpha vane", _TILT_Y, FIXED, ZERO, CONSIDERED, ESTIMATED),
    ("imu_tilt_z_rad", "tilt of the IMU about z", _TILT_Z, FIXED, AXES, CONSIDERED, ESTIMATED),
    ("beta_zero_rad", "zero of the beta vane", "", FIXED, ZERO, CONSIDERED, NOT_PAID),
    ("alpha_scale", "scale of the alpha vane", _FLOW, VANE, SCALE, CONSIDERED, ESTIMATED),
    ("beta_scale", "scale of the beta vane", _FLOW, VANE, SCALE, CONSIDERED, ESTIMATED),
    ("upwash_share", "upwash", _FLOW, VANE, SCALE, CONVERTED, ESTIMATED),
    ("vane_x_m", "place of the vanes along x", _VANES, FIXED, PLACE, CONSIDERED, ESTIMATED),
    ("vane_z_m", "place of the vanes along z", _VANES, FIXED, PLACE, CONSIDERED, ESTIMATED),
    ("pitot_scale", "scale of the pitot", "pitot", QBAR, SCALE, CONSIDERED, CONSIDERED),
    ("pitot_zero_pa", "zero of the pitot", "pitot", QBAR, ZERO, CONSIDERED, CONSIDERED),
    ("density_share", "density", "", QBAR, SCALE, CONSIDERED, CONSIDERED),
    ("accel_{}_bias_mps2", f"zero of the {_FORCE}", _FORCES, FIXED, ZERO, CONSIDERED, ESTIMATED),
    ("accel_{}_scale", f"scale of the {_FORCE}", "", FIXED, SCALE, CONSIDERED, ESTIMATED),
    ("gyro_{}_bias_radps", "zero of the gyro about {}", "", FIXED, ZERO, CONSIDERED, ESTIMATED),
    ("gyro_{}_scale", "scale of the gyro about {}", "", FIXED, SCALE, CONSIDERED, ESTIMATED),
    ("thrust_share", "thrust", "thrust", FIXED, THRUST, CONVERTED, ESTIMATED),
    ("elevator_scale", "pot of the elevator", _POTS, OWN, SCALE, CONSIDERED, ESTIMATED),
    ("aileron_scale", "pot of the ailerons", _POTS, OWN, SCALE, CONSIDERED, ESTIMATED),
    ("rudder_scale", "pot of the rudder", _POTS, OWN, SCALE, CONSIDERED, ESTIMATED),
    ("elevator_servo_scale", "servo of the elevator", _SERVOS, FIXED, SCALE, CONSIDERED, ESTIMATED),
    ("aileron_servo_scale", "servos of the ailerons", _SERVOS, FIXED, SCALE, CONSIDERED, ESTIMATED),
    ("rudder_servo_scale", "servo of the rudder", _SERVOS, FIXED, SCALE, CONSIDERED, ESTIMATED),
    ("servo_delay_s", "delay of the servos", _SERVOS, FIXED, TIME, CONSIDERED, CONSIDERED),
    ("clock_share", "clock", "clock", FIXED, TIME, CONSIDERED, CONSIDERED),
    ("imu_delay_s", "delay of the IMU", "", FIXED, TIME, CONSIDERED, ESTIMATED),
    ("pitot_delay_s", "delay of the pitot", "", FIXED, TIME, CONSIDERED, ESTIMATED),
    ("vane_delay_s", "delay of the vanes", "", FIXED, TIME, CONSIDERED, NOT_PAID),
    ("alpha_lag_share", "lag of the alpha vane", "", FIXED, TIME, NOT_PAID, ESTIMATED),
    ("beta_lag_share", "lag of the beta vane", "", FIXED, TIME, NOT_PAID, ESTIMATED),
    ("friction_share", "friction of the vanes", "", FIXED, SCALE, CONSIDERED, ESTIMATED),
    ("airspeed_share", "scale of the airspeed", "", FIXED, SCALE, CONSIDERED, NOT_PAID),
    ("elevator_arm_share", "arm of the elevator's force", "", FIXED, GEOMETRY, NOT_PAID, ESTIMATED),
    ("rudder_arm_share", "arm of the rudder's force", "", FIXED, GEOMETRY, NOT_PAID, ESTIMATED),
    ("sidewash_share", "sidewash of the ailerons", "", FIXED, GEOMETRY, NOT_PAID, ESTIMATED),
    ("pitching_drag_share", "drag of pitching", "", FIXED, GEOMETRY, NOT_PAID, ESTIMATED),
)  # fmt: skip
