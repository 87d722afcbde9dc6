"""Pictures of an answer: time histories with residuals, poles, intervals, input spectrum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from host.compiled import Array
from host.sysid.errors import IdentificationError
from host.sysid.flight.linear import Answer
from host.sysid.models.modes import Mode

if TYPE_CHECKING:
    from host.sysid.coefficients.flight import CoefficientAnswer

SCATTER = 300


def draw(answer: Answer, folder: Path) -> list[Path]:
    """Write all pictures of one answer as SVG and return their paths.

    Raises
    ------
    IdentificationError
        If matplotlib is missing.
    """
    plt = _plotting()
    folder.mkdir(parents=True, exist_ok=True)
    result, model = answer.result, answer.model
    written = []

    outputs = len(model.outputs)
    figure, axes = plt.subplots(
        2 * outputs, 1, figsize=(9, 2.2 * outputs), sharex=True, height_ratios=[3, 1] * outputs
    )
    begin = 0.0
    for maneuver, fitted in zip(answer.maneuvers, result.fitted, strict=True):
        t = begin + maneuver.time_s
        begin = float(t[-1]) + 0.5
        if fitted.shape[1] != outputs:
            continue
        for j, name in enumerate(model.outputs):
            axes[2 * j].plot(t, maneuver.outputs[:, j], color="0.5", lw=1.2)
            axes[2 * j].plot(t, fitted[:, j], color="C3", lw=0.9)
            axes[2 * j + 1].plot(t, maneuver.outputs[:, j] - fitted[:, j], color="C0", lw=0.6)
            axes[2 * j].set_ylabel(name, fontsize=7)
    axes[0].set_title(f"{answer.template}: measured (grey), {result.residual_kind} fit (red)")
    axes[-1].set_xlabel("time within the maneuvers, s")
    written.append(_save(figure, folder / f"{answer.template}_fit.svg"))

    figure, axis = plt.subplots(figsize=(6, 5))
    count = len(model.parameters)
    rng = np.random.default_rng(1)
    covariance = result.covariance[:count, :count]
    value, vector = np.linalg.eigh(covariance)
    root = vector * np.sqrt(np.maximum(value, 0.0))
    for _ in range(SCATTER):
        theta = result.estimate[:count] + root @ rng.standard_normal(count)
        poles = np.linalg.eigvals(model.matrices(theta)[0])
        axis.plot(poles.real, poles.imag, ".", color="C0", ms=1.5, alpha=0.4)
    poles = np.linalg.eigvals(result.matrices()[0])
    axis.plot(poles.real, poles.imag, "x", color="C3", ms=9, mew=2)
    axis.axvline(0.0, color="0.7", lw=0.8)
    axis.set_xlabel("real, 1/s")
    axis.set_ylabel("imaginary, rad/s")
    axis.set_title(f"{answer.template}: poles, scatter from the covariance")
    written.append(_save(figure, folder / f"{answer.template}_poles.svg"))

    shown = [k for k in range(count) if result.standard_error[k] > 0.0]
    half = result.half_width()
    refused = {r.name for r in answer.refused}
    bars = [
        (result.names[k], float(result.estimate[k]), float(half[k]), result.names[k] in refused)
        for k in shown
    ]
    written.append(interval_bars(bars, "refused", folder / f"{answer.template}_intervals.svg"))
    inputs = [(m.dt_s, m.inputs[:, j]) for m in answer.maneuvers for j in range(m.inputs.shape[1])]
    written.append(_spectra(inputs, answer.modes, folder / f"{answer.template}_input.svg"))
    return written


def draw_coefficients(
    answer: CoefficientAnswer, columns: Mapping[str, Array], folder: Path
) -> list[Path]:
    """Write the pictures of a direct fit of coefficients as SVG and return their paths.

    Parameters
    ----------
    answer : CoefficientAnswer
    columns : mapping
        The flight it was made of; its surfaces give the spectrum of the inputs.
    folder : Path

    Raises
    ------
    IdentificationError
        If matplotlib is missing.
    """
    plt = _plotting()
    folder.mkdir(parents=True, exist_ok=True)
    traces = answer.fit.traces
    figure, axes = plt.subplots(
        2 * len(traces), 1, figsize=(9, 2.2 * len(traces)), height_ratios=[3, 1] * len(traces)
    )
    for k, (name, trace) in enumerate(traces.items()):
        axes[2 * k].plot(trace.measured, color="0.5", lw=1.0)
        axes[2 * k].plot(trace.model, color="C3", lw=0.7)
        axes[2 * k].set_ylabel(name, fontsize=8)
        axes[2 * k + 1].plot(trace.measured - trace.model, color="C0", lw=0.6)
    axes[0].set_title("measured (grey), by the derivatives found (red), difference (blue)")
    axes[-1].set_xlabel("samples of 30 ms within the maneuvers")
    written = [_save(figure, folder / "coefficients_fit.svg")]

    figure, axis = plt.subplots(figsize=(6, 5))
    rng = np.random.default_rng(1)
    for mode in answer.modes:
        value, vector = np.linalg.eigh(mode.covariance)
        root = vector * np.sqrt(np.maximum(value, 0.0))
        drawn = root @ rng.standard_normal((2, SCATTER))
        for side in (1.0, -1.0) if mode.oscillatory else (1.0,):
            real, imaginary = mode.eigenvalue.real, side * mode.eigenvalue.imag
            axis.plot(
                real + drawn[0], imaginary + side * drawn[1], ".", color="C0", ms=1.5, alpha=0.4
            )
            axis.plot(real, imaginary, "x", color="C3", ms=9, mew=2)
    axis.axvline(0.0, color="0.7", lw=0.8)
    axis.set_xlabel("real, 1/s")
    axis.set_ylabel("imaginary, rad/s")
    axis.set_title("poles, scatter from the covariance")
    written.append(_save(figure, folder / "coefficients_poles.svg"))

    bars = [(d.name, d.reference, d.half_width, d.flagged) for d in answer.fit.derivatives]
    written.append(interval_bars(bars, "flagged", folder / "coefficients_intervals.svg"))
    t = columns["t_s"]
    inputs = [
        (float(t[1] - t[0]), columns[f.axis][(t >= f.start_s) & (t <= f.end_s)])
        for f in answer.used
    ]
    written.append(_spectra(inputs, answer.modes, folder / "coefficients_input.svg"))
    return written


def interval_bars(bars: Sequence[tuple[str, float, float, bool]], word: str, path: Path) -> Path:
    """Draw name, value, half-width, mark as bars; red where marked or wider than the value."""
    plt = _plotting()
    figure, axis = plt.subplots(figsize=(7, 0.32 * len(bars) + 1.2))
    for position, (_, value, half, marked) in enumerate(bars):
        share = 100.0 * half / max(abs(value), 1e-300)
        colour = "C3" if marked or share > 100.0 else "C0"
        axis.errorbar(100.0, position, xerr=min(share, 300.0), color=colour, fmt="o")
    axis.set_yticks(range(len(bars)), [name for name, *_ in bars], fontsize=7)
    axis.set_xlabel(f"95 % interval, % of the estimate (red: {word}, or wider than the value)")
    return _save(figure, path)


def _spectra(inputs: Sequence[tuple[float, Array]], modes: Sequence[Mode], path: Path) -> Path:
    """Draw the spectra of inputs, each with its time step, and the modes they should excite."""
    plt = _plotting()
    figure, axis = plt.subplots(figsize=(7, 3.5))
    for dt_s, values in inputs:
        series = values - values.mean()
        padded = 8 * len(series)
        power = np.abs(np.fft.rfft(series, padded)) * dt_s
        axis.semilogx(np.fft.rfftfreq(padded, dt_s)[1:], power[1:], lw=0.9)
    for mode in modes:
        hertz = mode.frequency_radps / (2.0 * np.pi)
        if hertz > 0.0:
            axis.axvline(hertz, color="0.5", lw=0.8, ls="--")
            axis.text(hertz, 0.0, f" {mode.name}", rotation=90, fontsize=7, va="bottom")
    axis.set_xlim(0.05, 20.0)
    axis.set_xlabel("frequency, Hz")
    axis.set_ylabel("input spectrum, rad s")
    return _save(figure, path)


def _plotting() -> ModuleType:
    try:
        import matplotlib

        matplotlib.use("svg")
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise IdentificationError("pictures need the extra: pip install './host[plot]'") from error
    return plt


def _save(figure: object, path: Path) -> Path:
    import matplotlib.pyplot as plt
    from matplotlib.figure import Figure

    assert isinstance(figure, Figure)
    figure.tight_layout()
    figure.savefig(path)
    plt.close(figure)
    return path
