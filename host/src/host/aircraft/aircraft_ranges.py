"""What each number of an aircraft file may be, from an indoor model of 5 g to the An-225.

A range is where the number would have another unit or sign, or where no aircraft is. What follows
from several numbers together is in `size_ratios`.
"""

from __future__ import annotations

from collections.abc import Mapping

from host.aircraft.airframe import COEFFICIENTS
from host.files.quantities import Quantity

_LARGEST = "An-225: 640 t, 88 m, 905 m2; Stratolaunch: 117 m"
_SHARE = "a share: 0.05 is 5 %; beyond half of it nothing was measured"
_PLACE = "longest aircraft 84 m, from any point on it"
_SPEED = "indoor models 1 m/s; the coefficients know no Mach number, X-15 2 km/s"
_COEFFICIENT = "ten times the largest of Roskam's and Heffley's tables (Cm_q -40, CY_r 4)"
_SURFACE = "a surface hinged at most square to the flow"
_POWER = "from a motor of 1 W to engines of 100 MW"

_INERTIA = Quantity("kg m2", 0.0, 1e8, "An-225 about 1e8 kg m2", above=True)
_ANGLE = Quantity("rad", -1.6, 1.6, "90 degrees; in degrees it would be larger")
_PLACE_M = Quantity("m", -100.0, 100.0, _PLACE)
_TOLERANCE = Quantity("", 0.0, 0.5, _SHARE)
_TOLERANCE_M = Quantity("m", 0.0, 5.0, "a place with a larger tolerance is unknown")
_TORQUE = Quantity("N m", 0.0, 1e6, "largest turboprops 1e5 N m")
UNKNOWN_ANGLE_RAD = 1.6  # 90 degrees: as a tolerance it means that nobody measured the angle
# Ranges of a flight condition, wherever it is given.
AIRSPEED = Quantity("m/s", 0.5, 2000.0, _SPEED)
DENSITY = Quantity("kg/m3", 1e-3, 10.0, "from 50 km to wind tunnels under pressure")
ALPHA_DEG = Quantity("deg", -89.0, 89.0, "at 90 degrees derivatives have no axes")
_LIMIT = Quantity("rad", 0.0, 1.6, _SURFACE, above=True)
_POLYNOMIAL = Quantity("", -1e3, 1e3, "propeller data: coefficients below 10")

RANGES: Mapping[str, Quantity] = {
    "mass.mass_kg": Quantity("kg", 1e-3, 7e5, _LARGEST),
    "mass.ixx_kgm2": _INERTIA,
    "mass.iyy_kgm2": _INERTIA,
    "mass.izz_kgm2": _INERTIA,
    "mass.ixz_kgm2": Quantity("kg m2", -1e8, 1e8, "as the moments of inertia"),
    "mass.cg_m": _PLACE_M,
    "mass.mass_tolerance": _TOLERANCE,
    "mass.inertia_tolerance": _TOLERANCE,
    "mass.cg_tolerance_m": _TOLERANCE_M,
    "geometry.wing_area_m2": Quantity("m2", 1e-4, 1500.0, _LARGEST),
    "geometry.span_m": Quantity("m", 0.03, 130.0, _LARGEST),
    "geometry.chord_m": Quantity("m", 3e-3, 50.0, "delta wings: Concorde 28 m at the root"),
    "geometry.elevator_arm_m": Quantity("m", -100.0, 100.0, _PLACE),
    "geometry.rudder_arm_m": Quantity("m", -100.0, 100.0, _PLACE),
    "geometry.arm_tolerance": _TOLERANCE,
    "geometry.ground_pitch_rad": Quantity(
        "rad", -0.8, 0.8, "tail-draggers stand at 0.15 to 0.3; in degrees it would be larger"
    ),
    "geometry.ground_pitch_tolerance_rad": Quantity(
        "rad",
        0.0,
        UNKNOWN_ANGLE_RAD,
        "an inclinometer reads to 0.003, a runway is level to 0.01",
        above=True,
    ),
    "trim.airspeed_mps": AIRSPEED,
    "trim.minimum_airspeed_mps": AIRSPEED,
    "trim.maximum_airspeed_mps": AIRSPEED,
    "aerodynamics.alpha_rad": Quantity("rad", -3.2, 3.2, "half a turn"),
    "aerodynamics.stall_alpha_rad": _ANGLE,
    "aerodynamics.cd_0": Quantity("", 0.0, 2.0, "a plate across the flow has 2"),
    "aerodynamics.induced_factor": Quantity("", -1.0, 10.0, "1 / (pi e AR): 1 at AR 0.4"),
    "aerodynamics.stall_lift_perrad2": Quantity("1/rad2", -1e4, 1e4, _COEFFICIENT),
    "aerodynamics.stall_drag_perrad2": Quantity("1/rad2", -1e4, 1e4, _COEFFICIENT),
    **{f"aerodynamics.{name}": Quantity("", -500.0, 500.0, _COEFFICIENT) for name in COEFFICIENTS},
    "propulsion.diameter_m": Quantity("m", 0.0, 12.0, "V-22 11.6 m; without one 0"),
    "propulsion.advance_ratio_max": Quantity("", 0.01, 20.0, "windmilling propellers below 6"),
    "propulsion.rotor_inertia_kgm2": Quantity("kg m2", 0.0, 1e5, _POWER, above=True),
    "propulsion.motor_torque_max_nm": _TORQUE,
    "propulsion.friction_torque_nm": _TORQUE,
    "propulsion.brake_torque_nm": _TORQUE,
    "propulsion.stopped_drag_area_m2": Quantity("m2", 0.0, 200.0, "disc of the largest propeller"),
    "propulsion.thrust_pitch_rad": _ANGLE,
    "propulsion.ct_polynomial": _POLYNOMIAL,
    "propulsion.cp_polynomial": _POLYNOMIAL,
    "propulsion.motor_power_polynomial_w": Quantity("W", -1e9, 1e9, _POWER),
    "propulsion.hub_m": _PLACE_M,
    "servo.bandwidth_hz": Quantity("Hz", 0.05, 500.0, "piezo servos 100 Hz, hand cranks 0.1 Hz"),
    "servo.rate_limit_radps": Quantity("rad/s", 0.01, 500.0, "fastest servos 20 rad/s"),
    "surfaces.elevator_limit_rad": _LIMIT,
    "surfaces.aileron_limit_rad": _LIMIT,
    "surfaces.rudder_limit_rad": _LIMIT,
    "sensors.imu_m": _PLACE_M,
    "sensors.vane_a_m": _PLACE_M,
    "sensors.vane_b_m": _PLACE_M,
    "sensors.pitot_a_m": _PLACE_M,
    "sensors.pitot_b_m": _PLACE_M,
    "sensors.gps_m": _PLACE_M,
    "sensors.position_tolerance_m": _TOLERANCE_M,
    "sensors.upwash": Quantity("", -0.5, 2.0, "share by which a vane over-reads: 0 to 0.6 flown"),
    "sensors.upwash_tolerance": Quantity("", 0.0, 1.0, "a share of the upwash: 0.2 is 20 %"),
    "sensors.vane_frequency_hz_per_mps": Quantity(
        "Hz per m/s", 0.01, 100.0, "vanes of 20 to 500 mm: 0.1 to 5"
    ),
    "sensors.vane_damping": Quantity("", 0.0, 10.0, "vanes 0.05 to 0.7", above=True),
    "sensors.vane_friction_rad": Quantity("rad", 0.0, 0.35, "20 degrees: a vane that is stuck"),
    "sensors.pitot_lag_s": Quantity("s", 0.0, 5.0, "metres of thin tube: 1 s"),
}
