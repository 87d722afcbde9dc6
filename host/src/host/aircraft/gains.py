"""Gains that turn coefficients into dimensional derivatives, and the inverse conversion.

Every conversion between the two uses these gains. Etkin & Reid, Dynamics of Flight, ch. 4.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from host.arrays import Array

if TYPE_CHECKING:
    from host.aircraft.mass_properties import AirframeData, Condition

# Force or moment of a dimensional derivative -> coefficient of the same force or moment.
COEFFICIENT_ROWS = {"Z": "CL", "D": "CD", "M": "Cm", "Y": "CY", "L": "Cl", "N": "Cn"}
DIMENSIONAL_ROWS = {c: d for d, c in COEFFICIENT_ROWS.items()}
MOMENTS = ("L", "N")  # mixed by Ixz


def dimensional_name(coefficient: str) -> str:
    """Return the name of a coefficient's dimensional derivative: ``M_q`` for ``Cm_q``."""
    row, _, label = coefficient.partition("_")
    return f"{DIMENSIONAL_ROWS[row]}_{label}"


def coefficient_name(derivative: str) -> str:
    """Return the name of a dimensional derivative's coefficient: ``Cm_q`` for ``M_q``."""
    row, _, label = derivative.partition("_")
    return f"{COEFFICIENT_ROWS[row]}_{label}"


def dimensional_gains(airframe: AirframeData, condition: Condition) -> dict[str, dict[str, float]]:
    """Return the gain of each coefficient in each dimensional derivative of the templates.

    Parameters
    ----------
    airframe : AirframeData
        Mass, inertia, reference sizes.
    condition : Condition
        Airspeed and dynamic pressure.

    Returns
    -------
    dict
        ``{"L_p": {"Cl_p": gain, "Cn_p": gain}, ...}`` in SI; rates against p_hat, q_hat, r_hat.
    """
    a, V = airframe, condition.airspeed_mps
    force = condition.qbar_pa * a.wing_area_m2
    det = a.ixx_kgm2 * a.izz_kgm2 - a.ixz_kgm2**2
    hat = {"q": 0.5 * a.chord_m / V, "p": 0.5 * a.span_m / V, "r": 0.5 * a.span_m / V}
    found: dict[str, dict[str, float]] = {}
    for label in ("alpha", "q", "de"):
        scale = force * hat.get(label, 1.0)
        found[f"Z_{label}"] = {f"CL_{label}": -scale / (a.mass_kg * V)}
        found[f"M_{label}"] = {f"Cm_{label}": scale * a.chord_m / a.iyy_kgm2}
    for label in ("alpha", "de"):
        found[f"D_{label}"] = {f"CD_{label}": -force / a.mass_kg}
    for label in ("beta", "p", "r", "da", "dr"):
        scale = force * hat.get(label, 1.0)
        moment = scale * a.span_m / det
        found[f"Y_{label}"] = {f"CY_{label}": scale / (a.mass_kg * V)}
        found[f"L_{label}"] = {
            f"Cl_{label}": moment * a.izz_kgm2,
            f"Cn_{label}": moment * a.ixz_kgm2,
        }
        found[f"N_{label}"] = {
            f"Cl_{label}": moment * a.ixz_kgm2,
            f"Cn_{label}": moment * a.ixx_kgm2,
        }
    return found


def coefficient_slopes(
    derivatives: Sequence[str], airframe: AirframeData, condition: Condition
) -> tuple[list[str], Array]:
    """Return which coefficients go with some dimensional derivatives, and in what proportion.

    The inverse of `dimensional_gains`. A rolling moment without its yawing moment, or the reverse,
    is solved with zero for the absent one. Names that are no derivative have no part in any.

    Parameters
    ----------
    derivatives : sequence of str
    airframe : AirframeData
        Mass, inertia, reference sizes.
    condition : Condition
        Airspeed and dynamic pressure.

    Returns
    -------
    list of str
    Array, shape (coefficients, derivatives)
    """
    gains = dimensional_gains(airframe, condition)
    place = {name: k for k, name in enumerate(derivatives)}
    names, slopes = [], []
    for name in gains:
        if name not in place:
            continue
        row, _, label = name.partition("_")
        coupled = [f"{d}_{label}" for d in (MOMENTS if row in MOMENTS else (row,))]
        inverse = np.linalg.inv([[gains[d][coefficient_name(c)] for c in coupled] for d in coupled])
        own = np.zeros(len(derivatives))
        for d, slope in zip(coupled, inverse[coupled.index(name)], strict=True):
            if d in place:
                own[place[d]] = slope
        names.append(coefficient_name(name))
        slopes.append(own)
    return names, np.array(slopes).reshape(len(names), len(derivatives))


def from_dimensional(
    derivatives: Mapping[str, float], airframe: AirframeData, condition: Condition
) -> dict[str, float]:
    """Return coefficients from dimensional derivatives, by `coefficient_slopes`."""
    names, slopes = coefficient_slopes(list(derivatives), airframe, condition)
    values = slopes @ np.array(list(derivatives.values()))
    return dict(zip(names, values.tolist(), strict=True))
