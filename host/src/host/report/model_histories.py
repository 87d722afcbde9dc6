"""Measured against model: one step ahead, free, and of maneuvers the fit has not seen.

Draws the answer's own histories; nothing is computed here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from host.arrays import Array
from host.sysid.answer.figure_kinds import shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from host.sysid.linear import Answer
    from host.sysid.models import Maneuver

_MEASURED, _ONE_STEP, _FREE, _INPUT = "0.6", "C0", "C3", "C2"
_GAP_S = 0.5


def caption(answer: Answer) -> str:
    """Return the caption of `model_histories`: what each line is."""
    ahead = "blue: one step ahead; " if _one_step(answer) else ""
    shade = (
        "shaded: unseen maneuvers, free simulation"
        if answer.held_out_runs
        else "no maneuver is unseen"
    )
    return (
        f"grey: measured; {ahead}red: free simulation by the inputs alone; white: fitted;"
        f" {shade}; green: the input"
    )


def _one_step(answer: Answer) -> bool:
    return answer.result.residual_kind == "innovation"


def model_histories(answer: Answer) -> Figure:
    """Return every output of an answer over all its maneuvers, those held out behind, inputs below.

    Parameters
    ----------
    answer : Answer
    """
    from matplotlib.figure import Figure

    outputs, inputs = answer.model.outputs, answer.model.inputs
    figure = Figure((9.0, 1.25 * (len(outputs) + len(inputs)) + 0.6), layout="constrained")
    axes = figure.subplots(len(outputs) + len(inputs), 1, sharex=True, squeeze=False)[:, 0]
    begin = 0.0
    for k, maneuver in enumerate(answer.maneuvers):
        t_s = begin + maneuver.time_s
        if _one_step(answer):
            _model(axes, t_s, answer.result.fitted[k], outputs, _ONE_STEP)
        free = answer.simulated[k] if answer.simulated else answer.result.fitted[k]
        _model(axes, t_s, free, outputs, _FREE)
        begin = _measured(axes, t_s, maneuver, outputs, inputs)
    for maneuver, simulated in answer.held_out_runs:
        t_s = begin + maneuver.time_s
        for axis in axes:
            axis.axvspan(t_s[0], t_s[-1], color="0.92", lw=0, zorder=0)
        _model(axes, t_s, simulated, outputs, _FREE)
        begin = _measured(axes, t_s, maneuver, outputs, inputs)
    for axis, name in zip(axes, (*outputs, *inputs), strict=True):
        axis.set_ylabel(shown(name)[0].replace(", ", "\n"), fontsize=7)
        axis.tick_params(labelsize=6)
        axis.grid(color="0.93", lw=0.5)
    axes[-1].set_xlabel("time, maneuvers one behind the other, s", fontsize=7)
    axes[-1].set_xlim(0.0, begin - _GAP_S)
    return figure


def _measured(axes: Any, t_s: Array, maneuver: Maneuver, outputs: Any, inputs: Any) -> float:
    for j, name in enumerate(outputs):
        scale = shown(name)[1]
        axes[j].plot(t_s, scale * maneuver.outputs[:, j], color=_MEASURED, lw=2.2, zorder=1)
    for j, name in enumerate(inputs):
        scale = shown(name)[1]
        axes[len(outputs) + j].plot(t_s, scale * maneuver.inputs[:, j], color=_INPUT, lw=0.9)
    axes[0].annotate(
        maneuver.name.replace(" on ", "\n").replace(" at ", "\n"),
        (float(t_s[0]), 1.0), xycoords=("data", "axes fraction"), xytext=(0, 2),
        textcoords="offset points", fontsize=5,
    )  # fmt: skip
    return float(t_s[-1]) + _GAP_S


def _model(axes: Any, t_s: Array, values: Array, outputs: Any, colour: str) -> None:
    if values.shape != (len(t_s), len(outputs)):
        return  # a fit in the frequency domain has no time histories
    for j, name in enumerate(outputs):
        axes[j].plot(t_s, shown(name)[1] * values[:, j], color=colour, lw=0.8, zorder=2)
