"""The answer for MATLAB and its kin: a structure per model, histories in it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from host.export.mat_writer import cells, mat_name, write_mat
from host.sysid.models.parameter_units import parameter_unit
from host.sysid.reconstruction.inverse_sensor_model import FIT_RATE_HZ

if TYPE_CHECKING:
    from host.arrays import Array
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.linear.linear_answer import Answer
    from host.sysid.models.modal_analysis import Mode


def write_answers(path: Path, answers: Sequence[Answer], direct: CoefficientAnswer | None) -> None:
    """Write the answers, a structure each: matrices, estimates, covariance, modes, histories.

    Parameters
    ----------
    path : Path
    answers : sequence of Answer
        Where one model has answers by several methods the method is in the structure's name.
    direct : CoefficientAnswer or None
        Becomes `coefficients` and its linear motion `coefficients_longitudinal`, `_lateral`.
    """
    content: dict[str, Any] = {}
    for answer, label in zip(answers, labels(answers), strict=True):
        content[mat_name(label, content)] = _linear(answer)
    if direct:
        content["coefficients"] = _coefficients(direct)
        for name, system in direct.systems.items():
            content[f"coefficients_{name}"] = {
                "A": system.A,
                "B": system.B,
                "A_half_width": system.A_half,
                "B_half_width": system.B_half,
                "states": cells(system.states),
                "inputs": cells(system.inputs),
            }
    write_mat(path, content)


def labels(answers: Sequence[Answer]) -> list[str]:
    """Return a name for each answer that no other has: template, and method where several."""
    templates = [a.template for a in answers]
    found: list[str] = []
    seen: Counter[str] = Counter()  # models of one name
    for answer, template in zip(answers, templates, strict=True):
        several = templates.count(template) > 1
        label = f"{template}_{answer.method}" if several else template
        seen[label] += 1
        found.append(f"{label}_{seen[label]}" if seen[label] > 1 else label)
    return found


def _linear(answer: Answer) -> dict[str, Any]:
    A, B, C, D = answer.result.matrices()
    result = answer.result
    return {
        "A": A,
        "B": B,
        "C": C,
        "D": D,
        "names": cells(result.names),
        "units": cells(parameter_unit(answer.model, name) for name in result.names),
        "estimate": result.estimate,
        "covariance": result.covariance,
        "half_width": result.half_width(),
        "states": cells(answer.model.states),
        "inputs": cells(answer.model.inputs),
        "outputs": cells(answer.model.outputs),
        "method": answer.method,
        "airspeed_mps": answer.condition.airspeed_mps,
        "qbar_pa": answer.condition.qbar_pa,
        "alpha_rad": answer.trim.alpha_rad,
        "theta_rad": answer.trim.theta_rad,
        "refused": cells(r.name for r in answer.identifiability_flags),
        "delays": _pairs(answer.delays),
        "coefficients": _pairs({c.name: (c.value, c.half_width) for c in answer.coefficients}),
        "modes": _modes(answer.modes),
        "residual_kind": result.residual_kind,
        "maneuvers": cells(
            {
                "name": maneuver.name,
                "t_s": maneuver.time_s,
                "input": maneuver.inputs,
                "measured": maneuver.outputs,
                "simulated": simulated,
                "residual": residual,
            }
            for maneuver, simulated, residual in zip(
                answer.maneuvers, answer.simulated, result.residuals, strict=True
            )
        ),
    }


def _coefficients(answer: CoefficientAnswer) -> dict[str, Any]:
    found, flight = answer.fit.derivatives, answer.fit.condition
    traces = answer.fit.histories
    return {
        "names": cells(d.name for d in found),
        "estimate": np.array([d.value for d in found]),
        "half_width": np.array([d.half_width for d in found]),
        "flagged": np.array([d.flagged for d in found]),
        "covariance": answer.fit.covariance[: len(found), : len(found)],
        "airspeed_mps": flight.airspeed_mps,
        "qbar_pa": flight.qbar_pa,
        "alpha_rad": flight.alpha_rad,
        "delays": _pairs(answer.delays),
        "modes": _modes(answer.modes),
        "histories": {
            name: {
                "t_s": np.arange(len(trace.model)) / FIT_RATE_HZ,
                "measured": trace.measured,
                "fitted": trace.model,
            }
            for name, trace in traces.items()
        },
    }


def _pairs(values: Mapping[str, tuple[float, float]]) -> dict[str, Any]:
    """Return a table of values with their 95 % half-widths."""
    table: Array = np.array(list(values.values()), dtype=np.float64).reshape(-1, 2)
    return {"names": cells(values), "value": table[:, 0], "half_width": table[:, 1]}


def _modes(modes: Sequence[Mode]) -> dict[str, Any]:
    return {
        "names": cells(m.name for m in modes),
        "eigenvalue": np.array([m.eigenvalue for m in modes]),
        "frequency_radps": np.array([m.frequency_radps for m in modes]),
        "frequency_half_width_radps": np.array([m.frequency_half_width_radps for m in modes]),
        "damping": np.array([m.damping for m in modes]),
        "damping_half_width": np.array([m.damping_half_width for m in modes]),
    }
