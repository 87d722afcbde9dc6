"""Advice that narrows a type's intervals: more aircraft, more flights, better calibration."""

from __future__ import annotations

import math

from host.fleet.statistics.spread_intervals import TypeEffect
from host.fleet.statistics.type_model import TypeModel

_WIDE = 0.10  # share of the mean: advice is given for larger half-widths
_FEW_AIRCRAFT = 8  # intervals of fewer are widened by their number itself
_MOST = 4


def advice_lines(model: TypeModel) -> list[str]:
    """Return what to do next, the derivatives of the widest means first."""
    lines = []
    if len(model.aircraft) < _FEW_AIRCRAFT:
        lines.append(
            f"fly more aircraft: {len(model.aircraft)} are few, from {_FEW_AIRCRAFT} on the"
            " intervals are narrow"
        )
    wide = {
        name: 0.5 * e.mean.width / abs(e.mean.value)
        for name, e in model.effects.items()
        if 0.5 * e.mean.width > _WIDE * abs(e.mean.value)
    }
    for name in sorted(wide, key=wide.__getitem__, reverse=True)[:_MOST]:
        share = 100.0 * wide[name]
        lines.append(f"{name}: +- {share:.0f} %: {_cause(model, name, model.effects[name])}")
    if model.single_aircraft:
        lines.append(f"fly a second aircraft with maneuvers for {', '.join(model.single_aircraft)}")
    return lines or ["nothing: every mean is known to 10 %"]


def _cause(model: TypeModel, name: str, effect: TypeEffect) -> str:
    """Return the advice that reduces the largest part of the mean's variance."""
    data = model.estimates[name]
    each = data.flights / data.fleet
    own = sum(data.variance.tolist()) / data.flights / each / data.fleet
    parts = {
        "measure once more what all aircraft share (drawing, aircraft file, calibration)":
            effect.shared_deviation**2,
        "fly more aircraft, they differ": effect.between.value**2 / data.fleet,
        "fly more flights of each, they differ": (
            0.0 if math.isnan(effect.within.value) else effect.within.value**2
        ) / data.flights,
        "fly longer or larger maneuvers for it: one flight has a wide interval": own,
        "calibrate each instrument better": sum(
            (data.local**2).sum(axis=1).tolist()
        ) / data.flights / data.fleet,
    }  # fmt: skip
    return max(parts, key=parts.__getitem__)
