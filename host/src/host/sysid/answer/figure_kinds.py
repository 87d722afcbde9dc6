"""The kinds of picture an answer is drawn with: histories, poles, intervals, spectra."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from host.constants import DEG_PER_RAD
from host.errors import IdentificationError
from host.extras import install_hint

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from host.arrays import Array

MEASURED, MODEL, RESIDUAL, MARKED, TRUTH = "0.7", "C3", "C0", "C3", "black"
INPUT, HELD_OUT_SHADE = "C2", "#fdf3dc"
SHOWN_UNITS = {
    "_radps": ("deg/s", DEG_PER_RAD),
    "_rad": ("deg", DEG_PER_RAD),
    "_mps2": ("m/s2", 1.0),
    "_mps": ("m/s", 1.0),
    "_n": ("N", 1.0),
    "_w": ("W", 1.0),
}
IN_A_LINE = 4  # maneuvers whose names fit side by side
TRUSTED, REACH = 10.0, 60.0  # %, of intervals: trusted, and the end of the scale
COLOURS, STROKES = 10, ("-", "--", ":", "-.")
SHOWN_HZ = (0.05, 20.0)  # of the spectra


@dataclass(frozen=True, slots=True)
class Trace:
    """A stretch of one signal, each (n,): time, what was measured, what the model says.

    What the fit did not see is drawn on a shade."""

    t_s: Array
    measured: Array
    model: Array
    title: str = ""
    held_out: bool = False  # held out of the fit


@dataclass(frozen=True, slots=True)
class Cloud:
    """A pole and where it may be: real and imaginary parts of its draws, each (n,).

    `truth` is known of simulated flights only.
    """

    name: str
    pole: complex
    real: Array
    imaginary: Array
    truth: complex | None = None


@dataclass(frozen=True, slots=True)
class Bar:
    """A parameter with its 95 % half-width; `scale` is what both are drawn against.

    That is the estimate, or what would contribute 5 % of its row's largest where that is more
    (`of_row`). `truth` is known of simulated flights only.
    """

    name: str
    value: float
    half_width: float
    scale: float
    marked: bool
    truth: float | None = None

    @property
    def of_row(self) -> bool:
        """Whether the scale is that of the row."""
        return self.scale > abs(self.value) * (1.0 + 1e-9)


@dataclass(frozen=True, slots=True)
class Excitation:
    """One input of one maneuver, (n,), to be shown as a spectrum."""

    label: str
    dt_s: float
    values: Array


def histories(
    signals: dict[str, list[Trace]],
    title: str,
    inputs: Mapping[str, Sequence[tuple[Array, Array]]] | None = None,
) -> Figure:
    """Draw each signal measured and by the model, the difference beneath; angles in degrees.

    Parameters
    ----------
    signals : dict
        Traces of each output.
    title : str
    inputs : mapping, optional
        Pieces of time (s) and value of each input, drawn beneath all outputs.
    """
    inputs = inputs or {}
    rows = len(signals)
    count = max((len(traces) for traces in signals.values()), default=1)
    figure = empty_figure((max(9.0, 1.1 * count), 2.2 * rows + 1.1 * len(inputs)))
    heights = [3, 1] * rows + [2] * len(inputs)
    panels = figure.subplots(len(heights), 1, squeeze=False, height_ratios=heights)
    axes = list(panels[:, 0])
    for k, (name, traces) in enumerate(signals.items()):
        over, under = axes[2 * k], axes[2 * k + 1]
        label, scale = shown(name)
        for trace in traces:
            measured, model = scale * trace.measured, scale * trace.model
            over.plot(trace.t_s, measured, color=MEASURED, lw=2.4)
            over.plot(trace.t_s, model, color=MODEL, lw=0.8)
            under.plot(trace.t_s, measured - model, color=RESIDUAL, lw=0.6)
            if trace.held_out:
                for axis in (over, under):
                    axis.axvspan(
                        trace.t_s[0], trace.t_s[-1], color=HELD_OUT_SHADE, lw=0.0, zorder=-1
                    )
        under.axhline(0.0, color="0.8", lw=0.6, zorder=0)
        over.set_ylabel(label, fontsize=8)
        under.set_ylabel("difference", fontsize=6)
        for axis in (over, under):
            axis.tick_params(labelsize=7, labelbottom=axis is axes[-1])
            axis.set_xlim(over.get_xlim())
        for trace in traces:
            over.annotate(
                _broken(trace.title) if count > IN_A_LINE else trace.title,
                (float(trace.t_s[0]), 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(0, 2),
                textcoords="offset points",
                fontsize=6,
            )
    for axis, (name, pieces) in zip(axes[2 * rows :], inputs.items(), strict=True):
        label, scale = shown(name)
        for t_s, values in pieces:
            axis.plot(t_s, scale * values, color=INPUT, lw=0.9)
        axis.set_ylabel(label, fontsize=8)
        axis.tick_params(labelsize=7, labelbottom=axis is axes[-1])
        axis.set_xlim(axes[0].get_xlim())
    figure.suptitle(title, fontsize=10)
    axes[-1].set_xlabel("time, maneuvers one behind the other, s", fontsize=8)
    figure.align_ylabels(axes)
    return figure


def shown(name: str) -> tuple[str, float]:
    """Return the label of a signal in a picture, and the factor to the unit named there."""
    for ending, (unit, scale) in SHOWN_UNITS.items():
        if name.endswith(ending):
            return f"{name.removesuffix(ending)}, {unit}", scale
    return name, 1.0


def _broken(title: str) -> str:
    """Return '3-2-1-1 on elevator at 8.4 s' in three lines: many maneuvers stand side by side."""
    return title.replace(" on ", "\n").replace(" at ", "\n")


def pole_map(clouds: Sequence[Cloud], title: str) -> Figure:
    """Draw all poles, and each mode with its scatter in a panel of its own scale."""
    rows = (len(clouds) + 1) // 2
    figure = empty_figure((8.0, 3.4 + 2.4 * rows))
    grid = figure.add_gridspec(1 + rows, 2, height_ratios=[3] + [2] * rows)
    overview = figure.add_subplot(grid[0, :])
    for cloud in clouds:
        _cloud(overview, cloud)
    overview.axvline(0.0, color="0.7", lw=0.8)
    overview.axhline(0.0, color="0.9", lw=0.8, zorder=0)
    overview.margins(x=0.08, y=0.12)
    if not any(abs(cloud.pole.imag) > 0.0 for cloud in clouds):
        overview.set_ylim(-1.0, 1.0)  # else the scale is that of rounding
    _name_poles(overview, [(c.name, c.pole) for c in clouds])
    overview.set_xlabel("real, 1/s")
    overview.set_ylabel("imaginary, rad/s")
    known = any(cloud.truth is not None for cloud in clouds)
    mark = "; diamonds, dashed: the simulated aircraft" if known else ""
    overview.set_title(f"{title}{mark}", fontsize=10)
    for k, cloud in enumerate(clouds):
        near = figure.add_subplot(grid[1 + k // 2, k % 2])
        if cloud.pole.imag:
            _cloud(near, cloud, mirrored=False)
            near.set_ylabel("imaginary, rad/s", fontsize=7)
        else:
            near.hist(cloud.real, bins=24, color=RESIDUAL, alpha=0.5)
            near.axvline(cloud.pole.real, color=MODEL, lw=1.6)
            if cloud.truth is not None:
                near.axvline(cloud.truth.real, color=TRUTH, lw=1.2, ls="--")
            near.set_ylabel("draws", fontsize=7)
        near.set_title(cloud.name, fontsize=8)
        near.set_xlabel("real, 1/s", fontsize=7)
        near.tick_params(labelsize=7)
        near.locator_params(axis="x", nbins=5)
        if near.get_xlim()[1] > 0.0:
            near.axvline(0.0, color="0.7", lw=0.8)
    return figure


def interval_bars(bars: Sequence[Bar], title: str) -> Figure:
    """Draw each parameter's interval as a share of its scale; red where it is marked.

    A disc stands on a bar whose scale is the estimate, a hollow square on one whose scale is what
    would contribute 5 % of its row's largest.
    """
    figure = empty_figure((8.5, 0.32 * len(bars) + 1.8))
    axis = figure.subplots()
    widest = max((100.0 * b.half_width / b.scale for b in bars), default=0.0)
    reach = float(np.clip(1.15 * widest, 15.0, REACH))
    axis.axvspan(-TRUSTED, TRUSTED, color="0.93", lw=0.0, zorder=0)
    for position, bar in enumerate(reversed(bars)):
        share = 100.0 * bar.half_width / bar.scale
        colour = MARKED if bar.marked else RESIDUAL
        bars_drawn = axis.errorbar(
            0.0, position, xerr=min(share, reach), color=colour,
            fmt="s" if bar.of_row else "o", mfc="white" if bar.of_row else colour, ms=4.5,
        )  # fmt: skip
        if bar.of_row:
            bars_drawn[2][0].set_linestyle("--")
        if share > reach:
            for side in (-reach, reach):
                axis.plot(side, position, "<" if side < 0.0 else ">", color=colour, ms=5)
        if bar.truth is not None:
            off = 100.0 * (bar.truth - bar.value) / bar.scale
            axis.plot(np.clip(off, -reach, reach), position, "D", color=TRUTH, ms=4, mfc="none")
        axis.annotate(
            f"{bar.value:.4g} ± {bar.half_width:.2g}",
            (1.01, position),
            xycoords=("axes fraction", "data"),
            fontsize=7,
            va="center",
        )
    axis.set_xlim(-1.05 * reach, 1.05 * reach)
    axis.set_ylim(-0.7, len(bars) - 0.3)
    axis.set_yticks(range(len(bars)), [b.name for b in reversed(bars)], fontsize=8)
    axis.tick_params(axis="x", labelsize=7)
    axis.axvline(0.0, color="0.85", lw=0.8, zorder=0)
    axis.set_title(title, fontsize=10)
    known = any(bar.truth is not None for bar in bars)
    axis.set_xlabel(
        "95 % interval about the estimate; discs: % of the estimate; squares, dashed: % of what"
        " would contribute 5 % of its row\ngrey: within 10 %; red: not to be relied on; arrows:"
        " beyond the scale" + ("; diamonds: the simulated aircraft" if known else ""),
        fontsize=8,
    )
    return figure


def spectra(inputs: Sequence[Excitation], modes: Sequence[tuple[str, float]], title: str) -> Figure:
    """Draw the spectra of inputs and the modes, name and Hz, that they should excite."""
    lines = (len(inputs) + 1) // 2
    figure = empty_figure((8.0, 4.2 + 0.16 * lines))
    axis = figure.subplots()
    for number, item in enumerate(inputs):
        series = np.degrees(item.values - item.values.mean())
        padded = 8 * len(series)
        size = np.abs(np.fft.rfft(series, padded)) * item.dt_s
        axis.semilogx(
            np.fft.rfftfreq(padded, item.dt_s)[1:],
            size[1:],
            lw=1.1,
            color=f"C{number % COLOURS}",
            ls=STROKES[number // COLOURS % len(STROKES)],
            label=item.label,
        )
    low, high = SHOWN_HZ
    for name, hertz in modes:
        if low < hertz < high:
            axis.axvline(hertz, color="0.5", lw=0.8, ls="--", zorder=0)
            axis.annotate(
                name,
                (hertz, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(0, 3),
                textcoords="offset points",
                rotation=90,
                fontsize=7,
                ha="center",
                va="bottom",
            )
    axis.set_xlim(low, high)
    axis.set_ylim(bottom=0.0)
    axis.tick_params(labelsize=7)
    axis.set_xlabel("frequency, Hz", fontsize=8)
    axis.set_ylabel("spectrum of the input, deg s", fontsize=8)
    figure.suptitle(title, fontsize=10)
    if inputs:
        figure.legend(loc="outside lower center", ncols=2, fontsize=7, frameon=False)
    return figure


def _name_poles(axis: Axes, poles: Sequence[tuple[str, complex]]) -> None:
    """Write names next to poles, one below the other where poles are close."""
    (left, right), (low, high) = axis.get_xlim(), axis.get_ylim()
    placed: list[tuple[float, float]] = []
    for name, pole in sorted(poles, key=lambda p: -abs(p[1].imag)):
        # In widths of a name and heights of a line, about.
        x, y = (pole.real - left) / (right - left) * 7.0, abs(pole.imag) / (high - low) * 16.0
        at = y + 0.6
        while any(abs(x - a) < 1.0 and abs(at - b) < 1.0 for a, b in placed):
            at -= 1.0
        placed.append((x, at))
        axis.annotate(
            name,
            (pole.real, abs(pole.imag)),
            xytext=(8.0, 10.0 * (at - y)),
            textcoords="offset points",
            fontsize=8,
        )


def _cloud(axis: Axes, cloud: Cloud, *, mirrored: bool = True) -> None:
    for side in (1.0, -1.0) if mirrored and cloud.pole.imag else (1.0,):
        axis.plot(cloud.real, side * cloud.imaginary, ".", color=RESIDUAL, ms=1.5, alpha=0.4)
        axis.plot(cloud.pole.real, side * cloud.pole.imag, "x", color=MODEL, ms=8, mew=1.6)
        if cloud.truth is not None:
            at = cloud.truth.real, side * abs(cloud.truth.imag)
            axis.plot(*at, "D", color=TRUTH, ms=6, mfc="none")


def empty_figure(size: tuple[float, float]) -> Figure:
    """Return an empty figure.

    Raises
    ------
    IdentificationError
        If matplotlib is missing.
    """
    try:
        from matplotlib.backends.backend_svg import FigureCanvasSVG
        from matplotlib.figure import Figure
    except ImportError as error:
        raise IdentificationError(
            f"pictures need matplotlib: {install_hint('matplotlib')}"
        ) from error
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasSVG(figure)
    return figure
