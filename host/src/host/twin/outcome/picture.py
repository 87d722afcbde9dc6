"""A picture of a flight: air data, rates, surfaces, with the maneuvers shaded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from host.aircraft.airframe import Array
from host.constants import DEG_PER_RAD
from host.twin.faults import Fault

COLOURS = {"elevator": "#1f77b4", "aileron": "#ff7f0e", "rudder": "#2ca02c", "throttle": "#9467bd"}
FAULT_COLOUR = "#d62728"
SETTLED_S = 6.5  # what comes before is the ground and the launch
# Rows: label, (column, legend, factor) ...
ROWS: tuple[tuple[str, tuple[tuple[str, str, float], ...]], ...] = (
    ("airspeed\nm/s", (("airspeed_mps", "V", 1.0),)),
    ("flow\ndeg", (("alpha_rad", "alpha", DEG_PER_RAD), ("beta_rad", "beta", DEG_PER_RAD))),
    (
        "rates\ndeg/s",
        (
            ("p_radps", "p", DEG_PER_RAD),
            ("q_radps", "q", DEG_PER_RAD),
            ("r_radps", "r", DEG_PER_RAD),
        ),
    ),
    ("specific\nforce m/s2", (("ay_mps2", "ay", 1.0), ("az_mps2", "az", 1.0))),
    ("attitude\ndeg", (("phi_rad", "phi", DEG_PER_RAD), ("theta_rad", "theta", DEG_PER_RAD))),
    (
        "surfaces\ndeg",
        (
            ("elevator_rad", "elevator", DEG_PER_RAD),
            ("aileron_rad", "aileron", DEG_PER_RAD),
            ("rudder_rad", "rudder", DEG_PER_RAD),
        ),
    ),
    ("throttle", (("throttle", "throttle", 1.0),)),
)


def draw(
    table: pd.DataFrame,
    path: Path,
    *,
    title: str,
    windows: Sequence[Mapping[str, object]] = (),
    faults: Sequence[Fault] = (),
    truth: Mapping[str, Array] | None = None,
    second: pd.DataFrame | None = None,
    second_name: str = "",
    power_on_s: float = 0.0,
) -> None:
    """Draw a flight to an image file.

    Parameters
    ----------
    table : DataFrame
        Decoded or ideal table, SI.
    path : Path
        PNG, SVG or PDF by its suffix.
    title : str
    windows : sequence of mappings
        ``kind``, ``axes``, ``start_s``, ``end_s`` of each maneuver, on the table's time.
    faults : sequence of Fault
        Red, from where they begin to where they end.
    truth : mapping, optional
        True columns (grey, behind), with ``t_s``.
    second : DataFrame, optional
        The same flight as another logger saw it (black steps), named `second_name`.
    power_on_s : float
        On the table's time.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    rows = [
        (label, lines)
        for label, lines in ROWS
        if any(column in table.columns for column, _, _ in lines)
    ]
    figure, axes = pyplot.subplots(
        len(rows), 1, sharex=True, figsize=(14, 1.7 * len(rows) + 1.2), layout="constrained"
    )
    t = table["t_s"].to_numpy()
    for axis, (label, lines) in zip(np.atleast_1d(axes), rows, strict=True):
        seen: list[Array] = []
        for i, (column, name, factor) in enumerate(lines):
            if column not in table.columns:
                continue
            values = table[column].to_numpy() * factor
            colour = COLOURS.get(name, f"C{i}")
            if truth is not None and column in truth:
                word = "truth" if i == 0 else None
                true_values = truth[column] * factor
                axis.plot(truth["t_s"], true_values, color="0.72", lw=1.6, zorder=1, label=word)
            axis.plot(t, values, color=colour, lw=0.8, label=name, zorder=2)
            seen.append(values[t > t[0] + SETTLED_S])
            if second is not None and column in second.columns:
                other = second[column].to_numpy() * factor
                late = second["t_s"].to_numpy()
                word = second_name if i == 0 else None
                axis.step(late, other, where="post", color="k", lw=0.6, zorder=3, label=word)
                seen.append(other[late > t[0] + SETTLED_S])
        # The jump at the launch would flatten everything: the scale follows the flight.
        flown = np.concatenate(seen) if seen else np.array([])
        flown = flown[np.isfinite(flown)]
        if len(flown):
            low, high = flown.min(), flown.max()
            margin = 0.06 * max(high - low, 1e-3)
            axis.set_ylim(low - margin, high + margin)
        for window in windows:
            kinds = window["axes"]
            first = str(kinds[0]) if isinstance(kinds, Sequence) and kinds else ""
            start, end = float(str(window["start_s"])), float(str(window["end_s"]))
            axis.axvspan(start, end, color=COLOURS.get(first, "0.5"), alpha=0.13, lw=0, zorder=0)
        for fault in faults:
            axis.axvline(fault.at_s, color=FAULT_COLOUR, lw=0.8, ls="--", zorder=1)
            if fault.end_s < t[-1]:
                axis.axvspan(fault.at_s, fault.end_s, color=FAULT_COLOUR, alpha=0.10, lw=0)
        axis.set_ylabel(label, fontsize=9)
        axis.grid(alpha=0.3)
        axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8, frameon=False)
    top = np.atleast_1d(axes)[0]
    for window in windows:
        kinds = window["axes"]
        names = ", ".join(str(k) for k in kinds) if isinstance(kinds, Sequence) else ""
        middle = 0.5 * (float(str(window["start_s"])) + float(str(window["end_s"])))
        top.annotate(
            f"{window['kind']} {names}", (middle, 1.04), xycoords=("data", "axes fraction"),
            ha="center", va="bottom", fontsize=7, rotation=90,
        )  # fmt: skip
    for fault in faults:
        top.annotate(
            " ".join((fault.kind, fault.channel)).strip(), (fault.at_s, 0.03),
            xycoords=("data", "axes fraction"), ha="right", va="bottom", fontsize=7, rotation=90,
            color=FAULT_COLOUR, bbox={"fc": "white", "alpha": 0.7, "lw": 0, "pad": 0.5},
        )  # fmt: skip
    figure.suptitle(title, fontsize=11)
    np.atleast_1d(axes)[-1].set_xlabel(f"time, s; power-on at {power_on_s:.2f}")
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
