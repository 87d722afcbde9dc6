"""The answer for programs: plain numbers, lists and strings."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from host.sysid.answer.converted_marks import converted_marks
from host.sysid.answer.linear_rules import unpredicted_states
from host.sysid.answer.mode_lines import JudgedMode, coefficient_modes, linear_modes
from host.sysid.answer.servo_lines import servo_document
from host.sysid.answer.settling_history import settling_document
from host.sysid.coefficients.coefficient_fit import METHOD
from host.sysid.flight.reconstructed_flight import maneuver_name
from host.sysid.models.model_constants import known_constants
from host.sysid.models.parameter_units import parameter_unit
from host.sysid.reconstruction.sensor_corrections import correction_document

if TYPE_CHECKING:
    from host.sysid.answer.marks import Verdict
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.coefficients.deletion_diagnostics import CrossValidation
    from host.sysid.linear.linear_answer import Answer
    from host.sysid.maneuvers.maneuver_detection import DetectedManeuver
    from host.sysid.maneuvers.maneuver_grade import Grade
    from host.sysid.models.diagnostics import SignalFit
    from host.sysid.numerics.maneuver_agreement import ManeuverAgreement


def json_text(document: Mapping[str, Any]) -> str:
    """Return a document as JSON; what is no finite number is null, which JSON can say."""
    return json.dumps(_plain(document), indent=2, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    number = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(number, float) and not isfinite(number) else number


def maneuver_document(graded: Sequence[tuple[DetectedManeuver, Grade]]) -> list[dict[str, Any]]:
    """Return the maneuvers with their grades."""
    return [
        {
            "axis": item.axis,
            "kind": item.kind,
            "start_s": item.start_s,
            "input_end_s": item.input_end_s,
            "end_s": item.end_s,
            "amplitude": item.amplitude,
            "grade": mark.score,
            "response_over_noise": mark.response_over_noise,
            "trim_quiet": mark.trim_quiet,
            "feedback": mark.feedback,
            "remarks": list(mark.remarks),
        }
        for item, mark in graded
    ]


def mode_document(modes: Sequence[JudgedMode]) -> list[dict[str, Any]]:
    """Return modes with their intervals, and whether each may be relied on."""
    return [
        {
            "name": m.name,
            "known": judged.word,
            "reason": judged.reason,
            "eigenvalue": [m.eigenvalue.real, m.eigenvalue.imag],
            "frequency_radps": m.frequency_radps,
            "frequency_half_width_radps": m.frequency_half_width_radps,
            "damping": m.damping,
            "damping_half_width": m.damping_half_width,
        }
        for judged in modes
        for m in (judged.mode,)
    ]


def _parameter_document(answer: Answer) -> dict[str, Any]:
    """Return every parameter with its half-width, unit and what widens it."""
    result, half = answer.result, answer.result.half_width()
    return {
        name: {
            "value": float(result.estimate[k]),
            "half_width": float(half[k]),
            "unit": parameter_unit(answer.model, name),
            "widened_by": answer.causes.get(name, ""),
        }
        for k, name in enumerate(result.names)
    }


def _flag_document(answer: Answer) -> list[dict[str, Any]]:
    """Return the parameters that the data hardly tell, and why."""
    return [
        {
            "name": r.name,
            "grade": r.grade,
            "probability": r.probability,
            "relative_bound": r.relative_bound,
            "reason": r.reason,
        }
        for r in answer.identifiability_flags
    ]


def _converted_document(answer: Answer, verdict: Verdict) -> dict[str, Any]:
    """Return the coefficients that derivatives became, each with its mark."""
    converted = converted_marks(answer, verdict.marks)
    return {
        c.name: {
            "value": c.value,
            "half_width": c.half_width,
            "fit_error": c.fit_error,
            "mark": converted.get(c.name, ""),
        }
        for c in answer.coefficients
    }


def _fit_document(fits: Sequence[SignalFit]) -> dict[str, Any]:
    """Return the figures of fit of every output."""
    return {
        f.name: {
            "r_squared": f.r_squared,
            "nrmse": f.nrmse,
            "theil": f.theil,
            "autocorrelation_outside": f.autocorrelation_outside,
            "ljung_box_p": f.ljung_box_p,
        }
        for f in fits
    }


def answer_document(answer: Answer, lines: Sequence[str], verdict: Verdict) -> dict[str, Any]:
    """Return one fitted model: verdict, estimates with intervals, modes, figures of fit."""
    result = answer.result
    A, B, C, D = result.matrices()
    return {
        "template": answer.template,
        "method": result.method,
        "verdict": list(lines),
        "marks": _mark_document(verdict),
        "converged": result.converged,
        "warnings": list(result.warnings),
        "airspeed_mps": answer.condition.airspeed_mps,
        "qbar_pa": answer.condition.qbar_pa,
        "alpha_rad": answer.trim.alpha_rad,
        "states": list(answer.model.states),
        "inputs": list(answer.model.inputs),
        "outputs": list(answer.model.outputs),
        "A": A.tolist(),
        "B": B.tolist(),
        "C": C.tolist(),
        "D": D.tolist(),
        "parameters": _parameter_document(answer),
        "known_constants": known_constants(answer.model),
        "delays_s": {
            name: {"value": value, "half_width": width}
            for name, (value, width) in answer.delays.items()
        },
        "servo": servo_document(answer),
        "at_bound": list(answer.at_bound),
        "unpredicted": list(unpredicted_states(answer)),
        "corrections": correction_document(answer.corrections),
        "errors": [error.document() for error in answer.errors],
        "refused": _flag_document(answer),
        "coefficients": _converted_document(answer, verdict),
        "modes": mode_document(linear_modes(answer)),
        "settling": settling_document(answer),
        "fit": {
            "fitted": _fit_document(answer.fits),
            "held_out": _fit_document(answer.validation),
        },
        "predictions": {
            name: {"nrmse": p.nrmse, "largest": p.largest, "holds": p.holds}
            for name, p in answer.predictions.items()
        },
        "driven_by_inputs": _coherence_document(answer),
        "residual_kind": result.residual_kind,
        "collinear": [
            {"names": [a, b], "correlation": value} for a, b, value in answer.collinearity.pairs
        ],
        "information_condition": answer.collinearity.condition,
        "constant_inputs": list(answer.constant_inputs),
        "maneuvers": [m.name for m in answer.maneuvers],
        "held_out": [maneuver_name(f) for f in answer.held_out],
    }


def _coherence_document(answer: Answer) -> dict[str, Any]:
    """Return of each output how much of the residual the inputs drive, and how surely."""
    found = answer.coherence
    if found is None:
        return {}
    return {
        name: {
            "power_ratio": float(found.ratio[k]),
            "p_value": float(found.p_value[k]),
            "coherent": name in found.coherent,
        }
        for k, name in enumerate(found.outputs)
    }


def _mark_document(verdict: Verdict) -> dict[str, Any]:
    """Return every parameter's mark and why it stands there."""
    return {
        name: {"mark": mark, "reasons": list(verdict.reasons.get(name, ()))}
        for name, mark in verdict.marks.items()
    }


