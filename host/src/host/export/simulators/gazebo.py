"""A block of Gazebo's AdvancedLiftDrag system, as its source and documentation name the parts.

The system is gz-sim's src/systems/advanced_lift_drag; PX4's advanced_liftdrag_plugin for Gazebo
Classic has the same names.
"""

from __future__ import annotations

import math
from xml.etree import ElementTree

from host.export.simulators.straight_coefficients import (
    INPUTS,
    SURFACES,
    StraightCoefficients,
)

ROWS = {"CL": "CL", "CY": "CY", "Cell": "Cl", "Cem": "Cm", "Cen": "Cn"}
BLEND_PERRAD = 15.0  # M of the plugin, no parameter of it
# Behind 4.6 / M of the blend's middle 1 % of it is left.
STALL_MARGIN_RAD = 4.6 / BLEND_PERRAD
LIMITS = (
    "Control derivatives are per degree, deflections trailing edge down and left positive, aileron"
    " (left - right) / 2: one joint each.",
    "The plugin blends lift into a flat plate's 15 / rad about alpha_stall, which stands"
    f" {STALL_MARGIN_RAD:.2f} rad above the file's stall so that at most 1 % of it is in flight.",
    "Sideslip there is atan(v / u), dynamic pressure without v: 1 % at 5 deg of sideslip. Moments"
    " CY_0, Cl_0, Cn_0 have no place.",
    "gz-sim's AdvancedLiftDrag.cc, as read for this file, overwrites Cem0 + Cema alpha by Cemb"
    " beta (`Cem = this->Cemb * this->beta`): look whether your release does; then it has no"
    " static margin.",
)


def gazebo_text(c: StraightCoefficients) -> str:
    """Return the <plugin> element of an SDF model; its CG is the link's origin."""
    plugin = ElementTree.Element(
        "plugin",
        filename="gz-sim-advanced-lift-drag-system",
        name="gz::sim::systems::AdvancedLiftDrag",
    )

    def put(tag: str, value: float | str, into: ElementTree.Element = plugin) -> None:
        text = value if isinstance(value, str) else f"{value:.9g}"
        ElementTree.SubElement(into, tag).text = text

    put("link_name", "base_link")
    put("a0", 0.0)
    for tag, row in (("CL0", "CL_0"), ("Cem0", "Cm_0")):
        put(tag, c.slopes[row])
    put("CD0", c.cd_0)
    for letter, name in (("a", "alpha"), ("b", "beta"), ("p", "p"), ("q", "q"), ("r", "r")):
        for tag, row in ROWS.items():
            put(f"{tag}{letter}", c.slopes[f"{row}_{name}"])
        if letter in "pqr":
            put(f"CD{letter}", 0.0)
    put("alpha_stall", c.stall_alpha_rad + STALL_MARGIN_RAD)
    put("CLa_stall", 0.0)
    put("CDa_stall", 0.0)
    put("Cema_stall", 0.0)
    put("AR", c.aspect_ratio)
    put("mac", c.chord_m)
    put("eff", c.oswald)
    put("area", c.wing_area_m2)
    put("air_density", 1.225)
    put("cp", "0 0 0")
    put("forward", "1 0 0")
    put("upward", "0 0 1")
    put("num_ctrl_surfaces", "3")
    for index, (surface, short) in enumerate(zip(SURFACES, INPUTS, strict=True)):
        control = ElementTree.SubElement(plugin, "control_surface")
        put("name", f"{surface}_joint", control)
        put("index", str(index), control)
        put("direction", "1", control)
        put("CD_ctrl", math.radians(c.cd_elevator_perrad) if short == "de" else 0.0, control)
        for tag, row in ROWS.items():
            put(f"{tag}_ctrl", math.radians(c.slopes[f"{row}_{short}"]), control)
    ElementTree.indent(plugin)
    comment = "\n".join(line.replace("--", "- -") for line in c.head(*LIMITS))
    return f"<!--\n{comment}\n-->\n{ElementTree.tostring(plugin, encoding='unicode')}\n"
