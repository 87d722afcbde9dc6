"""Coefficients predicted before the flight (handbook, vortex lattice), to compare with the answer.

TOML (`[coefficients]` with names as in the answer, per radian, body axes; with `alpha_deg = [...]`
each may be a list, a table over the angle of attack; `[half_width]` their 95 % half-widths, as
`host fleet` writes them), text that AVL writes with ST or SB (`avl`),
or Digital Datcom's output (`datcom`). Tables are read between their rows at the flight's angle of
attack, lateral derivatives turned from stability to body axes there. Signs are the house's: body
axes x forward, y right, z down; elevator and aileron as in the answer. Coefficients are referred
to the file's own area, chord and span, which are printed with them where the file has them. An
aircraft file or one of dimensions serves too: what it says before it is flown.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from host.aircraft.dimension_file import is_dimensions
from host.aircraft.prior.aircraft_prior import aircraft_prior
from host.aircraft.prior.avl import is_avl, read_avl
from host.aircraft.prior.datcom import is_datcom, read_datcom
from host.aircraft.prior.prior_table import Points, PriorError, PriorTable
from host.files.quantities import Quantity
from host.files.user_text import parse_toml, read_text, shown

_ALPHA = Quantity("deg", -180.0, 180.0, "half a turn")
# Roskam, Heffley: Cm_q -40, Cm_alphadot -20; per degree they would be 57 times smaller.
_HALF_WIDTH = Quantity("", 1e-12, 1000.0, "as of the coefficients, above zero")
COEFFICIENT = Quantity("", -1000.0, 1000.0, "twenty times the largest of published tables")
SOUND_MPS = 340.3  # standard atmosphere, sea level: chooses between Mach numbers of a handbook


def read_prior(path: Path, airspeed_mps: float = 0.0) -> PriorTable:
    """Return coefficients over the angle of attack.

    Parameters
    ----------
    path : Path
        TOML, AVL's ST or SB output, Datcom's output, or an aircraft: its file or its name.
    airspeed_mps : float
        Airspeed of the flight: it says which of several Mach numbers is taken.

    Raises
    ------
    PriorError
        If the file cannot be read, holds no coefficient, or one that is no number.
    AircraftError
        The same of an aircraft.
    """
    if not path.suffix and not path.exists():
        return aircraft_prior(path)
    text = read_text(path, PriorError, "prior", encoding_errors="replace")
    toml = parse_toml(text, str(path), PriorError) if path.suffix == ".toml" else None
    if toml is not None and ("kind" in toml or is_dimensions(toml)):
        return aircraft_prior(path)
    table: PriorTable | None = None
    try:
        if toml is not None:
            table = _from_toml(toml)
        elif is_datcom(text):
            table = read_datcom(text, airspeed_mps / SOUND_MPS)
        elif is_avl(text):
            table = read_avl(text)
    except (ValueError, TypeError, PriorError) as error:
        raise PriorError(f"{path}: {error}") from error
    if table is None or not table.points:
        raise PriorError(
            f"{path}: no coefficient; expected TOML with [coefficients], or output of AVL (ST, SB)"
            " or Datcom"
        )
    for name, pairs in table.points.items():
        for _, value in pairs:
            COEFFICIENT.check(f"{path}: {name}", value, PriorError)
    return table


def _from_toml(document: dict[str, Any]) -> PriorTable:
    listed, table = document.get("alpha_deg", [0.0]), document.get("coefficients", {})
    if not isinstance(listed, list) or not listed:
        raise ValueError(f"alpha_deg is {shown(listed)}, expected a list of angles")
    if not isinstance(table, dict):
        raise ValueError(f"coefficients is {shown(table)}, expected a table [coefficients]")
    angles = [_ALPHA.check("alpha_deg", x, PriorError) for x in listed]
    if np.any(np.diff(angles) <= 0.0):
        raise ValueError(f"alpha_deg {shown(angles)}, expected rising angles")
    points: Points = {}
    for name, value in table.items():
        values = value if isinstance(value, list) else [value] * len(angles)
        if len(values) != len(angles):
            raise ValueError(f"{name} has {len(values)} values, alpha_deg {len(angles)}")
        points[str(name)] = [
            (float(np.radians(a)), COEFFICIENT.check(name, v, PriorError))
            for a, v in zip(angles, values, strict=True)
        ]
    return PriorTable(points, stability_axes=False, half_widths=_half_widths(document, points))


def _half_widths(document: dict[str, Any], points: Points) -> dict[str, float]:
    """Return the 95 % half-widths of a file that has some."""
    table = document.get("half_width", {})
    if not isinstance(table, dict):
        raise ValueError(f"half_width is {shown(table)}, expected a table [half_width]")
    unknown = [name for name in table if name not in points]
    if unknown:
        raise ValueError(f"half_width.{unknown[0]}: no coefficient of this name")
    return {
        str(name): _HALF_WIDTH.check(f"half_width.{name}", value, PriorError)
        for name, value in table.items()
    }
