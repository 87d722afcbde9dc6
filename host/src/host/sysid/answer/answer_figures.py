"""Pictures of an answer: time histories with residuals, poles, intervals, input spectrum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from host.sysid.answer.figure_kinds import (
    Bar,
    Cloud,
    Excitation,
    Trace,
    histories,
    interval_bars,
    pole_map,
    spectra,
)
from host.sysid.answer.frequency_pictures import frequency_pictures
from host.sysid.answer.marks import UNSURE, USELESS, Verdict
from host.sysid.answer.mat_file import labels
from host.sysid.answer.mode_lines import coefficient_modes, linear_modes
from host.sysid.answer.parameter_words import NOT
from host.sysid.answer.truth_comparison import true_coefficients, true_poles
from host.sysid.models.diagnostics import reference_values
from host.sysid.models.parameter_units import parameter_unit
from host.sysid.reconstruction.inverse_sensor_model import FIT_RATE_HZ

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from host.arrays import Array
    from host.sysid.answer.mode_lines import JudgedMode
    from host.sysid.checks.data_finding import Finding
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.linear.linear_answer import Answer
    from host.sysid.models.modal_analysis import Mode

SCATTER = 300
MOVED_SHARE = 0.2  # of the largest input: less is an answer of the pilot, not the test
EXCITED = "inputs (lines) and the modes they should excite (dashed)"
GAP_S = 0.5  # between the maneuvers of a picture


def draw_all(
    answers: Sequence[Answer],
    direct: CoefficientAnswer | None,
    verdicts: Sequence[Verdict],
    flights: Sequence[Mapping[str, Array]],
    truth: dict[str, Any] | None = None,
    findings: Sequence[Finding] = (),
) -> dict[str, Figure]:
    """Return the pictures of several answers by name; of one model by several methods apart.

    Parameters
    ----------
    answers : sequence of Answer
    direct : CoefficientAnswer or None
    verdicts : sequence of Verdict
        Verdicts of all answers, linear ones first.
    flights : sequence of mapping
        Columns of what the coefficients were made of; surfaces give the spectrum of the inputs.
    truth : dict, optional
        Truth file of a simulated flight, drawn with the intervals.
    findings : sequence of Finding
        Those of feedback are named under a frequency response.

    Raises
    ------
    IdentificationError
        If matplotlib is missing.
    """
    found: dict[str, Figure] = {}
    for answer, label, verdict in zip(answers, labels(answers), verdicts, strict=False):
        found |= draw(answer, label, verdict, truth, findings)
    return found | (draw_coefficients(direct, verdicts[-1], flights, truth) if direct else {})


def draw(
    answer: Answer,
    name: str,
    verdict: Verdict,
    truth: dict[str, Any] | None = None,
    findings: Sequence[Finding] = (),
) -> dict[str, Figure]:
    """Return all pictures of one answer, their names beginning with `name`.

    `truth` of a simulated flight is marked on the map of poles. Frequency responses are missing
    where the records are too short for coherence.

    Raises
    ------
    IdentificationError
        If matplotlib is missing.
    """
    result = answer.result
    traces, kind = _linear_traces(answer)
    title = f"{answer.template}, {answer.method}: measured (grey), model (red): {kind}"
    unreliable = {n for n, mark in verdict.marks.items() if mark in (UNSURE, USELESS)}
    half = result.half_width()
    size = reference_values(answer.model, answer.maneuvers, result.estimate)
    bars = [
        Bar(
            f"{label}, {unit}" if (unit := parameter_unit(answer.model, label)) != "1" else label,
            float(result.estimate[k]),
            float(half[k]),
            max(float(size[k]), 1e-300),
            label in unreliable,
        )
        for k, label in enumerate(p.name for p in answer.model.parameters)
        if half[k] > 0.0 and not label.startswith("imu_")
    ]
    inputs = [
        Excitation(
            maneuver.name + (f": {column.split('_')[0]}" if len(answer.model.inputs) > 1 else ""),
            maneuver.dt_s,
            maneuver.inputs[:, j],
        )
        for maneuver in answer.maneuvers
        for j, column in enumerate(answer.model.inputs)
        if np.ptp(maneuver.inputs[:, j]) > MOVED_SHARE * np.max(np.ptp(maneuver.inputs, axis=0))
    ]
    about = f"{answer.template}, {answer.method}"
    return {
        f"{name}_fit": histories(traces, title),
        f"{name}_poles": pole_map(
            _clouds(linear_modes(answer), true_poles(answer.modes, truth, (answer.template,))),
            f"{about}: poles, scatter from the covariance",
        ),
        f"{name}_intervals": interval_bars(bars, about),
        f"{name}_input": spectra(inputs, _hertz(answer.modes), f"{answer.template}: {EXCITED}"),
    } | {f"{name}_bode": figure for figure in frequency_pictures([answer], findings)[0]}


def draw_coefficients(
    answer: CoefficientAnswer,
    verdict: Verdict,
    flights: Sequence[Mapping[str, Array]],
    truth: dict[str, Any] | None = None,
) -> dict[str, Figure]:
    """Return the pictures of a direct fit of coefficients by name.

    Parameters
    ----------
    answer : CoefficientAnswer
    verdict : Verdict
    flights : sequence of mapping
        Columns of what it was made of; surfaces give the spectrum of the inputs.
    truth : dict, optional
        Truth file of a simulated flight, drawn with the intervals.

    Raises
    ------
    IdentificationError
        If matplotlib is missing.
    """
    signals = {
        name: [Trace(np.arange(len(trace.model)) / FIT_RATE_HZ, trace.measured, trace.model)]
        for name, trace in answer.fit.histories.items()
    }
    true: dict[str, float] = {}
    for table in answer.tables if truth is not None else ():
        true |= true_coefficients(truth or {}, table.template)
    poles = true_poles(answer.modes, truth, ("longitudinal", "lateral"))
    bars = [
        Bar(d.name, d.value, d.half_width, d.reference, d.flagged, true.get(d.name))
        for d in answer.fit.derivatives
    ]
    inputs = []
    for name, f, k in zip(answer.maneuvers, answer.used, answer.flights, strict=True):
        t = flights[k]["t_s"]
        inside = (t >= f.start_s) & (t <= f.end_s)
        inputs.append(Excitation(name, float(t[1] - t[0]), flights[k][f.axis][inside]))
    title = "coefficients: measured (grey), one step by the derivatives found (red), fitted data"
    return {
        "coefficients_fit": histories(signals, title),
        "coefficients_poles": pole_map(
            _clouds(coefficient_modes(answer, verdict), poles),
            "coefficients: poles, scatter from the covariance",
        ),
        "coefficients_intervals": interval_bars(bars, "coefficients"),
        "coefficients_input": spectra(inputs, _hertz(answer.modes), f"coefficients: {EXCITED}"),
    }


def _hertz(modes: Sequence[Mode]) -> list[tuple[str, float]]:
    return [(m.name, m.frequency_radps / (2.0 * np.pi)) for m in modes]


def _linear_traces(answer: Answer) -> tuple[dict[str, list[Trace]], str]:
    """Return the outputs measured and by the model, and in words how the model came to them."""
    one_step = answer.result.residual_kind == "innovation"
    modelled = answer.result.fitted if one_step else answer.simulated
    signals: dict[str, list[Trace]] = {name: [] for name in answer.model.outputs}
    begin = 0.0
    for maneuver, outputs in zip(answer.maneuvers, modelled, strict=True):
        t = begin + maneuver.time_s
        begin = float(t[-1]) + GAP_S
        for j, name in enumerate(answer.model.outputs):
            signals[name].append(
                Trace(t, maneuver.outputs[:, j], outputs[:, j], maneuver.name if j == 0 else "")
            )
    for maneuver, outputs in answer.held_out_runs:
        t = begin + maneuver.time_s
        begin = float(t[-1]) + GAP_S
        for j, name in enumerate(answer.model.outputs):
            title = maneuver.name if j == 0 else ""
            signals[name].append(Trace(t, maneuver.outputs[:, j], outputs[:, j], title, True))
    shade = "; shaded: unseen, free simulation" if answer.held_out_runs else ""
    return signals, f"{'one step' if one_step else 'free simulation'}, fitted data{shade}"


def _clouds(modes: Sequence[JudgedMode], truth: Mapping[str, complex]) -> list[Cloud]:
    """Draw poles from the covariance of each mode's real and imaginary part."""
    rng = np.random.default_rng(1)
    clouds = []
    for judged in modes:
        mode = judged.mode
        name = f"{mode.name}: do not rely on" if judged.word == NOT else mode.name
        value, vector = np.linalg.eigh(mode.covariance)
        points = (vector * np.sqrt(np.maximum(value, 0.0))) @ rng.standard_normal((2, SCATTER))
        pole = mode.eigenvalue
        clouds.append(
            Cloud(name, pole, pole.real + points[0], pole.imag + points[1], truth.get(mode.name))
        )
    return clouds
