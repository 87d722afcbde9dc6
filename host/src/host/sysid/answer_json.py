"""The answer for programs: plain numbers, lists and strings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from host.sysid.finder import Found, Grade
from host.sysid.flight import Answer


def maneuver_document(graded: Sequence[tuple[Found, Grade]]) -> list[dict[str, Any]]:
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


def answer_document(answer: Answer, lines: Sequence[str]) -> dict[str, Any]:
    """Return one fitted model: verdict, estimates with intervals, modes, figures of fit."""
    result = answer.result
    half = result.half_width()
    A, B, C, D = result.matrices()
    return {
        "template": answer.template,
        "method": result.method,
        "verdict": list(lines),
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
        "parameters": {
            name: {"value": float(result.estimate[k]), "half_width": float(half[k])}
            for k, name in enumerate(result.names)
        },
        "delays_s": {
            name: {"value": value, "half_width": width}
            for name, (value, width) in answer.delays.items()
        },
        "refused": [
            {"name": r.name, "relative_bound": r.relative_bound, "reason": r.reason}
            for r in answer.refused
        ],
        "coefficients": {
            c.name: {"value": c.value, "half_width": c.half_width, "fit_error": c.fit_error}
            for c in answer.coefficients
        },
        "modes": [
            {
                "name": m.name,
                "eigenvalue": [m.eigenvalue.real, m.eigenvalue.imag],
                "frequency_radps": m.frequency_radps,
                "frequency_half_width": 1.96 * m.frequency_sd_radps,
                "damping": m.damping,
                "damping_half_width": 1.96 * m.damping_sd,
            }
            for m in answer.modes
        ],
        "fit": {
            kind: {
                f.name: {
                    "r_squared": f.r_squared,
                    "nrmse": f.nrmse,
                    "theil": f.theil,
                    "ljung_box_p": f.ljung_box_p,
                }
                for f in fits
            }
            for kind, fits in (("fitted", answer.fits), ("held_out", answer.validation))
        },
        "maneuvers": [m.name for m in answer.maneuvers],
    }
