"""What identification needs out of an aircraft file of the package."""

from __future__ import annotations

import numpy as np

from host.sysid.airframe import AirframeData
from host.sysid.errors import IdentificationError

RECTANGLE = 1.0 / np.sqrt(3.0)  # standard deviation of an even distribution over its half width


def airframe_data(source: str) -> AirframeData:
    """Read an aircraft by name or file.

    Raises
    ------
    IdentificationError
        If the file has no mass properties (a linear aircraft).
    """
    from host.twin import aircraft

    loaded = aircraft.load(source)
    try:
        number, vector = loaded.scalar, loaded.vector
        vanes = tuple(tuple(map(float, vector(f"sensors.vane_{k}_m"))) for k in "ab")
        imu = tuple(map(float, vector("sensors.imu_m") - vector("mass.cg_m")))
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
            imu_m=(imu[0], imu[1], imu[2]),
            vanes_m=tuple((v[0], v[1], v[2]) for v in vanes),
            upwash=number("sensors.upwash"),
            upwash_share=number("sensors.upwash_tolerance"),
        )
    except KeyError as error:
        raise IdentificationError(f"aircraft {source}: no {error.args[0]} in its file") from error
