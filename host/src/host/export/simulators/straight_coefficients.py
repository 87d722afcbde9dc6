"""What all these forms hold of an aircraft: its coefficients as straight lines about one trim.

Drag is a parabola in lift. What bends otherwise in the aircraft file is replaced by its slope at
the trim, which every file says at its head.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

SURFACES = ("elevator", "aileron", "rudder")
INPUTS = ("de", "da", "dr")


@dataclass(frozen=True, slots=True)
class StraightCoefficients:
    """Coefficients about a trim, moments at the CG in body axes.

    Attributes
    ----------
    title : str
    alpha_rad, elevator_rad : float
        Angles at trim; the elevator is the one without pitching moment.
    slopes : dict of str to float
        ``CL_alpha`` and all others per radian and per p_hat, q_hat, r_hat; ``CL_0``, ``CY_0``,
        ``Cl_0``, ``Cm_0``, ``Cn_0``: the lines' values where all is zero.
    cd_0, induced : float
        CD = cd_0 + induced CL^2 + CD_de elevator, lift without that of the pitch rate.
    cd_elevator_perrad : float
    mass_kg, ixx_kgm2, iyy_kgm2, izz_kgm2, ixz_kgm2 : float
    wing_area_m2, span_m, chord_m : float
    limit_rad : tuple of float
        Full travel of elevator, aileron, rudder.
    stall_alpha_rad : float
        Where lift leaves its line upwards.
    airspeed_mps : float
        Airspeed at the aircraft file's trim.
    identified : tuple of str
        What was identified, with its interval; all else is the aircraft file's.
    """

    title: str
    alpha_rad: float
    elevator_rad: float
    slopes: dict[str, float]
    cd_0: float
    induced: float
    cd_elevator_perrad: float
    mass_kg: float
    ixx_kgm2: float
    iyy_kgm2: float
    izz_kgm2: float
    ixz_kgm2: float
    wing_area_m2: float
    span_m: float
    chord_m: float
    limit_rad: tuple[float, float, float]
    stall_alpha_rad: float
    airspeed_mps: float
    identified: tuple[str, ...]

    @property
    def aspect_ratio(self) -> float:
        """Span squared over area."""
        return self.span_m**2 / self.wing_area_m2

    @property
    def oswald(self) -> float:
        """Efficiency e of induced = 1 / (pi e AR); it holds the drag of the fuselage too."""
        return 1.0 / (math.pi * self.aspect_ratio * self.induced)

    def head(self, *lines: str) -> list[str]:
        """Return the head of every file: source, signs, limits, intervals."""
        return [
            f"{self.title}; written by host identify.",
            f"Straight lines about alpha {math.degrees(self.alpha_rad):.2f} deg, elevator"
            f" {math.degrees(self.elevator_rad):.2f} deg: good for the angles and airspeeds flown,"
            " no stall, no Reynolds number.",
            f"SI and radians; mass {self.mass_kg:g} kg, Ixx Iyy Izz Ixz {self.ixx_kgm2:g}"
            f" {self.iyy_kgm2:g} {self.izz_kgm2:g} {self.ixz_kgm2:g} kg m2, area"
            f" {self.wing_area_m2:g} m2, span {self.span_m:g} m, chord {self.chord_m:g} m.",
            *lines,
            "Identified (95 %), all else from the aircraft file:",
            *(f"  {one}" for one in self.identified),
        ]
