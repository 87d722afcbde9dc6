"""What differs from flight to flight and is not told to the host: drawn by seed.

Ranges as stated for this product; uniform within them unless said otherwise. The host sees only
the aircraft file and the calibration, with these ranges as their uncertainty.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from host.aircraft.airframe import Airframe, Array
from host.aircraft.file import Aircraft

# Half-widths.
DELAY_SHARE = 0.20
DELAY_LEAST_S = 1e-3
VANE_SCALE = 0.03
PITOT_SCALE = 0.03
PITOT_DRIFT_COUNT = 1.0
MISALIGNMENT_RAD = np.deg2rad(1.0)
CLOCK_SHARE = 0.005  # ceramic resonator of the Mega, 0.5 %
GYRO_BIAS_RADPS = np.deg2rad(0.5)  # left after the zeroing at rest; the chip's own is 20 deg/s
GYRO_SCALE = 0.01  # after calibration; the data sheet allows 3 %
ACCEL_BIAS_MPS2 = 0.05 * 9.80665 / 2  # half of the data sheet's 50 mg: calibrated once
ACCEL_SCALE = 0.01
VANE_ZERO_RAD = np.deg2rad(0.5)
POT_ZERO_RAD = np.deg2rad(0.3)
POT_SCALE = 0.01

# Switches of a card and the draws they leave nominal.
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
}


@dataclass(frozen=True, slots=True)
class Draws:
    """Every error of one flight, by name; arrays as lists of their elements.

    Attributes
    ----------
    values : dict
        Name with unit to number or array.
    """

    values: dict[str, Array]

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

    Returns
    -------
    Draws
    """
    scale = 1.0 if tolerances else 0.0

    def within(half: float, *shape: int) -> Array:
        return np.asarray(scale * rng.uniform(-half, half, shape))

    s = aircraft.scalar
    spot = s("sensors.position_tolerance_m")
    values: dict[str, Array] = {
        "mass_share": within(s("mass.mass_tolerance")),
        "inertia_share": within(s("mass.inertia_tolerance"), 3),  # x, y, z
        "cg_m": within(s("mass.cg_tolerance_m"), 3),
        "imu_m": within(spot, 3),
        "vane_a_m": within(spot, 3),
        "vane_b_m": within(spot, 3),
        "pitot_a_m": within(spot, 3),
        "pitot_b_m": within(spot, 3),
        "upwash_share": within(s("sensors.upwash_tolerance"), 2),
        "misalignment_rad": within(float(MISALIGNMENT_RAD), 3),
        "imu_delay_share": within(DELAY_SHARE),
        "vane_delay_share": within(DELAY_SHARE, 4),
        "pitot_delay_share": within(DELAY_SHARE, 2),
        "imu_delay_s": within(DELAY_LEAST_S),
        "vane_delay_s": within(DELAY_LEAST_S, 4),
        "pitot_delay_s": within(DELAY_LEAST_S, 2),
        "gps_delay_share": within(DELAY_SHARE),
        "field_m": within(5.0, 3),  # slow position error of the GPS at power-on
        "vane_scale_share": within(VANE_SCALE, 4),  # alpha a, alpha b, beta a, beta b
        "vane_zero_rad": within(float(VANE_ZERO_RAD), 4),
        "pitot_scale_share": within(PITOT_SCALE, 2),
        "pitot_drift_count": within(PITOT_DRIFT_COUNT, 2),
        "pot_zero_rad": within(float(POT_ZERO_RAD), 4),  # elevator, aileron l, r, rudder
        "pot_scale_share": within(POT_SCALE, 4),
        "gyro_bias_radps": within(float(GYRO_BIAS_RADPS), 3),
        "gyro_scale_share": within(GYRO_SCALE, 3),
        "accel_bias_mps2": within(ACCEL_BIAS_MPS2, 3),
        "accel_scale_share": within(ACCEL_SCALE, 3),
        "clock_share": within(CLOCK_SHARE),
        "imu_clock_share": within(CLOCK_SHARE),
        "baro_offset_pa": within(100.0),  # BMP085 absolute accuracy, +-1 hPa typical
    }
    for group in nominal:
        for name in GROUPS[group]:
            values[name] = np.zeros_like(values[name])
    return Draws(values)


def flown(aircraft: Aircraft, draws: Draws) -> Airframe:
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
    )


def delay_s(nominal_s: float, share: float, least_s: float) -> float:
    """Return a drawn delay: +-20 % of the nominal one, at least +-1 ms, never negative."""
    off = share * nominal_s
    if abs(DELAY_SHARE * nominal_s) < DELAY_LEAST_S:
        off = least_s
    return max(nominal_s + off, 0.0)
