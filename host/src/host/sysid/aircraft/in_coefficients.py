"""Templates whose parameters are non-dimensional coefficients, so that these come out directly.

A dimensional derivative is a sum of coefficients times known gains: mass, inertia, dynamic
pressure and reference sizes of the condition; rolling and yawing moments mix through Ixz. Speed
derivatives and throttle terms stay as they are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from host.sysid.aircraft.airframe import AirframeData, Condition
from host.sysid.models.model import LinearModel, Parameter, Term


def dimensional_gains(airframe: AirframeData, condition: Condition) -> dict[str, dict[str, float]]:
    """Return, per dimensional derivative of the templates, the coefficients it is made of.

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
        if label != "q":
            found[f"D_{label}"] = {f"CD_{label}": -scale / a.mass_kg}
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


def in_coefficients(
    model: LinearModel, airframe: AirframeData, condition: Condition
) -> LinearModel:
    """Return a template with coefficients in place of the derivatives they determine.

    Start values are converted; bounds and priors of converted parameters are dropped.
    """
    gains = dimensional_gains(airframe, condition)
    names: list[str] = []
    for parameter in model.parameters:
        for name in gains.get(parameter.name, {parameter.name: 1.0}):
            if name not in names:
                names.append(name)
    terms = tuple(
        Term(t.matrix, t.row, t.column, name, t.gain * gain)
        for t in model.terms
        for name, gain in gains.get(t.parameter, {t.parameter: 1.0}).items()
    )
    rule = np.zeros((len(model.parameters), len(names)))
    for row, parameter in enumerate(model.parameters):
        for name, gain in gains.get(parameter.name, {parameter.name: 1.0}).items():
            rule[row, names.index(name)] = gain
    start = np.linalg.lstsq(rule, model.start, rcond=None)[0]
    kept = {p.name: p for p in model.parameters if p.name not in gains}
    return replace(
        model,
        name=f"{model.name} in coefficients",
        terms=terms,
        parameters=tuple(
            kept.get(name, Parameter(name, float(value)))
            for name, value in zip(names, start, strict=True)
        ),
    )
