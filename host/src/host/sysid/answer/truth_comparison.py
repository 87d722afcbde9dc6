"""The answer compared with the truth of a simulated flight."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from host.aircraft.gains import dimensional_name
from host.aircraft.mode_names import LATERAL, LONGITUDINAL
from host.errors import IdentificationError
from host.files.user_text import read_toml
from host.sysid.answer.mat_file import labels
from host.sysid.linear.model_names import AXIS_OF
from host.sysid.models.diagnostics import reference_values

if TYPE_CHECKING:
    from host.sysid.aerodynamics.coefficient import CoefficientTable
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.linear.linear_answer import Answer
    from host.sysid.models.modal_analysis import Mode


def read_truth(path: Path) -> dict[str, Any]:
    """Read the truth file `host simulate` writes next to a log.

    Raises
    ------
    IdentificationError
        If the file is none of these.
    """
    document = read_toml(path, IdentificationError)
    if not isinstance(document.get("maneuver"), list):
        raise IdentificationError(f"{path}: no [[maneuver]] in it; expected flight.truth.toml")
    return document


def _of_axes(document: dict[str, Any], template: str, key: str) -> list[dict[str, Any]]:
    axes = {axis.split("_")[0] for axis in AXIS_OF.get(template, ())}
    return [m[key] for m in document["maneuver"] if axes & set(m.get("axes", ())) and key in m]


def true_coefficients(document: dict[str, Any], template: str) -> dict[str, float]:
    """Return local derivatives averaged over the maneuvers of a template's axes."""
    tables = _of_axes(document, template, "derivatives")
    if not tables:
        return {}
    return {name: sum(t[name] for t in tables) / len(tables) for name in tables[0]}


def true_modes(document: dict[str, Any], template: str) -> dict[str, tuple[float, float]]:
    """Return frequency (rad/s) and damping of each mode, averaged in the same way."""
    tables = _of_axes(document, template, "modes")
    if not tables:
        return {}
    shared = [name for name in tables[0] if all(name in t for t in tables)]
    count = len(tables)
    return {
        name.replace("_", " "): (
            sum(t[name][0] for t in tables) / count,
            sum(t[name][1] for t in tables) / count,
        )
        for name in shared
    }


def true_derivatives(document: dict[str, Any], template: str) -> dict[str, float]:
    """Return dimensional derivatives averaged in the same way; none of an older truth file."""
    tables = _of_axes(document, template, "dimensional")
    if not tables:
        return {}
    return {name: sum(t[name] for t in tables) / len(tables) for name in tables[0]}


def as_flown(document: dict[str, Any], answer: Answer) -> dict[str, Any]:
    """Return the truth of the maneuvers that a linear answer was fitted to.

    Derivatives go with the square of the airspeed, so those of a trim, or of a maneuver that was
    held out, are others. Without times of the log's first row (several flights) all stay.
    """
    first = 0.0 if "power_on_s" in document else document.get("first_row_s")  # an older file
    if first is None:
        return document
    spans = [(m.start_s + first, m.end_s + first) for m in answer.used]
    met = [
        m
        for m in document["maneuver"]
        if any(begin < m["input_end_s"] and m["start_s"] < end for begin, end in spans)
    ]
    return document | {"maneuver": met} if met else document


def true_poles(
    modes: Sequence[Mode], document: dict[str, Any] | None, templates: Sequence[str]
) -> dict[str, complex]:
    """Return the true pole, of positive imaginary part, of each mode that the truth has."""
    found: dict[str, complex] = {}
    for template in templates if document is not None else ():
        for name, (frequency, damping) in true_modes(document or {}, template).items():
            turn = max(1.0 - damping**2, 0.0) ** 0.5
            found[name] = complex(-damping * frequency, turn * frequency)
    return {mode.name: found[mode.name] for mode in modes if mode.name in found}


@dataclass(frozen=True, slots=True)
class TruthComparison:
    """One figure and its truth; the error is relative to `reference`.

    That is |truth|, or what would contribute 5 % of its row's largest where that is known and more
    (`small`): a coefficient that is next to nothing is not judged by its own size.
    """

    name: str
    value: float
    half_width: float
    truth: float
    reference: float
    small: bool = False

    @property
    def covered(self) -> bool:
        """Whether the 95 % interval holds the truth."""
        return bool(abs(self.value - self.truth) <= self.half_width)

    @property
    def error(self) -> float:
        """Estimate minus truth, over the reference; NaN over nothing."""
        return (self.value - self.truth) / self.reference if self.reference else float("nan")