def _prediction_document(found: CrossValidation | None) -> dict[str, Any] | None:
    """Return how well each maneuver is predicted by the others, one-step, below 4.5 Hz."""
    if found is None:
        return None
    return {
        "by": "leave-one-out in the last step, one-step, measured signals with gusts",
        "windows": list(found.windows),
        "nrmse": {
            name: {"fitted": found.fitted[name], "unseen": held_out}
            for name, held_out in found.left_out.items()
        },
    }


def _repeats_document(found: ManeuverAgreement) -> dict[str, Any]:
    """Return how the maneuvers scatter about the joint answer, where that can be judged."""
    return {
        name: {
            "maneuvers": float(found.maneuvers[k]),
            "chi_square": float(found.chi_square[k]),
            "p_value": float(found.p_value[k]),
            "widened_by": float(found.factor[k]),
        }
        for k, name in enumerate(found.names)
        if isfinite(found.p_value[k])
    }


def coefficient_document(answer: CoefficientAnswer, verdict: Verdict) -> dict[str, Any]:
    """Return a direct fit of coefficients: verdict, values, modes, delays, instrument errors."""
    flight = answer.fit.condition
    return {
        "template": "coefficients",
        "model": answer.model.name,
        "terms": [name for name, _, _ in answer.model.named()],
        "method": METHOD,
        "verdict": list(verdict.lines),
        "marks": _mark_document(verdict),
        "airspeed_mps": flight.airspeed_mps,
        "qbar_pa": flight.qbar_pa,
        "alpha_rad": flight.alpha_rad,
        "CL": flight.lift,
        "CD": flight.drag,
        "coefficients": {
            d.name: {
                "value": d.value,
                "half_width": d.half_width,
                "relative_half_width": d.share,
                "flagged": d.flagged,
                "widened_by": answer.causes.get(d.name, ("", 0.0))[0],
            }
            for d in answer.fit.derivatives
        },
        "systems": {
            name: {
                "states": list(x.states),
                "inputs": list(x.inputs),
                "A": x.A.tolist(),
                "B": x.B.tolist(),
                "A_half_width": x.A_half.tolist(),
                "B_half_width": x.B_half.tolist(),
            }
            for name, x in answer.systems.items()
        },
        "modes": mode_document(coefficient_modes(answer, verdict)),
        "delays_s": {n: {"value": v, "half_width": h} for n, (v, h) in answer.delays.items()},
        "instrument_errors": {
            n: {"value": v, "standard_deviation": d} for n, (v, d) in answer.fit.errors.items()
        },
        "errors": [error.document() for error in answer.fit.error_sources],
        "fit": {"one_step": {n: {"nrmse": x.nrmse} for n, x in answer.fit.histories.items()}},
        "unseen": _prediction_document(answer.fit.prediction),
        "repeats": _repeats_document(answer.fit.maneuver_agreement),
        "maneuvers": list(answer.maneuvers),
    }
