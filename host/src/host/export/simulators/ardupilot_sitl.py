"""Coefficients of ArduPilot's own SITL plane, to paste into libraries/SITL/SIM_Plane.h.

SIM_Plane.cpp (after last_letter) takes its torque for an angular acceleration. So the moments'
coefficients are divided here by the inertia, the product Ixz included.
"""

from __future__ import annotations

import math

from host.export.simulators.straight_coefficients import StraightCoefficients

BLEND_PERRAD = 100.0
LIMITS = (
    "Paste over `coefficient` of class Plane in libraries/SITL/SIM_Plane.h; in Plane::Plane set"
    " mass to that below, and thrust_scale to your motor's largest thrust in N.",
    "SIM_Plane.cpp uses its torque as an angular acceleration: c_l_, c_m_, c_n_ are divided by the"
    " inertia (1 / kg m2). Gyroscopic terms have no place.",
    "Control inputs there are -1 to 1: per full travel, positive for roll right, nose up, nose"
    " right.",
    "Sideslip there is atan(v / u). Drag there knows the lift of alpha alone: c_drag_p makes it"
    " right at the trim's elevator.",
    f"Lift leaves its line over {4.6 / BLEND_PERRAD:.2f} rad below alpha_stall.",
)


def ardupilot_text(c: StraightCoefficients) -> str:
    """Return the struct of a plane."""
    s = c.slopes
    de, da, dr = c.limit_rad
    wing_lift = s["CL_0"] + s["CL_alpha"] * c.alpha_rad
    lift = wing_lift + s["CL_de"] * c.elevator_rad
    drag = c.cd_0 + c.induced * lift**2 + c.cd_elevator_perrad * c.elevator_rad
    gamma = c.ixx_kgm2 * c.izz_kgm2 - c.ixz_kgm2**2

    def roll(name: str) -> float:
        return (c.izz_kgm2 * s[f"Cl_{name}"] + c.ixz_kgm2 * s[f"Cn_{name}"]) / gamma

    def yaw(name: str) -> float:
        return (c.ixz_kgm2 * s[f"Cl_{name}"] + c.ixx_kgm2 * s[f"Cn_{name}"]) / gamma

    values = {
        "s": c.wing_area_m2, "b": c.span_m, "c": c.chord_m,
        "c_lift_0": s["CL_0"], "c_lift_deltae": -s["CL_de"] * de, "c_lift_a": s["CL_alpha"],
        "c_lift_q": s["CL_q"], "mcoeff": BLEND_PERRAD, "oswald": c.oswald,
        "alpha_stall": c.stall_alpha_rad + 4.6 / BLEND_PERRAD,
        "c_drag_q": 0.0, "c_drag_deltae": 0.0, "c_drag_p": drag - c.induced * wing_lift**2,
        "c_y_0": s["CY_0"], "c_y_b": s["CY_beta"], "c_y_p": s["CY_p"], "c_y_r": s["CY_r"],
        "c_y_deltaa": s["CY_da"] * da, "c_y_deltar": -s["CY_dr"] * dr,
        "c_l_0": roll("0"), "c_l_p": roll("p"), "c_l_b": roll("beta"), "c_l_r": roll("r"),
        "c_l_deltaa": roll("da") * da, "c_l_deltar": -roll("dr") * dr,
        "c_m_0": s["Cm_0"] / c.iyy_kgm2, "c_m_a": s["Cm_alpha"] / c.iyy_kgm2,
        "c_m_q": s["Cm_q"] / c.iyy_kgm2, "c_m_deltae": -s["Cm_de"] / c.iyy_kgm2 * de,
        "c_n_0": yaw("0"), "c_n_b": yaw("beta"), "c_n_p": yaw("p"), "c_n_r": yaw("r"),
        "c_n_deltaa": yaw("da") * da, "c_n_deltar": -yaw("dr") * dr,
        "deltaa_max": da, "deltae_max": de, "deltar_max": dr,
    }  # fmt: skip
    head = "\n".join(f"// {line}" for line in c.head(*LIMITS))
    trim = f"// trim: {c.airspeed_mps:g} m/s, alpha {math.degrees(c.alpha_rad):.2f} deg"
    body = "\n".join(f"    float {name} = {value:.9g}f;" for name, value in values.items())
    return (
        f"{head}\n{trim}\nstruct {{\n{body}\n    Vector3f CGOffset{{0.0f, 0.0f, 0.0f}};\n"
        "} coefficient;\n"
    )