def compared_coefficients(
    table: CoefficientTable, document: dict[str, Any], floors: Mapping[str, float]
) -> list[TruthComparison]:
    """Return the coefficients of a table that the truth has.

    Parameters
    ----------
    table : CoefficientTable
    document : dict
        From `read_truth`.
    floors : mapping
        Coefficient to what would contribute 5 % of its row's largest, where it contributes less.
    """
    truth = true_coefficients(document, table.template)
    found = []
    for c in table.coefficients:
        if c.name not in truth:
            continue
        floor = floors.get(c.name, 0.0)
        size = abs(truth[c.name])
        reference, small = max(size, floor), floor > size
        found.append(
            TruthComparison(c.name, c.value, c.half_width, truth[c.name], reference, small)
        )
    return found


def compared_derivatives(answer: Answer, document: dict[str, Any]) -> list[TruthComparison]:
    """Return the dimensional derivatives of a template that the truth has, of its maneuvers."""
    truth, size = true_derivatives(document, answer.template), true_references(answer, document)
    names = [p.name for p in answer.model.parameters]
    half = dict(zip(names, answer.result.half_width(), strict=False))
    found = []
    for name in size:
        own = answer.result.value(name), float(half[name]), truth[name], size[name]
        found.append(TruthComparison(name, *own, small=size[name] > abs(truth[name])))
    return found


def true_references(answer: Answer, document: dict[str, Any]) -> dict[str, float]:
    """Return what an error of each derivative is relative to, by the true ones and the motion.

    The truth, or where it contributes less than 5 % of its row what would contribute 5 %.
    """
    truth = {} if answer.own_model else true_derivatives(document, answer.template)
    names = [p.name for p in answer.model.parameters]
    true = np.array([truth.get(n, answer.result.value(n)) for n in names])
    size = reference_values(answer.model, answer.maneuvers, true)
    return {n: max(float(size[k]), abs(truth[n])) for k, n in enumerate(names) if n in truth}


def compared_estimates(answer: Answer, document: dict[str, Any]) -> list[TruthComparison]:
    """Return the coefficients of a linear answer with their truth; without any its derivatives."""
    flown = as_flown(document, answer)
    if answer.coefficients:
        return compared_coefficients(answer.table, flown, coefficient_floors(answer, flown))
    return compared_derivatives(answer, flown)


def coefficient_floors(answer: Answer, document: dict[str, Any]) -> dict[str, float]:
    """Return what would contribute 5 % of its row, of coefficients whose derivative is less."""
    truth, size = true_derivatives(document, answer.template), true_references(answer, document)
    found = {}
    for c in answer.coefficients:
        of = dimensional_name(c.name)
        if size.get(of, 0.0) > abs(truth.get(of, 0.0)) and answer.result.value(of):
            found[c.name] = size[of] * abs(c.value / answer.result.value(of))
    return found


def mode_comparisons(
    modes: Sequence[Mode], document: dict[str, Any], templates: Sequence[str]
) -> list[TruthComparison]:
    """Return frequencies, and dampings of those that swing, that the truth has.

    A real mode is its root, 1/s: minus its rate constant where it dies away.
    """
    true: dict[str, tuple[float, float]] = {}
    for template in templates:
        own = LONGITUDINAL if "elevator_rad" in AXIS_OF.get(template, ()) else LATERAL
        true |= {n: t for n, t in true_modes(document, template).items() if n in own}
    found = []
    for mode in modes:
        if mode.name not in true:
            continue
        frequency, damping = true[mode.name]
        half = mode.frequency_half_width_radps
        if mode.oscillatory and abs(damping) < 1.0:
            found.append(
                TruthComparison(mode.name, mode.frequency_radps, half, frequency, frequency)
            )
            half = mode.damping_half_width
            label = f"{mode.name}, damping"
            found.append(TruthComparison(label, mode.damping, half, damping, abs(damping)))
        elif not mode.oscillatory and abs(damping) == 1.0:
            root = -damping * frequency
            found.append(TruthComparison(mode.name, mode.eigenvalue.real, half, root, abs(root)))
    return found


