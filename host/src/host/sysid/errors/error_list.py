"""One list of errors of instrument, aircraft, clock, servos and air, read by both estimators.

Each error has a name, one standard deviation, what it belongs to, and how it changes data or model.
Which estimator pays it, and how, stands here too.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cache

from host.aircraft.mass_properties import AirframeData
from host.instrument.deviations import SensorErrorModel, deviations
from host.instrument.error_sources import INSTRUMENT, error_source
from host.physical.recording import SURFACES

# How an error changes data: a column's scale, its zero, its time, the axes or place it is read at.
SCALE, ZERO, TIME, AXES, PLACE = "scale", "zero", "time", "axes", "place"
# Or the model: mass properties, thrust, the drawing that control forces are placed by.
MASS, THRUST, GEOMETRY = "mass", "thrust", "geometry"
MODEL_CHANGES = (MASS, THRUST, GEOMETRY)
# How an estimator pays: as a consider parameter (`models/consider_covariance.py`), as an unknown
# with a prior, or where derivatives become coefficients (`aerodynamics/coefficient_table.py`).
CONSIDERED, ESTIMATED, CONVERTED, NOT_PAID = "considered", "estimated", "converted", "not paid"


@dataclass(frozen=True, slots=True)
class ErrorKind:
    """What is the same of an error in every flight.

    Attributes
    ----------
    cause : str
        Under which coefficients name it as what widens them; those that no flight tells apart have
        one in common. Empty: it is not named.
    change : str
        What it changes: `SCALE`, `ZERO`, `TIME`, `AXES`, `PLACE` of data; `MASS`, `THRUST` or
        `GEOMETRY` of the model.
    linear, coefficients : str
        How each estimator pays it: `CONSIDERED`, `ESTIMATED`, `CONVERTED` or `NOT_PAID`.
    """

    cause: str
    change: str
    linear: str
    coefficients: str

    @property
    def changes_data(self) -> bool:
        """Whether corrected signals depend on it."""
        return self.change not in MODEL_CHANGES


@dataclass(frozen=True, slots=True)
class ErrorSource:
    """An error of one flight: its kind, one standard deviation, and what it belongs to.

    Attributes
    ----------
    name : str
        Ends in the unit of `deviation`; a share or scale has none.
    deviation : float
        One standard deviation.
    origin : str
        Of `host.instrument.error_sources`: aircraft type, aircraft file, instrument or flight.
    kind : ErrorKind
    """

    name: str
    deviation: float
    origin: str
    kind: ErrorKind


def _axes(pattern: str) -> tuple[str, ...]:
    return tuple(pattern.format(axis) for axis in "xyz")


def _surfaces(pattern: str) -> tuple[str, ...]:
    return tuple(pattern.format(surface) for surface in SURFACES)


# Names, cause, change, how the linear estimator and how that of coefficients pays.
# Considered by coefficients: a vane's lag of 0.5 ms looks like an arm of 8 mm, and estimating the
# arm biased CL_de by 15 % and CY_beta by 11 % (simulated flights, seeds 300-303). Pitot and density
# stay as calibrated too: the flight determines them no better, and estimating them biased CL_alpha
# by 0.5 % and CD_0 (seeds 900-939). A delay of the servos looks like one of IMU and vanes, and
# nothing tells the clock alone.
_ROWS: tuple[tuple[tuple[str, ...], str, str, str, str], ...] = (
    (("cg_x_m", "imu_x_m"), "place of CG and IMU along x", PLACE, CONSIDERED, CONSIDERED),
    (("mass_share",), "mass", MASS, CONVERTED, ESTIMATED),
    (("ixx_share",), "Ixx", MASS, CONVERTED, CONSIDERED),
    (("iyy_share",), "Iyy", MASS, CONVERTED, CONSIDERED),
    (("izz_share",), "Izz", MASS, CONVERTED, CONSIDERED),
    (("cg_y_m", "imu_y_m"), "place of CG and IMU along y", PLACE, CONSIDERED, ESTIMATED),
    (("cg_z_m", "imu_z_m"), "place of CG and IMU along z", PLACE, CONSIDERED, ESTIMATED),
    (_axes("imu_tilt_{}_rad"), "", AXES, CONSIDERED, NOT_PAID),
    (("tilt_x_rad",), "IMU tilt about x", AXES, NOT_PAID, ESTIMATED),
    (("tilt_y_rad",), "IMU tilt and vane zero about y", AXES, NOT_PAID, ESTIMATED),
    (("alpha_zero_rad",), "IMU tilt and vane zero about y", ZERO, CONSIDERED, ESTIMATED),
    (("tilt_z_rad",), "IMU tilt about z", AXES, NOT_PAID, ESTIMATED),
    (("beta_zero_rad",), "", ZERO, CONSIDERED, NOT_PAID),
    (("alpha_scale", "beta_scale"), "vane scale and upwash", SCALE, CONSIDERED, ESTIMATED),
    (("upwash_share",), "vane scale and upwash", SCALE, CONVERTED, ESTIMATED),
    (("vane_x_m", "vane_z_m"), "places of the vanes", PLACE, CONSIDERED, ESTIMATED),
    (("pitot_scale",), "pitot", SCALE, CONSIDERED, CONSIDERED),
    (("pitot_zero_pa",), "", ZERO, CONSIDERED, NOT_PAID),
    (("pitot_drift_pa",), "pitot", ZERO, NOT_PAID, CONSIDERED),
    (("density_share",), "", SCALE, CONSIDERED, CONSIDERED),
    (_axes("accel_bias_{}_mps2"), "", ZERO, CONSIDERED, NOT_PAID),
    (_axes("accel_{}_bias_mps2"), "zeros of the accelerometers", ZERO, NOT_PAID, ESTIMATED),
    (_axes("accel_scale_{}"), "", SCALE, CONSIDERED, NOT_PAID),
    (_axes("accel_{}_scale"), "", SCALE, NOT_PAID, ESTIMATED),
    (_axes("gyro_bias_{}_radps"), "", ZERO, CONSIDERED, NOT_PAID),
    (_axes("gyro_{}_bias_radps"), "", ZERO, NOT_PAID, ESTIMATED),
    (_axes("gyro_scale_{}"), "", SCALE, CONSIDERED, NOT_PAID),
    (_axes("gyro_{}_scale"), "", SCALE, NOT_PAID, ESTIMATED),
    (("thrust_share",), "thrust", THRUST, CONVERTED, ESTIMATED),
    (_surfaces("{}_scale"), "surface pots", SCALE, CONSIDERED, ESTIMATED),
    (_surfaces("{}_servo_scale"), "servos", SCALE, CONSIDERED, ESTIMATED),
    (("servo_delay_s",), "servos", TIME, CONSIDERED, CONSIDERED),
    (("clock_share",), "clock", TIME, CONSIDERED, CONSIDERED),
    (("imu_delay_s",), "", TIME, CONSIDERED, ESTIMATED),
    (("pitot_delay_s",), "", TIME, CONSIDERED, ESTIMATED),
    (("vane_delay_s",), "", TIME, CONSIDERED, NOT_PAID),
    (("alpha_lag_share", "beta_lag_share"), "", TIME, NOT_PAID, ESTIMATED),
    (("friction_share",), "", SCALE, CONSIDERED, ESTIMATED),
    (("airspeed_share",), "", SCALE, CONSIDERED, NOT_PAID),
    (("elevator_arm_share", "rudder_arm_share"), "", GEOMETRY, NOT_PAID, ESTIMATED),
    (("sidewash_share",), "", GEOMETRY, NOT_PAID, ESTIMATED),
)


@cache
def error_kinds() -> Mapping[str, ErrorKind]:
    """Return the kind of every error that an estimator may pay, by name."""
    return {name: ErrorKind(*kind) for names, *kind in _ROWS for name in names}


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
    sizes |= {name: max(least, sizes[name]) for name, least in (assumed or {}).items()}
    listed = error_sources(sizes, instrument)
    return tuple(e for e in listed if e.kind.coefficients != NOT_PAID)


def error_sources(
    sizes: Mapping[str, float], instrument: SensorErrorModel | None
) -> tuple[ErrorSource, ...]:
    """Return errors of the list with their standard deviations.

    Parameters
    ----------
    sizes : mapping
        Name to one standard deviation. A name that the list does not have raises `KeyError`.
    instrument : SensorErrorModel or None
        Tells what each belongs to; without one to the instrument.
    """
    kinds = error_kinds()
    return tuple(
        ErrorSource(
            name,
            size,
            error_source(name, instrument.errors) if instrument else INSTRUMENT,
            kinds[name],
        )
        for name, size in sizes.items()
    )


def by_cause(names: Collection[str]) -> dict[str, tuple[str, ...]]:
    """Return these errors under the causes that coefficients name, in the order of the list."""
    found: dict[str, tuple[str, ...]] = {}
    for name, kind in error_kinds().items():
        if kind.cause and name in names:
            found[kind.cause] = (*found.get(kind.cause, ()), name)
    return found
