"""One picture an axis: step with its band, margins, poles and the loop, over aircraft drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from host.arrays import Array
from host.control.control_error import ControlError
from host.control.scenarios import Scenarios, draw
from host.extras import install_hint

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from host.control.axis_tuning import AxisTuning

DRAWN, SEED = 60, 9_000  # aircraft, of a drawing of their own
SECONDS = 5.0
BAND, MEDIAN, LIMIT = "0.75", "C0", "C3"
SHARES = (0.025, 0.5, 0.975)


def axis_figure(one: AxisTuning) -> Figure:
    """Return the picture of one axis with gains.

    Raises
    ------
    ControlError
        matplotlib is missing, or the axis has no gains.
    """
    try:
        from matplotlib.backends.backend_svg import FigureCanvasSVG
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ControlError(f"pictures need matplotlib: {install_hint('matplotlib')}") from error
    if one.design.gains is None:
        raise ControlError(f"{one.axis} has no gains to draw")
    drawn = draw(one.problem, seed=SEED, count=DRAWN)
    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    FigureCanvasSVG(figure)
    figure.suptitle(f"{one.axis}: {DRAWN} aircraft drawn, each at every airspeed")
    panels = figure.subplots(2, 2)
    _steps(panels[0, 0], drawn, one)
    _margins(panels[0, 1], drawn, one)
    _poles(panels[1, 0], drawn, one)
    _loop(panels[1, 1], drawn, one)
    return figure


def _steps(panel: Axes, drawn: Scenarios, one: AxisTuning) -> None:
    t, angle = drawn.steps(one.design.gains or {}, SECONDS)
    low, middle, high = np.quantile(angle, SHARES, axis=0)
    panel.fill_between(t, low, high, color=BAND, lw=0.0)
    panel.plot(t, middle, color=MEDIAN)
    panel.axhline(1.0, color="black", lw=0.5)
    panel.set(xlabel="s", ylabel="angle over demand", title="step: median and 95 %")


def _margins(panel: Axes, drawn: Scenarios, one: AxisTuning) -> None:
    required = one.design.verification.required
    names = ("at the surface", "attitude")
    for found, name in zip(drawn.judged(one.design.gains or {}), names, strict=True):
        panel.plot(found.gain_db, found.phase_deg, ".", ms=3, label=name)
    panel.axvline(required.gain_db, color=LIMIT, lw=0.8)
    panel.axhline(required.phase_deg, color=LIMIT, lw=0.8)
    panel.set(xlabel="gain margin, dB", ylabel="phase margin, deg", title="margins and limits")
    panel.set(xlim=(0.0, None), ylim=(0.0, 180.0))
    panel.legend(fontsize="small")


def _poles(panel: Axes, drawn: Scenarios, one: AxisTuning) -> None:
    poles = drawn.poles(one.design.gains or {})
    fastest = 2.0 * float(np.max(drawn.judged(one.design.gains or {})[0].crossover_radps))
    near = poles[np.abs(poles) < 2.0 * fastest]
    panel.plot(near.real, near.imag, ".", ms=2, color=MEDIAN)
    panel.axvline(0.0, color="black", lw=0.5)
    panel.set(xlabel="1/s", ylabel="rad/s", title="poles of the closed loop")


def _loop(panel: Axes, drawn: Scenarios, one: AxisTuning) -> None:
    inner, _ = drawn.loops(one.design.gains or {})
    w = drawn.frequency_radps
    shown = w < 100.0
    gain: Array = 20.0 * np.log10(np.maximum(np.abs(inner), 1e-6))
    low, middle, high = np.quantile(gain, SHARES, axis=0)
    panel.fill_between(w[shown], low[shown], high[shown], color=BAND, lw=0.0)
    panel.semilogx(w[shown], middle[shown], color=MEDIAN)
    panel.axhline(0.0, color="black", lw=0.5)
    panel.set(xlabel="rad/s", ylabel="dB", title="loop at the surface: median and 95 %")
    phase = panel.twinx()
    turned = np.rad2deg(np.unwrap(np.angle(inner), axis=-1))
    # A loop starts within half a turn of -180 degrees: the branch that people draw.
    turned -= 360.0 * np.round((turned[:, :1] + 180.0) / 360.0)
    phase.semilogx(w[shown], np.median(turned, axis=0)[shown], color=MEDIAN, ls=":")
    phase.set_ylabel("deg (dotted)")
