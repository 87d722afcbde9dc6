"""An aircraft's coefficients as straight lines about one trim, as simulators' forms hold them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.aircraft.file import Aircraft
from host.aircraft.local_derivatives import local_derivatives
from host.export.simulators.straight_coefficients import StraightCoefficients


def straight_coefficients(
    aircraft: Aircraft, alpha_rad: float, identified: Sequence[str] = ()
) -> StraightCoefficients:
    """Return the coefficients of an aircraft as lines about an angle of attack.

    Parameters
    ----------
    aircraft : Aircraft
    alpha_rad : float
        Angle of attack at trim.
    identified : sequence of str
        For the head: what was identified, with its interval.
    """
    frame = aircraft.airframe()
    at = np.zeros(8)
    at[0] = alpha_rad
    for _ in range(2):  # lines: the second pass is at the trim's elevator
        found = local_derivatives(frame, at)
        moment = found["Cm"] - found["Cm_de"] * at[5]
        at[5] = float(np.clip(-moment / found["Cm_de"], -0.5, 0.5)) if found["Cm_de"] else 0.0
    found = local_derivatives(frame, at)
    induced = found["CD_alpha"] / (2.0 * found["CL"] * found["CL_alpha"])
    cd_elevator = found["CD_de"] - 2.0 * induced * found["CL"] * found["CL_de"]
    slopes = {n: v for n, v in found.items() if "_" in n and not n.startswith("CD_")}
    return StraightCoefficients(
        title=aircraft.title,
        alpha_rad=alpha_rad,
        elevator_rad=float(at[5]),
        slopes=slopes,
        cd_0=found["CD"] - induced * found["CL"] ** 2 - cd_elevator * float(at[5]),
        induced=induced,
        cd_elevator_perrad=cd_elevator,
        mass_kg=frame.mass_kg,
        ixx_kgm2=frame.ixx_kgm2,
        iyy_kgm2=frame.iyy_kgm2,
        izz_kgm2=frame.izz_kgm2,
        ixz_kgm2=frame.ixz_kgm2,
        wing_area_m2=frame.wing_area_m2,
        span_m=frame.span_m,
        chord_m=frame.chord_m,
        limit_rad=(
            float(frame.surface_limit_rad[0]),
            float(frame.surface_limit_rad[1]),
            float(frame.surface_limit_rad[2]),
        ),
        stall_alpha_rad=frame.stall_alpha_high_rad,
        airspeed_mps=aircraft.scalar("trim.airspeed_mps"),
        identified=tuple(identified),
    )
