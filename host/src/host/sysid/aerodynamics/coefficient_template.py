"""Templates whose parameters are non-dimensional coefficients, so that these come out directly.

A dimensional derivative is a sum of coefficients times known gains: mass, inertia, dynamic
pressure and reference sizes of the condition; rolling and yawing moments mix through Ixz. Speed
derivatives and throttle terms stay as they are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from host.aircraft.gains import dimensional_gains
from host.aircraft.mass_properties import AirframeData, Condition
from host.sysid.models.state_space_model import LinearModel, Parameter, Term


def coefficient_template(
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
