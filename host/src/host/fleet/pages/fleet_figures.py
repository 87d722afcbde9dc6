"""Pictures of a type: a funnel of every derivative, the drift of every aircraft."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from host.constants import NORMAL_95
from host.fleet.pages.aircraft_changes import AircraftHistory
from host.fleet.statistics.changes import BASELINE
from host.fleet.statistics.type_model import TypeModel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS = ("#1d4ed8", "#b45309", "#15803d", "#7c3aed", "#be123c", "#0e7490")
_MARKS = "osD^vP"
_MOST_COLUMNS = 4
_MOST_DRIFTS = 4  # derivatives of one aircraft: more are too small to read


def funnel_figure(model: TypeModel, name: str) -> Figure:
    """Return a funnel plot: every flight's estimate over its standard deviation, with 95 % limits.

    Limits are the mean and 1.96 times the deviation, spread between flights included; the grey
    band is the interval of a new aircraft.
    """
    from matplotlib.figure import Figure

    effect = model.effects[name]
    figure = Figure(figsize=(5.2, 3.6), layout="constrained")
    axes = figure.subplots()
    flights = [f for f in model.flights if f.has_estimate(name)]
    deviation = np.array([math.sqrt(f.total_variance(name)) for f in flights])
    widths = np.linspace(0.0, 1.1 * float(deviation.max()), 60)
    within = 0.0 if math.isnan(effect.within.value) else effect.within.value
    reach = NORMAL_95 * np.hypot(widths, math.hypot(within, effect.between.value))
    middle, new = effect.mean.value, effect.new_aircraft
    axes.plot(middle - reach, widths, "-", middle + reach, widths, "-", color="#6b7280", lw=1)
    axes.axvspan(new.lower, new.upper, color="#e5e7eb", zorder=0)
    axes.axvspan(effect.mean.lower, effect.mean.upper, color="#c7d2fe", zorder=0)
    axes.axvline(middle, color="#111827", lw=1)
    for number, aircraft in enumerate(model.aircraft):
        own = [k for k, f in enumerate(flights) if f.aircraft == aircraft]
        values = [flights[k].values[flights[k].names.index(name)] for k in own]
        turn = number // len(_COLOURS) % len(_MARKS)
        axes.plot(
            values,
            deviation[own],
            _MARKS[turn],
            color=_COLOURS[number % len(_COLOURS)],
            ms=4,
            label=aircraft,
        )
    axes.set(ylim=(float(widths[-1]), 0.0), xlabel=name, ylabel="standard deviation of the flight")
    if len(model.aircraft) <= 12:
        axes.legend(fontsize=6, ncols=2)
    axes.margins(x=0.15)
    return figure


def drift_figure(model: TypeModel, one: AircraftHistory) -> Figure | None:
    """Return a picture of an aircraft's estimates flight by flight; None of fewer than three."""
    from matplotlib.figure import Figure

    if len(one.flights) < 3 or not one.names:
        return None
    names = _shown(model, one)
    columns = min(len(names), _MOST_COLUMNS)
    rows = math.ceil(len(names) / columns)
    figure = Figure(figsize=(3.4 * columns, 2.1 * rows), layout="constrained")
    places = np.atleast_1d(figure.subplots(rows, columns, sharex=True)).ravel()
    count = np.arange(1, len(one.flights) + 1)
    for axes, name in zip(places, names, strict=False):
        at = [f.names.index(name) for f in one.flights]
        values = [f.values[k] for f, k in zip(one.flights, at, strict=True)]
        halves = [NORMAL_95 * math.sqrt(f.own[k, k]) for f, k in zip(one.flights, at, strict=True)]
        axes.errorbar(count, values, halves, fmt="o", ms=3, lw=1, color="#1d4ed8")
        base = float(np.mean(values[:BASELINE]))
        axes.axhline(base, color="#6b7280", lw=1)
        if len(count) > BASELINE:
            axes.axvline(BASELINE + 0.5, color="#6b7280", lw=1, ls=":")
        if one.alarms:
            axes.axvspan(one.alarms[0].since + 0.5, len(count) + 0.5, color="#fecaca", zorder=0)
        axes.set_title(name, fontsize=9)
        axes.tick_params(labelsize=7)
    for axes in places[len(names) :]:
        axes.set_visible(False)
    for axes in places[-columns:]:
        axes.set_xlabel("flight", fontsize=8)
    return figure


def _shown(model: TypeModel, one: AircraftHistory) -> list[str]:
    """Return the quantities that changed, and the best known derivatives, where a change shows."""
    share = {
        n: e.mean_deviation / max(abs(e.mean.value), 1e-300)
        for n, e in model.effects.items()
        if n in one.names
    }
    moved = [one.names[k] for k in one.alarms[-1].moved] if one.alarms else []
    best = [*moved, *sorted(share, key=share.__getitem__), *one.names]
    chosen = set(list(dict.fromkeys(best))[:_MOST_DRIFTS])
    return [n for n in one.names if n in chosen]
