"""Mass, inertia, sizes and places of the sensors out of an aircraft file, each with its tolerance.

`host.aircraft.file` has checked every number, so nothing is checked again here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from host.aircraft.aircraft_ranges import UNKNOWN_ANGLE_RAD
from host.aircraft.file import load_measured
from host.arrays import Array
from host.constants import EVEN_SD

Place = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class AirframeData:
    """Mass, inertia, reference sizes, sensor positions with their relative uncertainties.

    Positions are in metres from the CG, x forward, y right, z down; relative numbers are standard
    deviations, zero where nobody says one. `upwash` is the share by which the vanes over-read. Arms
    reach from the nominal CG back to where a tail surface's control force acts; 0 means unknown.
    `ground_pitch_rad` is the pitch angle of the x axis on the wheels; if nobody measured it, its
    deviation is infinite.
    """

    name: str
    mass_kg: float
    ixx_kgm2: float
    iyy_kgm2: float
    izz_kgm2: float
    ixz_kgm2: float
    wing_area_m2: float
    span_m: float
    chord_m: float
    mass_share: float = 0.0
    inertia_share: float = 0.0
    imu_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    vanes_m: tuple[tuple[float, float, float], ...] = ()
    upwash: float = 0.0
    upwash_share: float = 0.0
    elevator_arm_m: float = 0.0
    rudder_arm_m: float = 0.0
    arm_share: float = 0.0
    ground_pitch_rad: float = 0.0
    ground_pitch_sd_rad: float = math.inf


@dataclass(frozen=True, slots=True)
class Condition:
    """Flight condition at which coefficients hold: the mean over the maneuvers."""

    airspeed_mps: float
    qbar_pa: float


def airframe_data(source: str) -> AirframeData:
    """Return mass, sizes and places of the sensors of an aircraft by name or file.

    Raises
    ------
    host.errors.UsageError
        If there is no such file, or it does not say all of that (a linear aircraft).
    """
    loaded = load_measured(source)
    number, vector, cg = loaded.scalar, loaded.vector, loaded.vector("mass.cg_m")
    standing_rad = number("geometry.ground_pitch_tolerance_rad")
    return AirframeData(
        name=loaded.title,
        mass_kg=number("mass.mass_kg"),
        ixx_kgm2=number("mass.ixx_kgm2"),
        iyy_kgm2=number("mass.iyy_kgm2"),
        izz_kgm2=number("mass.izz_kgm2"),
        ixz_kgm2=number("mass.ixz_kgm2"),
        wing_area_m2=number("geometry.wing_area_m2"),
        span_m=number("geometry.span_m"),
        chord_m=number("geometry.chord_m"),
        mass_share=number("mass.mass_tolerance") * EVEN_SD,
        inertia_share=number("mass.inertia_tolerance") * EVEN_SD,
        imu_m=place(vector("sensors.imu_m") - cg),
        vanes_m=tuple(place(vector(f"sensors.vane_{k}_m") - cg) for k in "ab"),
        upwash=number("sensors.upwash"),
        upwash_share=number("sensors.upwash_tolerance"),
        elevator_arm_m=number("geometry.elevator_arm_m"),
        rudder_arm_m=number("geometry.rudder_arm_m"),
        arm_share=number("geometry.arm_tolerance") * EVEN_SD,
        ground_pitch_rad=number("geometry.ground_pitch_rad"),
        ground_pitch_sd_rad=(
            standing_rad * EVEN_SD if standing_rad < UNKNOWN_ANGLE_RAD else math.inf
        ),
    )


def place(from_cg: Array) -> Place:
    """Return x, y, z of a place (3,)."""
    x, y, z = from_cg.tolist()
    return x, y, z
