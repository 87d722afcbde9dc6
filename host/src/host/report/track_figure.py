"""The ground track as a picture: metres east and north, test points coloured and numbered."""

from __future__ import annotations

from typing import Any

import numpy as np

from host.report.ground_track import ground_track
from host.report.shown_flight import ShownFlight


def track_figure(flight: ShownFlight) -> Any | None:
    """Return the track as a figure of matplotlib, None without GPS."""
    from matplotlib.figure import Figure

    track = ground_track(flight)
    if track is None:
        return None
    t_s = np.asarray(track["t_s"])
    east, north = (np.asarray(track[name], np.float64) for name in ("east_m", "north_m"))
    figure = Figure((5.0, 4.0), layout="constrained")
    axis = figure.subplots()
    axis.plot(east, north, color="0.7", lw=0.8)
    for number, (item, _) in enumerate(flight.maneuvers, start=1):
        inside = (t_s >= item.start_s) & (t_s <= item.end_s)
        if np.isfinite(east[inside]).any():
            axis.plot(east[inside], north[inside], lw=2.2, color=f"C{(number - 1) % 10}")
            first = int(np.argmax(inside & np.isfinite(east)))
            axis.annotate(str(number), (east[first], north[first]), xytext=(4, 4),
                          textcoords="offset points", fontsize=7)  # fmt: skip
    axis.set_aspect("equal", adjustable="datalim")
    axis.set_xlabel("east, m", fontsize=8)
    axis.set_ylabel("north, m", fontsize=8)
    axis.tick_params(labelsize=7)
    axis.grid(color="0.93", lw=0.5)
    return figure
