"""Pictures of an answer: time histories with residuals, poles, intervals, input spectrum."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from host.sysid.errors import IdentificationError
from host.sysid.flight import Answer

SCATTER = 300


def draw(answer: Answer, folder: Path) -> list[Path]:
    """Write all pictures of one answer as SVG and return their paths.

    Raises
    ------
    IdentificationError
        If matplotlib is missing.
    """
    try:
        import matplotlib

        matplotlib.use("svg")
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise IdentificationError("pictures need the extra: pip install './host[plot]'") from error
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
    figure, axis = plt.subplots(figsize=(7, 0.32 * len(shown) + 1.2))
    refused = {r.name for r in answer.refused}
    for position, k in enumerate(shown):
        size = max(abs(float(result.estimate[k])), 1e-300)
        colour = "C3" if result.names[k] in refused else "C0"
        axis.errorbar(
            100.0, position, xerr=min(100.0 * half[k] / size, 300.0), color=colour, fmt="o"
        )
    axis.set_yticks(range(len(shown)), [result.names[k] for k in shown], fontsize=7)
    axis.set_xlabel("95 % interval, % of the estimate (red: refused)")
    written.append(_save(figure, folder / f"{answer.template}_intervals.svg"))

    figure, axis = plt.subplots(figsize=(7, 3.5))
    for maneuver in answer.maneuvers:
        for j in range(maneuver.inputs.shape[1]):
            series = maneuver.inputs[:, j] - maneuver.inputs[:, j].mean()
            padded = 8 * len(series)
            power = np.abs(np.fft.rfft(series, padded)) * maneuver.dt_s
            axis.semilogx(np.fft.rfftfreq(padded, maneuver.dt_s)[1:], power[1:], lw=0.9)
    for mode in answer.modes:
        hertz = mode.frequency_radps / (2.0 * np.pi)
        if hertz > 0.0:
            axis.axvline(hertz, color="0.5", lw=0.8, ls="--")
            axis.text(hertz, 0.0, f" {mode.name}", rotation=90, fontsize=7, va="bottom")
    axis.set_xlim(0.05, 20.0)
    axis.set_xlabel("frequency, Hz")
    axis.set_ylabel("input spectrum, rad s")
    written.append(_save(figure, folder / f"{answer.template}_input.svg"))
    return written


def _save(figure: object, path: Path) -> Path:
    import matplotlib.pyplot as plt
    from matplotlib.figure import Figure

    assert isinstance(figure, Figure)
    figure.tight_layout()
    figure.savefig(path)
    plt.close(figure)
    return path
