"""A Python file for AeroSandbox: coefficients at an operating point, mass properties."""

from __future__ import annotations

import math

from host.export.simulators.straight_coefficients import StraightCoefficients

LIMITS = (
    "For AeroSandbox 4: `aerodynamics(op_point, de, da, dr)` takes an asb.OperatingPoint (alpha and"
    " beta in degrees there) and returns what asb.AeroBuildup.run() does of it:",
    "CL, CD, CY, Cl, Cm, Cn (moments body axes at the CG) and F_b, M_b (N, N m, body axes).",
    "Surfaces in radians, trailing edge down and left positive, aileron (left - right) / 2.",
)
BODY = """
import aerosandbox.numpy as np

MASS_KG, IXX, IYY, IZZ, IXZ = {mass}
AREA_M2, SPAN_M, CHORD_M = {sizes}
CD_0, INDUCED, CD_DE = {drag}
# By coefficient: value at zero, then by alpha, beta, p_hat, q_hat, r_hat, de, da, dr.
SLOPES = {{
{rows}
}}


def mass_properties():
    import aerosandbox as asb

    return asb.MassProperties(mass=MASS_KG, Ixx=IXX, Iyy=IYY, Izz=IZZ, Ixz=IXZ)


def aerodynamics(op_point, de=0.0, da=0.0, dr=0.0):
    speed = op_point.velocity
    alpha, beta = np.radians(op_point.alpha), np.radians(op_point.beta)
    p_hat, r_hat = (rate * SPAN_M / (2.0 * speed) for rate in (op_point.p, op_point.r))
    q_hat = op_point.q * CHORD_M / (2.0 * speed)
    arguments = (1.0, alpha, beta, p_hat, q_hat, r_hat, de, da, dr)
    c = {{row: sum(k * x for k, x in zip(slopes, arguments)) for row, slopes in SLOPES.items()}}
    still = c["CL"] - SLOPES["CL"][4] * q_hat
    c["CD"] = CD_0 + INDUCED * still**2 + CD_DE * de
    force = op_point.dynamic_pressure() * AREA_M2
    c["F_b"] = [
        force * (c["CL"] * np.sin(alpha) - c["CD"] * np.cos(alpha)),
        force * c["CY"],
        force * (-c["CL"] * np.cos(alpha) - c["CD"] * np.sin(alpha)),
    ]
    c["M_b"] = [force * SPAN_M * c["Cl"], force * CHORD_M * c["Cm"], force * SPAN_M * c["Cn"]]
    return c
"""
ARGUMENTS = ("0", "alpha", "beta", "p", "q", "r", "de", "da", "dr")


def aerosandbox_text(c: StraightCoefficients) -> str:
    """Return the file."""

    def listed(*values: float) -> str:
        return ", ".join(f"{v:.9g}" for v in values)

    rows = "\n".join(
        f'    "{row}": ({listed(*(c.slopes[f"{row}_{x}"] for x in ARGUMENTS))}),'
        for row in ("CL", "CY", "Cl", "Cm", "Cn")
    )
    head = "\n".join(f"# {line}" for line in c.head(*LIMITS))
    trim = f"# trim: {c.airspeed_mps:g} m/s, alpha {math.degrees(c.alpha_rad):.3f} deg\n"
    return f"{head}\n{trim}" + BODY.format(
        mass=listed(c.mass_kg, c.ixx_kgm2, c.iyy_kgm2, c.izz_kgm2, c.ixz_kgm2),
        sizes=listed(c.wing_area_m2, c.span_m, c.chord_m),
        drag=listed(c.cd_0, c.induced, c.cd_elevator_perrad),
        rows=rows,
    )
