"""The figures of a prediction in words and as plain values."""

from __future__ import annotations

from typing import Any

from host.sysid.models.state_space_model import has_equations
from host.sysid.pipeline.simulation import SimulatedModel, Simulation


def simulation_lines(one: Simulation, source: str, *, constants: bool) -> list[str]:
    """Return the figures of every model over one record, free and one-step under own headings."""
    lines = [f"note: {note}" for note in one.notes]
    for m in one.models:
        count = len(m.maneuvers)
        lines += [
            f"{m.label} of {source} over {one.source}: {count} maneuver{'s' * (count > 1)},"
            f" derivatives held, {_held(m, constants=constants)}",
            *(f"  {maneuver.name}" for maneuver in m.maneuvers),
            *_free_lines(m),
            *_one_step_lines(m),
            *_window_lines(m),
            f"  {_in_words(m)}",
        ]
    return lines


def _in_words(m: SimulatedModel) -> str:
    """Return in a sentence what the model is worth on this record, by its free simulation.

    A signal is not predicted where who says its mean errs less.
    """
    shares = {fit.name: 100.0 * fit.nrmse for fit in m.fits}
    good = [share for share in shares.values() if share < 100.0]
    worse = [name for name, share in shares.items() if not share < 100.0]
    if not good:
        return "Verdict: the mean of each signal predicts this record better."
    spread = f"{min(good):.0f} to {max(good):.0f}" if len(good) > 1 else f"{good[0]:.0f}"
    but = f"; {', '.join(worse)} not predicted" if worse else ""
    return f"Verdict: predicted by the inputs alone within {spread} % of each signal's spread{but}."


def _held(m: SimulatedModel, *, constants: bool) -> str:
    """Return what else of a model was fitted, or its replacement."""
    if constants:
        return "biases and start states fitted to each maneuver"
    if has_equations(m.model):
        return (
            "nothing fitted: from the mean of the 0.3 s before each input, parameters of each"
            " record at their start values"
        )
    return "nothing fitted: equilibrium in the 0.3 s before each input"


def _free_lines(m: SimulatedModel) -> list[str]:
    lines = [
        "  free simulation: error over the spread of the signal, Theil's U, shares of its square",
        f"    {'signal':16s}{'NRMSE':>9s}{'U':>9s}{'bias':>9s}{'variance':>10s}{'covariance':>12s}",
    ]
    for fit, theil in zip(m.fits, m.theil, strict=True):
        lines.append(
            f"    {fit.name:16s}{100.0 * fit.nrmse:7.1f} %{theil.coefficient:9.4f}"
            f"{100.0 * theil.bias:7.1f} %{100.0 * theil.variance:8.1f} %"
            f"{100.0 * theil.covariance:10.1f} %"
        )
    return lines


def _one_step_lines(m: SimulatedModel) -> list[str]:
    found = m.one_step
    if found is None:
        return []
    free = [state for state in m.model.states if state not in m.model.outputs]
    but = f" ({', '.join(free)} of the free simulation)" if free else ""
    lines = [
        f"  one step ({found.length_s:.4g} s) from measured states{but}: error over the spread of"
        " the signal, over that of persistence",
        f"    {'signal':16s}{'NRMSE':>9s}{'relative':>10s}",
    ]
    shares = found.model / m.spread
    for name, share, relative in zip(m.model.outputs, shares, found.relative, strict=True):
        lines.append(f"    {name:16s}{100.0 * share:7.1f} %{relative:10.3f}")
    return lines


def _window_lines(m: SimulatedModel) -> list[str]:
    windows = m.windows
    if not windows:
        return []
    lines = [
        "  windows from measured states: error over that of persistence (rates, velocity and"
        " specific forces held, attitude integrated)",
        f"    {'signal':16s}" + "".join(f"{w.length_s:8.4g} s" for w in windows),
    ]
    for k, name in enumerate(m.model.outputs):
        lines.append(f"    {name:16s}" + "".join(f"{w.relative[k]:10.3f}" for w in windows))
    return lines


def simulation_document(one: Simulation) -> dict[str, Any]:
    """Return the figures of one record as plain lists, numbers and strings."""
    return {
        "source": one.source,
        "notes": list(one.notes),
        "models": [_model_document(m) for m in one.models],
    }


def _model_document(m: SimulatedModel) -> dict[str, Any]:
    step, names = m.one_step, m.model.outputs
    return {
        "model": m.label,
        "maneuvers": [maneuver.name for maneuver in m.maneuvers],
        "free_simulation": {
            fit.name: {
                "nrmse": fit.nrmse,
                "r_squared": fit.r_squared,
                "theil": theil.coefficient,
                "theil_bias": theil.bias,
                "theil_variance": theil.variance,
                "theil_covariance": theil.covariance,
            }
            for fit, theil in zip(m.fits, m.theil, strict=True)
        },
        "one_step": None
        if step is None
        else {
            "step_s": step.length_s,
            "nrmse": dict(zip(names, (step.model / m.spread).tolist(), strict=True)),
            "over_persistence": dict(zip(names, step.relative.tolist(), strict=True)),
        },
        "windows": [
            {
                "length_s": w.length_s,
                "windows": w.windows,
                "rms_error": dict(zip(names, w.model.tolist(), strict=True)),
                "over_persistence": dict(zip(names, w.relative.tolist(), strict=True)),
            }
            for w in m.windows
        ],
    }