def truth_lines(found: Sequence[TruthComparison]) -> list[str]:
    """Return a table of estimates against the truth."""
    if not found:
        return ["nothing to compare: this file of truth has no derivatives of these models"]
    return [
        "against the truth of the simulated flight (mean of maneuvers)",
        *map(_line, found),
        f"  {sum(c.covered for c in found)} of {len(found)} intervals hold the truth",
    ]


def truth_report_lines(
    answers: Sequence[Answer], direct: CoefficientAnswer | None, document: dict[str, Any]
) -> list[str]:
    """Return all answers against the truth: coefficients fitted directly line by line.

    Without such a fit the linear models are; with one they have a summary each.
    """
    lines = []
    if direct:
        floors = small_references(direct)
        lines = truth_lines(
            [c for table in direct.tables for c in compared_coefficients(table, document, floors)]
        )
        lines += mode_truth_lines(
            mode_comparisons(direct.modes, document, ("longitudinal", "lateral"))
        )
    else:
        lines = truth_lines([c for a in answers for c in compared_estimates(a, document)])
    for answer in answers:
        own = mode_comparisons(answer.modes, as_flown(document, answer), (answer.template,))
        if direct:
            label = f"{answer.template}, {answer.result.method}"
            lines += truth_summary(label, [*compared_estimates(answer, document), *own])
        else:
            lines += mode_truth_lines(own)
    return lines


def small_references(direct: CoefficientAnswer) -> dict[str, float]:
    """Return the value that would contribute 5 % of the equation, for coefficients that
    contribute less."""
    return {d.name: d.reference for d in direct.fit.derivatives if d.reference > abs(d.value)}


def mode_truth_lines(found: Sequence[TruthComparison]) -> list[str]:
    """Return the modes against the truth; nothing where there are none."""
    if not found:
        return []
    held = sum(c.covered for c in found)
    return [*map(_line, found), f"  {held} of {len(found)} intervals of the modes hold the truth"]


def truth_summary(label: str, found: Sequence[TruthComparison]) -> list[str]:
    """Return in a line or two how a model fared, and by how much what is outside."""
    if not found:
        return []
    outside = [
        f"{c.name} {c.value:.3g} +- {c.half_width:.2g}, truth {c.truth:.3g}"
        for c in found
        if not c.covered
    ]
    held = f"{label}: {len(found) - len(outside)} of {len(found)} intervals hold the truth"
    return textwrap.wrap(
        held + (f"; outside: {'; '.join(outside)}" if outside else ""),
        100,
        initial_indent="  ",
        subsequent_indent="    ",
        break_on_hyphens=False,
    )


def truth_document(
    answers: Sequence[Answer], direct: CoefficientAnswer | None, document: dict[str, Any]
) -> dict[str, dict[str, dict[str, float | bool]]]:
    """Return the comparison of every answer for JSON, by template."""
    found = {
        label: [
            *compared_estimates(a, document),
            *mode_comparisons(a.modes, as_flown(document, a), (a.template,)),
        ]
        for a, label in zip(answers, labels(answers), strict=True)
    }
    if direct:
        floors = small_references(direct)
        found["coefficients"] = [
            *(c for table in direct.tables for c in compared_coefficients(table, document, floors)),
            *mode_comparisons(direct.modes, document, ("longitudinal", "lateral")),
        ]
    return {
        label: {
            c.name: {
                "value": c.value,
                "half_width": c.half_width,
                "truth": c.truth,
                "reference": c.reference,
                "relative_error": c.error,
                "inside": c.covered,
            }
            for c in own
        }
        for label, own in found.items()
    }


def _line(c: TruthComparison) -> str:
    share = f"{100.0 * c.error:+7.1f} %" if isfinite(c.error) else "        -"
    small = " of what would be 5 % of its equation" if c.small else ""
    return (
        f"  {c.name:21s} {c.value:9.{_decimals(c)}f} +- {c.half_width:7.{_decimals(c)}f}"
        f"  truth {c.truth:9.{_decimals(c)}f}"
        f"  error {share}{small}  {'inside' if c.covered else 'OUTSIDE'}"
    )


def _decimals(c: TruthComparison) -> int:
    """Return how many decimals five digits of a figure leave."""
    return min(4, max(0, 5 - len(str(int(max(abs(c.value), abs(c.truth)))))))
