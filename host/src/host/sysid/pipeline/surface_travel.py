"""Surfaces of an autopilot's log, shares of full travel, as the angles an aircraft file gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from host.aircraft.file import load_measured
from host.arrays import Array
from host.sysid.pipeline.known_aircraft import AircraftData


def with_surface_angles(
    columns: Mapping[str, Array], shares: Sequence[str], known: AircraftData | None
) -> tuple[dict[str, Array], list[str]]:
    """Return columns with surfaces in rad, and a note about those of which nobody knows the travel.

    Parameters
    ----------
    columns : mapping of (n,) arrays
    shares : sequence of str
        Surfaces whose column is a share of full travel.
    known : AircraftData, optional
        Its file's ``[surfaces]`` says how far full travel is.
    """
    if not shares:
        return dict(columns), []
    scalars = load_measured(known.source).scalars if known is not None else {}
    travel = {name: scalars.get(f"surfaces.{name}_limit_rad") for name in shares}
    result = dict(columns)
    for name, limit_rad in travel.items():
        if limit_rad is not None and f"{name}_rad" in result:
            result[f"{name}_rad"] = result[f"{name}_rad"] * limit_rad
    unknown = [name for name, limit_rad in travel.items() if limit_rad is None]
    if not unknown:
        return result, []
    return result, [
        f"{', '.join(unknown)}: the log has shares of full travel and no aircraft file gives its"
        " [surfaces] limits: 1 rad in a column is full deflection, and derivatives of these"
        " inputs are per full deflection"
    ]
