"""A stability table as AVL prints it with ST: stability axes, controls per degree."""

from __future__ import annotations

import math

from host.export.simulators.straight_coefficients import (
    INPUTS,
    SURFACES,
    StraightCoefficients,
)

LIMITS = (
    "In the layout of AVL's ST: moments and roll and yaw rates about stability axes, x forward, at"
    " the CG; rates pb/2V, qc/2V, rb/2V; controls per degree.",
    "Trailing edge down and left positive, aileron (left - right) / 2. Measured in flight, not"
    " computed: no Trefftz plane, no neutral point.",
)
LABELS = (
    ("z' force CL |", "CL"), ("y  force CY |", "CY"), ("x' mom.  Cl'|", "Cl"),
    ("y  mom.  Cm |", "Cm"), ("z' mom.  Cn'|", "Cn"),
)  # fmt: skip


def avl_text(c: StraightCoefficients) -> str:
    """Return the table."""
    table = stability_axes(c)
    lift = table["CL_0"] + table["CL_alpha"] * c.alpha_rad + table["CL_de"] * c.elevator_rad
    drag = c.cd_0 + c.induced * lift**2 + c.cd_elevator_perrad * c.elevator_rad
    out = [
        *(f"# {line}" for line in c.head(*LIMITS)),
        f" Sref = {c.wing_area_m2:.6g}   Cref = {c.chord_m:.6g}   Bref = {c.span_m:.6g}",
        " Standard axis orientation,  X fwd, Z down",
        f"  Alpha = {math.degrees(c.alpha_rad):.6f}   Beta = 0.0   Mach = 0.0",
        f"  CLtot = {lift:.8f}   CDtot = {drag:.8f}   Cmtot = 0.0",
        *(
            f"  {surface} = {value:.5f}"
            for surface, value in zip(
                SURFACES, (math.degrees(c.elevator_rad), 0.0, 0.0), strict=True
            )
        ),
        "", " Stability-axis derivatives...", "",
    ]  # fmt: skip

    def block(title: str, columns: list[tuple[str, str, float]]) -> None:
        out.append(title)
        for label, row in LABELS:
            cells = (f"{row}{letter} = {table[f'{row}_{name}'] * gain:.9f}"
                     for letter, name, gain in columns)  # fmt: skip
            out.append(f" {label}    " + "    ".join(cells))
        out.append("")

    block("                     alpha                beta", [("a", "alpha", 1), ("b", "beta", 1)])
    block(
        "                     roll rate  p'      pitch rate  q'        yaw rate  r'",
        [("p", "p", 1), ("q", "q", 1), ("r", "r", 1)],
    )
    controls = "    ".join(f"{surface}     d{k}" for k, surface in enumerate(SURFACES, start=1))
    degree = math.radians(1.0)
    block(
        f"                  {controls}",
        [(f"d{k}", short, degree) for k, short in enumerate(INPUTS, start=1)],
    )
    return "\n".join(out) + "\n"


def stability_axes(c: StraightCoefficients) -> dict[str, float]:
    """Return the slopes with moments, roll and yaw rates about stability axes at the trim."""
    s, sin, cos = c.slopes, math.sin(c.alpha_rad), math.cos(c.alpha_rad)
    turned = dict(s)
    # Rates first: p = p' cos - r' sin, r = p' sin + r' cos.
    for row in ("CL", "CY", "Cl", "Cm", "Cn"):
        turned[f"{row}_p"] = s[f"{row}_p"] * cos + s[f"{row}_r"] * sin
        turned[f"{row}_r"] = -s[f"{row}_p"] * sin + s[f"{row}_r"] * cos
    body = dict(turned)
    for name in ("0", "alpha", "beta", "p", "q", "r", *INPUTS):
        turned[f"Cl_{name}"] = body[f"Cl_{name}"] * cos + body[f"Cn_{name}"] * sin
        turned[f"Cn_{name}"] = -body[f"Cl_{name}"] * sin + body[f"Cn_{name}"] * cos
    return turned
