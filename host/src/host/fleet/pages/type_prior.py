"""A type as a prior for `host identify --prior`: coefficients to expect of its next aircraft."""

from __future__ import annotations

import math

from host.export.toml import dumps
from host.fleet.pages.type_text import half
from host.fleet.statistics.type_model import TypeModel


def type_prior(model: TypeModel) -> str:
    """Return the prior as TOML: coefficients, and the 95 % half-width of each."""
    effects = {
        name: effect.new_aircraft
        for name, effect in model.effects.items()
        if math.isfinite(effect.new_aircraft.width)
    }
    return dumps(
        {
            "title": f"{model.name}: a further aircraft, from {len(model.flights)} flights of"
            f" {len(model.aircraft)}",
            "alpha_deg": [round(math.degrees(model.alpha_rad()), 2)],
            "coefficients": {name: float(x.value) for name, x in effects.items()},
            "half_width": {name: float(half(x)) for name, x in effects.items()},
        }
    )
