"""The model of a type, in lines for a terminal and as JSON."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from host.fleet.statistics.spread_intervals import Interval
from host.fleet.statistics.type_model import DIFFERS, TypeModel


def type_lines(model: TypeModel) -> list[str]:
    """Return mean and spreads of every derivative, and what differs between aircraft."""
    lines = [f"{model.name}: {len(model.aircraft)} aircraft, {len(model.flights)} flights"]
    lines.append(condition_text(model))
    if not model.effects:
        return [*lines, "  one aircraft: its spread from others is not known; add a second one"]
    lines.append(
        f"{'':12s} {'mean':>10s} {'95 %':>9s}  {'between aircraft':>24s}  {'between flights':>24s}"
        f"  {'new aircraft':>20s}"
    )
    for name, e in model.effects.items():
        new = e.new_aircraft
        lines.append(
            f"{name:12s} {e.mean.value:10.4g} {half(e.mean):9.2g}  {spread(e.between):>24s}"
            f"  {spread(e.within):>24s}  {new.value:9.4g} +- {half(new):.2g}"
        )
    differing = model.differing()
    lines += [
        "differ between aircraft (p < 0.05): " + (
            ", ".join(f"{n} ({_chance(model.effects[n].differs)})" for n in differing)
            if differing else "none"
        )
    ]  # fmt: skip
    if model.single_aircraft:
        lines.append(f"estimated from one aircraft only: {', '.join(model.single_aircraft)}")
    return lines


def condition_text(model: TypeModel) -> str:
    """Return the reference of the coefficients: one CG, and the flight condition."""
    alpha = np.degrees(model.conditions("alpha_rad"))
    speed = np.array(model.conditions("airspeed_mps"))
    place = "" if model.cg_m is None else ", ".join(f"{x:.3f}" for x in model.cg_m) + " m"
    return (f"moments about {place}; " if place else "") + (
        f"alpha {np.median(alpha):.1f} deg, airspeed {np.median(speed):.1f} m/s (flights:"
        f" {alpha.min():.1f} to {alpha.max():.1f}, {speed.min():.1f} to {speed.max():.1f})"
    )


def type_document(model: TypeModel) -> dict[str, Any]:
    """Return the same as plain numbers; what is not known is null."""
    return {
        "type": model.name,
        "aircraft": model.aircraft,
        "flights": len(model.flights),
        "cg_m": None if model.cg_m is None else list(model.cg_m),
        "alpha_rad": model.alpha_rad(),
        "airspeed_mps": float(np.median(model.conditions("airspeed_mps"))),
        "told_by_one_aircraft": list(model.single_aircraft),
        "derivatives": {
            name: {
                "mean": _ends(e.mean),
                "between_aircraft": _ends(e.between),
                "between_flights": _ends(e.within),
                "new_aircraft": _ends(e.new_aircraft),
                "differ": e.differs < DIFFERS,
                "p_value": e.differs,
                "shared_deviation": e.shared_deviation,
                "aircraft": e.aircraft,
                "flights": e.flights,
            }
            for name, e in model.effects.items()
        },
    }


def half(interval: Interval) -> float:
    """Return the half-width of an interval about its value."""
    return 0.5 * interval.width


def spread(interval: Interval) -> str:
    """Return a spread with its interval in words."""
    if math.isnan(interval.value):
        return "not known"
    upper = f"{interval.upper:.2g}" if math.isfinite(interval.upper) else "?"
    return f"{interval.value:.2g} ({interval.lower:.2g} to {upper})"


def _ends(interval: Interval) -> dict[str, float | None]:
    named = {"value": interval.value, "lower": interval.lower, "upper": interval.upper}
    return {name: x if math.isfinite(x) else None for name, x in named.items()}


def _chance(p: float) -> str:
    return f"p {p:.2g}" if p >= 1e-4 else "p < 0.0001"
