"""The random errors of one flight, drawn by seed and hidden from the host.

Sizes and distributions come from `host.instrument`. The host gets the same deviations in the
aircraft file and the calibration, but not the drawn values.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from host.aircraft.airframe import Airframe, Array
from host.aircraft.file import Aircraft
from host.instrument.instrument_errors import (
    InstrumentErrors,
    NamedError,
    instrument_errors,
    standard_errors,
)
from host.physical.recording import SURFACES

PITOT_PA_PER_COUNT = 4.8828125  # MPXV7002DP on a 10-bit converter, hw/calibration/default.toml
VANES = ("alpha_a", "alpha_b", "beta_a", "beta_b")
PITOTS = ("dp_a", "dp_b")
POTS = ("pot_elevator", "pot_aileron_left", "pot_aileron_right", "pot_rudder")
# In the order of drawing: name of the draw, its error, sensors, numbers per sensor (0: one in all;
# 3: x, y, z), units of the error per unit of the draw.
DRAWN_ERRORS: tuple[tuple[str, str, tuple[str, ...], int, float], ...] = (
    ("mass_share", "mass_share", (), 0, 1.0),
    ("inertia_share", "inertia_share", ("x", "y", "z"), 1, 1.0),
    ("cg_m", "cg_m", ("x", "y", "z"), 1, 1.0),
    *((f"{name}_m", "place_m", (name,), 3, 1.0)
      for name in ("imu", "vane_a", "vane_b", "pitot_a", "pitot_b")),
    ("upwash_share", "upwash_share", ("a", "b"), 1, 1.0),
    ("misalignment_rad", "misalignment_rad", ("x", "y", "z"), 1, 1.0),
    ("imu_delay_share", "delay_share", ("imu",), 0, 1.0),
    ("vane_delay_share", "delay_share", VANES, 1, 1.0),
    ("pitot_delay_share", "delay_share", PITOTS, 1, 1.0),
    ("imu_delay_s", "delay_least_s", ("imu",), 0, 1.0),
    ("vane_delay_s", "delay_least_s", VANES, 1, 1.0),
    ("pitot_delay_s", "delay_least_s", PITOTS, 1, 1.0),
    ("gps_delay_share", "delay_share", ("gps",), 0, 1.0),
    ("field_m", "gps_place_m", ("north", "east", "down"), 1, 1.0),
    ("vane_scale_share", "vane_scale", VANES, 1, 1.0),
    ("vane_zero_rad", "vane_zero_rad", VANES, 1, 1.0),
    ("pitot_scale_share", "pitot_scale", PITOTS, 1, 1.0),
    ("pitot_drift_count", "pitot_zero_pa", PITOTS, 1, PITOT_PA_PER_COUNT),
    ("pot_zero_rad", "pot_zero_rad", POTS, 1, 1.0),
    ("pot_scale_share", "pot_scale", POTS, 1, 1.0),
    ("gyro_bias_radps", "gyro_bias_radps", ("x", "y", "z"), 1, 1.0),
    ("gyro_scale_share", "gyro_scale", ("x", "y", "z"), 1, 1.0),
    ("accel_bias_mps2", "accel_bias_mps2", ("x", "y", "z"), 1, 1.0),
    ("accel_scale_share", "accel_scale", ("x", "y", "z"), 1, 1.0),
    ("clock_share", "clock_share", ("mega",), 0, 1.0),
    ("imu_clock_share", "clock_share", ("imu",), 0, 1.0),
    ("baro_offset_pa", "baro_offset_pa", ("baro",), 0, 1.0),
    ("vane_friction_share", "vane_friction_share", VANES, 1, 1.0),
    ("thrust_share", "thrust_share", ("propeller",), 0, 1.0),
    ("servo_bandwidth_share", "servo_bandwidth_share", SURFACES, 1, 1.0),
    ("servo_scale_share", "servo_scale", SURFACES, 1, 1.0),
    ("servo_zero_rad", "servo_zero_rad", SURFACES, 1, 1.0),
    ("servo_delay_s", "servo_delay_s", SURFACES, 1, 1.0),
)  # fmt: skip

# Switch in a card's [sensors] -> draws that are nominal while it is off.
GROUPS: dict[str, tuple[str, ...]] = {
    "imu_bias": ("gyro_bias_radps", "accel_bias_mps2"),
    "imu_scale": ("gyro_scale_share", "accel_scale_share"),
    "imu_misalignment": ("misalignment_rad",),
    "vane_scale": ("vane_scale_share", "vane_zero_rad"),
    "pitot_scale": ("pitot_scale_share",),
    "potentiometers": ("pot_zero_rad", "pot_scale_share"),
    "upwash_tolerance": ("upwash_share",),
    "delay_tolerance": (
        "imu_delay_share",
        "vane_delay_share",
        "pitot_delay_share",
        "imu_delay_s",
        "vane_delay_s",
        "pitot_delay_s",
        "gps_delay_share",
    ),
    "place_tolerance": ("cg_m", "imu_m", "vane_a_m", "vane_b_m", "pitot_a_m", "pitot_b_m"),
    "mass_tolerance": ("mass_share", "inertia_share"),
    "barometer_offset": ("baro_offset_pa",),
    "friction_tolerance": ("vane_friction_share",),
    "thrust_tolerance": ("thrust_share",),
    "servo_tolerance": (
        "servo_bandwidth_share",
        "servo_scale_share",
        "servo_zero_rad",
        "servo_delay_s",
    ),
}


@dataclass(frozen=True, slots=True)
class Draws:
    """Every error of one flight, by name; arrays as lists of their elements.

    Attributes
    ----------
    values : dict
        Name with unit to number or array.
    errors : InstrumentErrors
        What they were drawn from.
    """

    values: dict[str, Array]
    errors: InstrumentErrors = field(default_factory=standard_errors)

    def scalar(self, name: str) -> float:
        """Return one number."""
        return float(self.values[name])

    def vector(self, name: str) -> Array:
        """Return one array."""
        return self.values[name]


def draw(
    aircraft: Aircraft,
    rng: np.random.Generator,
    *,
    tolerances: bool,
    nominal: Collection[str] = (),
    errors: InstrumentErrors | None = None,
    of_instrument: np.random.Generator | None = None,
) -> Draws:
    """Draw the errors of one flight.

    Parameters
    ----------
    aircraft : Aircraft
        States the tolerances of mass, inertia, CG, positions and upwash.
    rng : numpy Generator
    tolerances : bool
        False: everything is exactly nominal (the generator advances all the same).
    nominal : collection of str
        Keys of `GROUPS` whose draws are nominal while the others stay as they were.
    errors : InstrumentErrors, optional
        Errors of the instrument that flies; without, the standard ones with the aircraft's
        tolerances.
    of_instrument : numpy Generator, optional
        Draws the errors that are constant for an instrument, so that several flights can share
        them; without, every flight has an instrument of its own.

    Returns
    -------
    Draws
    """
    errors = errors or instrument_errors(aircraft)
    scale = 1.0 if tolerances else 0.0
    values: dict[str, Array] = {}
    for name, of, sensors, size, unit in DRAWN_ERRORS:
        error = errors[of]
        value = _random_values(rng, error, sensors, size, unit)
        if of_instrument is not None:
            constant = _random_values(of_instrument, error, sensors, size, unit)
            value = constant if error.drawn == "instrument" else value
        values[name] = np.asarray(scale * value)
    for group in nominal:
        for name in GROUPS[group]:
            values[name] = np.zeros_like(values[name])
    return Draws(values, errors)


def _random_values(
    rng: np.random.Generator, error: NamedError, sensors: Sequence[str], size: int, unit: float
) -> Array:
    """Return one number, one per sensor, or x, y, z of one sensor."""
    own = sensors or error.sensors
    width = np.array([error.width[error.sensors.index(s)] for s in own]) / unit
    shape = () if size == 0 else (size * len(own),)
    width = width[0] if size == 0 else np.repeat(width, size)
    if error.distribution == "even":
        value = rng.uniform(-width, width, shape)
    else:
        value = width * rng.standard_normal(shape)
    common = [k for k, s in enumerate(own) if s in error.shared]
    if size == 1 and common:
        value[common] = value[common[0]] / width[common[0]] * width[common]
    return np.asarray(value)


def true_airframe(aircraft: Aircraft, draws: Draws) -> Airframe:
    """Return the aircraft as it really is on this flight."""
    frame = aircraft.airframe()
    ix, iy, iz = (1.0 + draws.vector("inertia_share")).tolist()
    return frame._replace(
        mass_kg=frame.mass_kg * (1.0 + draws.scalar("mass_share")),
        ixx_kgm2=frame.ixx_kgm2 * ix,
        iyy_kgm2=frame.iyy_kgm2 * iy,
        izz_kgm2=frame.izz_kgm2 * iz,
        ixz_kgm2=frame.ixz_kgm2 * (ix * iz) ** 0.5,
        cg_m=frame.cg_m + draws.vector("cg_m"),
        ct_polynomial=frame.ct_polynomial * (1.0 + draws.scalar("thrust_share")),
        servo_bandwidth_radps=frame.servo_bandwidth_radps
        * (1.0 + float(draws.vector("servo_bandwidth_share")[0])),
    )


def delay_s(
    nominal_s: float, share: float, least_s: float, errors: InstrumentErrors | None = None
) -> float:
    """Return a delay with its drawn error: `share` of it, or `least_s` where that varies more."""
    e = errors or standard_errors()
    off = share * nominal_s
    if e["delay_share"].sigma("imu") * nominal_s < e["delay_least_s"].sigma("imu"):
        off = least_s
    return max(nominal_s + off, 0.0)
