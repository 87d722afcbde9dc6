"""An aircraft of which only dimensions and mass were measured: turned into an aircraft file.

A file of dimensions has `span_m` and `wing_area_m2` at its top and neither format nor kind, as
those in `dimensions/`. The handbook estimates its coefficients to 10 to 30 % each.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from host.aircraft import handbook
from host.errors import UsageError
from host.files.toml_reader import listed, number

# Dimension -> least and most: a length below a millimetre or above a jumbo is another unit.
_LENGTH, _AREA, _SHARE = (1e-3, 100.0), (1e-4, 1000.0), (0.01, 0.99)
_RANGES: dict[str, tuple[float, float]] = {
    **dict.fromkeys(
        ("span_m", "length_m", "tail_span_m", "tail_arm_m", "fin_height_m", "fin_arm_m",
         "fuselage_width_m", "fuselage_depth_m", "fuselage_length_m", "propeller_diameter_m"),
        _LENGTH,
    ),
    **dict.fromkeys(("wing_area_m2", "tail_area_m2", "fin_area_m2"), _AREA),
    **dict.fromkeys(("elevator_chord", "rudder_chord", "aileron_chord"), _SHARE),
    **dict.fromkeys(
        ("wing_below_axis_m", "tail_above_axis_m", "fin_centre_above_m", "hub_ahead_m"),
        (-50.0, 50.0),
    ),
    **dict.fromkeys(("section_zero_lift_deg", "dihedral_deg", "wing_incidence_deg"), (-30.0, 30.0)),
    **dict.fromkeys(
        ("airspeed_mps", "minimum_airspeed_mps", "maximum_airspeed_mps"), (1.0, 300.0)
    ),
    "mass_kg": (1e-3, 1e6), "section_cm": (-1.0, 1.0), "cg_chord": (-0.5, 1.5),
    "aileron_inner": (0.0, 0.99), "aileron_outer": (0.01, 1.0), "profile_drag": (1e-3, 0.5),
    "rotor_inertia_kgm2": (1e-8, 100.0),
}  # fmt: skip


def is_dimensions(document: Mapping[str, object]) -> bool:
    """Return whether a document is a list of dimensions, and no aircraft file."""
    return "kind" not in document and "span_m" in document and "wing_area_m2" in document


def from_dimensions(
    document: Mapping[str, object], source: str | Path, error: type[UsageError]
) -> dict[str, object]:
    """Return the aircraft file that handbook methods give for these dimensions.

    Parameters
    ----------
    document : mapping
        As `dimensions/kadetlt40.toml`; `name`, `title`, `published` may be left out.
    source : str or Path
        Name of the file in messages.
    error : type
        What to raise.

    Raises
    ------
    UsageError
        As `error`: a dimension is missing, none, or out of its range, in one line.
    """
    missing = [key for key in (*_RANGES, "motor_power_w") if key not in document]
    if missing:
        raise error(
            f"{source}: no {', '.join(missing)}; dimensions are those of"
            f" {handbook.DIMENSIONS / 'kadetlt40.toml'}"
        )
    for key, (least, most) in _RANGES.items():
        value = number(f"{source}: {key}", document[key], error)
        if not least <= value <= most:
            raise error(f"{source}: {key} is {value:g}, expected {least:g} to {most:g}")
    for k, power in enumerate(listed(f"{source}: motor_power_w", document["motor_power_w"], error)):
        number(f"{source}: motor_power_w[{k}]", power, error)
    usual = {"name": Path(source).stem, "title": Path(source).stem, "published": "measured"}
    try:
        made = handbook.document(usual | dict(document))
        return {key: _plain(value) for key, value in made.items()}
    except (ArithmeticError, ValueError) as reason:
        raise error(f"{source}: no aircraft has these dimensions: {reason}") from None


def _plain(value: object) -> object:
    """Return a value as TOML holds it: lists where the handbook has arrays."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    return value.tolist() if isinstance(value, np.ndarray) else value
