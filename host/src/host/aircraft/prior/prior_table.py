"""Coefficients over the angle of attack, from whatever wrote them, in our axes at one angle."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from host.errors import UsageError

Points = dict[str, list[tuple[float, float]]]
RATES = ("p", "r")


class PriorError(UsageError):
    """A prior that cannot be used: what was found, what was expected."""


@dataclass(frozen=True, slots=True)
class PriorTable:
    """Coefficients over the angle of attack, and where they come from.

    Attributes
    ----------
    points : dict
        Name (as in the answer, per radian) to pairs of angle of attack, rad, and value.
    stability_axes : bool
        Whether rolling and yawing moments and rates are about stability axes.
    source : tuple of str
        In words: configuration, flight condition, reference sizes, axes as printed.
    half_widths : dict
        95 % half-width of some coefficients, the same at every angle of attack. `host fleet`
        writes them for the next aircraft of a fleet; a handbook has none.
    """

    points: Points
    stability_axes: bool
    source: tuple[str, ...] = field(default=())
    half_widths: dict[str, float] = field(default_factory=dict)

    @property
    def limits_rad(self) -> tuple[float, float]:
        """Least and largest angle of attack of the table, rad."""
        angles = [alpha for pairs in self.points.values() for alpha, _ in pairs]
        return min(angles), max(angles)

    def at(self, alpha_rad: float) -> dict[str, float]:
        """Return coefficients about body axes at an angle of attack.

        Linear between the rows of the table; beyond its ends the last row stands, turned by its
        own angle.
        """
        found = {}
        for name, pairs in self.points.items():
            angle, value = np.array(sorted(pairs)).T
            found[name] = float(np.interp(alpha_rad, angle, value))
        if not self.stability_axes:
            return found
        return about_body_axes(found, float(np.clip(alpha_rad, *self.limits_rad)))


def half_turned(names: Collection[str]) -> list[str]:
    """Return the names that cannot be turned to other axes, or not wholly: a partner is missing.

    Rolling moments turn together with yawing moments, derivatives by p with those by r.
    """
    found = []
    for name in names:
        row, _, last = name.partition("_")
        rows = ("Cl", "Cn") if row in ("Cl", "Cn") else (row,)
        lasts = RATES if last in RATES else (last,)
        if any(f"{r}_{x}" not in names for r in rows for x in lasts):
            found.append(name)
    return found


def about_body_axes(found: dict[str, float], alpha_rad: float) -> dict[str, float]:
    """Turn lateral derivatives from stability axes to body axes.

    x_s = x cos(alpha) + z sin(alpha), z_s = z cos(alpha) - x sin(alpha), for moments as for rates
    (Etkin & Reid, Dynamics of Flight, 3rd ed., app. B.12). A derivative whose partner is not in the
    table (Datcom knows no CY_r) stays as it was printed.
    """
    turned = dict(found)
    cos, sin = float(np.cos(alpha_rad)), float(np.sin(alpha_rad))
    for last in {name.split("_", 1)[1] for name in found}:
        roll, yaw = found.get(f"Cl_{last}"), found.get(f"Cn_{last}")
        if roll is not None and yaw is not None:
            turned[f"Cl_{last}"] = roll * cos - yaw * sin
            turned[f"Cn_{last}"] = roll * sin + yaw * cos
    for first in {name.split("_", 1)[0] for name in found}:
        rolling, yawing = (turned.get(f"{first}_{rate}") for rate in RATES)
        if rolling is not None and yawing is not None:
            turned[f"{first}_p"] = rolling * cos - yawing * sin
            turned[f"{first}_r"] = rolling * sin + yawing * cos
    return turned
