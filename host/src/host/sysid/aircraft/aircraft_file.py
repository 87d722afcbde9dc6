"""What identification needs out of an aircraft file of the package.

The file's reader has checked every number: whatever is wrong with one is said there, in one line.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from host.compiled import Array
from host.sysid.aircraft.airframe import AirframeData
from host.sysid.aircraft.instrument_errors import InstrumentData
from host.sysid.aircraft.powerplant import Powerplant
from host.sysid.errors import IdentificationError

RECTANGLE = 1.0 / np.sqrt(3.0)  # standard deviation of an even distribution over its half width
Place = tuple[float, float, float]


def airframe_data(source: str) -> AirframeData:
    """Return mass, sizes and places of the sensors of an aircraft by name or file.

    Raises
    ------
    host.errors.UsageError
        If there is no such file, or it does not say all of that (a linear aircraft).
    """
    from host.twin.aircraft import file as aircraft

    loaded = aircraft.load_measured(source)
    number, vector, cg = loaded.scalar, loaded.vector, loaded.vector("mass.cg_m")
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
        mass_share=number("mass.mass_tolerance") * RECTANGLE,
        inertia_share=number("mass.inertia_tolerance") * RECTANGLE,
        imu_m=_place(vector("sensors.imu_m") - cg),
        vanes_m=tuple(_place(vector(f"sensors.vane_{k}_m") - cg) for k in "ab"),
        upwash=number("sensors.upwash"),
        upwash_share=number("sensors.upwash_tolerance"),
        elevator_arm_m=number("geometry.elevator_arm_m"),
        rudder_arm_m=number("geometry.rudder_arm_m"),
        arm_share=number("geometry.arm_tolerance") * RECTANGLE,
    )


def instrument_data(source: str) -> InstrumentData:
    """Return the sensors' places and dynamics of an aircraft by name or file.

    Raises
    ------
    host.errors.UsageError
        If there is no such file, or it does not describe its sensors.
    """
    from host.twin.aircraft import file as aircraft

    loaded = aircraft.load_measured(source)
    number, vector, cg = loaded.scalar, loaded.vector, loaded.vector("mass.cg_m")
    between = 0.5 * (vector("sensors.vane_a_m") + vector("sensors.vane_b_m"))
    return InstrumentData(
        imu_m=_place(vector("sensors.imu_m") - cg),
        vanes_m=_place(between - cg),
        upwash=number("sensors.upwash"),
        upwash_share=number("sensors.upwash_tolerance"),
        vane_hz_per_mps=number("sensors.vane_frequency_hz_per_mps"),
        vane_damping=number("sensors.vane_damping"),
        vane_friction_rad=number("sensors.vane_friction_rad"),
        friction_speed_mps=number("trim.airspeed_mps"),
        pitot_lag_s=number("sensors.pitot_lag_s"),
        position_m=number("sensors.position_tolerance_m"),
        cg_m=number("mass.cg_tolerance_m"),
    )


def _place(from_cg: Array) -> Place:
    x, y, z = from_cg.tolist()
    return x, y, z


def powerplant(source: str) -> Powerplant:
    """Return the propeller and motor of an aircraft by name or file.

    Raises
    ------
    IdentificationError
        If a measured aircraft does not describe them.
    """
    from host.twin.aircraft import file as aircraft
    from host.twin.motion.propulsion import motor_torque, propeller, rotor_history

    loaded = aircraft.load_measured(source)
    if "propulsion.diameter_m" not in loaded.scalars:
        raise IdentificationError(
            f"aircraft {source}: no section [propulsion]; coefficients straight from"
            " flight need the thrust: add it, or leave '--model coefficients' out"
        )
    frame = loaded.airframe()

    def step(
        spin_radps: float, throttle: float, airspeed_mps: float, density_kgpm3: float
    ) -> tuple[float, float, float]:
        thrust, load = propeller(frame, spin_radps, airspeed_mps, density_kgpm3)
        return thrust, load, motor_torque(frame, throttle, spin_radps)

    return Powerplant(
        step,
        partial(rotor_history, frame),
        frame.rotor_inertia_kgm2,
        frame.thrust_axis,
        frame.hub_m - frame.cg_m,
    )
