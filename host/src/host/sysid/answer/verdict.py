"""The answer in words: what to trust, what not and why, what to fly again."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from host.constants import DEG_PER_RAD
from host.sysid.answer.parameter_units import parameter_unit
from host.sysid.coefficients.coefficient_fit import FLAG_SHARE
from host.sysid.coefficients.coefficient_model import standard_model
from host.sysid.compatibility.sensor_corrections import correction_lines
from host.sysid.flight.linear_estimator import Answer, from_zero
from host.sysid.flight.maneuver_detection import DetectedManeuver, Grade
from host.sysid.models.diagnostics import NOT_IDENTIFIABLE, reference_values
from host.sysid.models.modal_analysis import Mode
from host.sysid.models.residual_delays import STANDARD_DELAYS

if TYPE_CHECKING:
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer

TRUST = 0.10  # 95 % half-width over value: good enough to design with
FAIR = 0.30
UNPREDICTED = 0.5  # NRMSE of an output of an unseen maneuver
PART = 0.25  # of a mode's participation: a state that makes it what it is
MIXED = 0.98  # correlation of two inputs
WORSE = 1.25  # NRMSE of unseen over fitted maneuvers: more is a model that does not carry over
# What a parameter may be used for, best first.
MARKS = TRUSTED, CAREFUL, SMALL, UNSURE, USELESS = (
    "trust", "use with care", "less than 5 % of the row", "do not rely on", "do not use",
)  # fmt: skip
NEEDS = {
    "alpha": "an elevator 3-2-1-1 at the short-period frequency",
    "q": "a quicker elevator 3-2-1-1",
    "de": "a larger elevator doublet",
    "V": "an elevator pulse and 20 s hands off, for the phugoid",
    "beta": "a rudder doublet at the dutch-roll frequency",
    "p": "a larger aileron doublet",
    "r": "a rudder 3-2-1-1",
    "da": "a larger aileron doublet",
    "dr": "a larger rudder doublet",
}


def maneuver_lines(graded: Sequence[tuple[DetectedManeuver, Grade]]) -> list[str]:
    """Return the list of maneuvers for people."""
    lines = [f"{len(graded)} maneuvers found"]
    for number, (item, mark) in enumerate(graded, start=1):
        unit = "" if item.axis == "throttle" else " deg"
        size = item.amplitude if item.axis == "throttle" else item.amplitude * DEG_PER_RAD
        lines.append(
            f"  {number:2d}  {item.start_s:8.2f} to {item.end_s:8.2f} s"
            f"  {item.axis.split('_')[0]:8s} {item.kind:10s} {size:5.1f}{unit}"
            f"  grade {mark.score:4.2f}" + (f"  {'; '.join(mark.remarks)}" if mark.remarks else "")
        )
    return lines


@dataclass(frozen=True, slots=True)
class Verdict:
    """What of one model may be relied on.

    Attributes
    ----------
    heading : str
        The model, its maneuvers and method.
    marks : dict
        Parameter to one of `MARKS`; what is neither derivative nor coefficient has none.
    lines : tuple of str
        The same in words, with the reasons and what to fly again; the heading is the first.
    """

    heading: str
    marks: dict[str, str]
    lines: tuple[str, ...]


def verdict_of(answer: Answer | CoefficientAnswer) -> Verdict:
    """Return the verdict of one answer, a linear model or coefficients fitted directly."""
    return _linear_verdict(answer) if isinstance(answer, Answer) else _direct_verdict(answer)


def verdict_lines(answers: Sequence[Answer | CoefficientAnswer], notes: Sequence[str]) -> list[str]:
    """Return the verdict: notes first, then per model what to trust and what to re-fly."""
    lines = [f"note: {note}" for note in notes]
    for answer in answers:
        lines += verdict_of(answer).lines
    return lines


def removed_error_lines(answers: Sequence[Answer]) -> list[str]:
    """Return which errors of sensors were taken out of the columns of linear fits."""
    return correction_lines(answers[0].corrections) if answers else []


def _headed(marks: Mapping[str, str], mark: str) -> list[str]:
    """Return the names under a heading."""
    return [name for name, own in marks.items() if own == mark]


def _first_lines(heading: str, marks: Mapping[str, str], fair: float) -> list[str]:
    """Return the heading, then what is within a tenth and what within `fair` of its size."""
    lines = [heading, f"  trust (within 10 %):  {', '.join(_headed(marks, TRUSTED)) or 'nothing'}"]
    if careful := _headed(marks, CAREFUL):
        lines.append(f"  use with care (10 to {100.0 * fair:.0f} %):  {', '.join(careful)}")
    return lines


def _linear_verdict(answer: Answer) -> Verdict:
    result = answer.result
    half = result.half_width()
    refused = {r.name for r in answer.refused}
    size = reference_values(answer.model, answer.maneuvers, result.estimate)
    lost = unpredicted(answer)
    doubted = _entries_of(answer, lost)
    both = _of_both(answer)
    heading = (
        f"{answer.template}: {_fitted(len(answer.used))} by"
        f" {result.method}, {len(answer.held_out)} held out"
    )
    marks, loose = {}, []
    for k, parameter in enumerate(answer.model.parameters):
        name = parameter.name
        if name.startswith("imu_"):  # a place of a sensor, not of the aircraft
            continue
        share = float(half[k]) / max(float(size[k]), 1e-300)
        if not result.converged:
            marks[name] = USELESS
        elif name in refused:
            grade = next(r.grade for r in answer.refused if r.name == name)
            marks[name] = USELESS if grade == NOT_IDENTIFIABLE else UNSURE
        elif half[k] == 0.0 or name in doubted or name in both:  # on a bound: warned of
            marks[name] = UNSURE
        elif share <= FAIR and size[k] > abs(float(result.estimate[k])):
            marks[name] = SMALL
        elif share <= FAIR:
            marks[name] = TRUSTED if share <= TRUST else CAREFUL
        else:
            marks[name] = UNSURE
            loose.append(f"{name} ({ceil(100.0 * share)} %)")
    lines = _first_lines(heading, marks, FAIR)
    if not result.converged:
        wrong = "  no convergence: estimates and intervals mean nothing, use another method"
        lines.insert(1, wrong)
    if loose:
        lines.append(f"  do not rely on (above 30 %):  {', '.join(loose)}")
    if little := _headed(marks, SMALL):
        lines.append(f"  less than 5 % of their row, known to be:  {', '.join(little)}")
    if doubted - refused:
        names = ", ".join(n for n in answer.model.parameter_names if n in doubted - refused)
        lines.append(f"  do not rely on {names}, whatever the interval: {_why(answer, lost)}")
    lines += _refusals(answer)
    lines += _inputs(answer, both)
    lines += _data(answer)
    return Verdict(heading, marks, tuple(lines))


def _refusals(answer: Answer) -> list[str]:
    """Return what cannot be told and why, and what to fly to learn it."""
    lines = []
    for refusal in answer.refused:
        if not refusal.name.startswith("imu_"):
            warning = "do not use" if refusal.grade == NOT_IDENTIFIABLE else "doubtful,"
            lines.append(f"  {warning} {refusal.name}: {refusal.reason}")
    flights = {
        NEEDS[r.name.split("_")[-1]] for r in answer.refused if r.name.split("_")[-1] in NEEDS
    }
    if flights:
        lines.append(f"  to learn them, fly {'; '.join(sorted(flights))}")
    return lines


def _inputs(answer: Answer, both: set[str]) -> list[str]:
    """Return what is said of inputs that moved together, or not at all."""
    lines = [
        f"  {one} and {other} move together: fly them one at a time, without a mixer, or leave"
        " one out of a model of your own"
        for one, other in correlated_inputs(answer)
    ]
    if both:
        lines.append(
            f"  do not rely on {', '.join(sorted(both))}: of both inputs, one was left out"
        )
    lines += [
        f"  {name} never moved: its derivatives are the bias under another name"
        for name in answer.constant_inputs
    ]
    if answer.collinearity.severe:
        pairs = ", ".join(f"{a} with {b}" for a, b, _ in answer.collinearity.pairs[:3])
        lines.append("  the data are close to collinear" + (f" ({pairs})" if pairs else ""))
    return lines


def _data(answer: Answer) -> list[str]:
    """Return what bounds and warnings say, and whether unseen data were predicted."""
    lines = [
        f"  {name} is at its bound: no delay of that sensor, but what the model lacks there"
        for name in answer.at_bound
    ]
    lines += [f"  warning: {warning}" for warning in answer.result.warnings]
    poor = [f.name for f in answer.validation if not f.nrmse < UNPREDICTED]
    if answer.validation:
        lines.append(
            "  prediction of the unseen maneuver: "
            + ("fails for " + ", ".join(poor) if poor else "holds for every output")
        )
    else:
        lines.append(
            "  nothing was left to be predicted: what the model lacks is in no interval; fly each"
            " input three times"
        )
    return lines


def correlated_inputs(answer: Answer) -> list[tuple[str, str]]:
    """Return inputs that were moved as one, by a mixer or a habit."""
    moved = np.concatenate([m.inputs - m.inputs.mean(axis=0) for m in answer.maneuvers])
    power = moved.T @ moved
    pairs = itertools.combinations(range(len(answer.model.inputs)), 2)
    return [
        (answer.model.inputs[i], answer.model.inputs[j])
        for i, j in pairs
        if power[i, j] ** 2 > MIXED**2 * power[i, i] * power[j, j] > 0.0
    ]


def _of_both(answer: Answer) -> set[str]:
    """Return what stands for two inputs, where a regression left the entries of one out."""
    model, result = answer.model, answer.result
    out = {
        p.name for k, p in enumerate(model.parameters)
        if result.estimate[k] == 0.0 and result.half_width()[k] == 0.0
    }  # fmt: skip
    both: set[str] = set()
    for pair in correlated_inputs(answer):
        own = {
            t.parameter for t in model.terms if t.matrix in "BD" and model.inputs[t.column] in pair
        }
        both |= own - out if own & out else set()
    return both


def unpredicted(answer: Answer) -> list[str]:
    """Return the states that the model does not carry: unseen maneuvers say so, or a delay.

    A delay at its bound is what a model lacks in that signal. An interval counts noise and gusts,
    not what is lacking: on a demonstration flight D_V was -0.33 +- 0.02 where -0.61 was true.
    """
    failing = _failing(answer)
    for group in (*STANDARD_DELAYS, *answer.model.delays):
        if group.name in answer.at_bound:
            failing |= set(group.outputs)
    return [state for state in answer.model.states if state in failing]


def _failing(answer: Answer) -> set[str]:
    return {f.name for f in answer.validation if not f.nrmse < UNPREDICTED}


def _why(answer: Answer, states: Sequence[str]) -> str:
    failing = _failing(answer)
    return ", ".join(
        f"{s} is not predicted" if s in failing else f"the delay of {s} is at its bound"
        for s in states
    )


def not_relied_on(answer: Answer) -> set[str]:
    """Return the parameters that the verdict does not let a reader use."""
    half = answer.result.half_width()
    size = reference_values(answer.model, answer.maneuvers, answer.result.estimate)
    wide = {p.name for k, p in enumerate(answer.model.parameters) if half[k] > FAIR * size[k]}
    refused = {r.name for r in answer.refused if r.grade == NOT_IDENTIFIABLE}
    return wide | refused | _entries_of(answer, unpredicted(answer))


def _entries_of(answer: Answer, states: Sequence[str]) -> set[str]:
    """Return the parameters in the equation of a state, and those it is multiplied by."""
    at = {answer.model.states.index(state) for state in states}
    return {
        term.parameter
        for term in answer.model.terms
        if term.matrix in "AB" and (term.row in at or (term.matrix == "A" and term.column in at))
    }


def _carried_by(answer: Answer, mode: Mode, states: Sequence[str]) -> list[str]:
    """Return those of some states that take a good part in a mode."""
    values, right = np.linalg.eig(answer.result.matrices()[0])
    left = np.linalg.inv(right)
    k = int(np.argmin(np.abs(values - mode.eigenvalue)))
    part = np.abs(left[k] * right[:, k])
    shares = dict(zip(answer.model.states, part / part.sum(), strict=True))
    return [state for state in states if shares[state] > PART]


def model_lines(answer: Answer) -> list[str]:
    """Return estimates, modes and fit as a table for people."""
    result = answer.result
    half = result.half_width()
    lines = [
        f"{answer.template} at {answer.condition.airspeed_mps:.2f} m/s,"
        f" alpha {answer.trim.alpha_rad * DEG_PER_RAD:.1f} deg; value and 95 % half-width"
    ]
    marks = {r.name: r.grade for r in answer.refused if not r.name.startswith("imu_")}
    for k, name in enumerate(answer.model.parameter_names):
        mark = f"  {marks[name]}" if name in marks else ""
        mark += "  at its bound" if name in answer.at_bound else ""
        unit = parameter_unit(answer.model, name)
        lines.append(
            f"  {name:16s} {result.estimate[k]:11.5g}  +- {half[k]:9.3g}  {unit:7s}{mark}".rstrip()
        )
    for name, (value, width) in answer.delays.items():
        mark = "  at its bound" if name in answer.at_bound else ""
        lines.append(f"  {name:16s} {value:11.5g}  +- {width:9.3g}  s      {mark}".rstrip())
    if answer.coefficients:
        lines.append(
            "  coefficients (mass, inertia, pressure, places, pots and delays in the half-width)"
        )
        lines += [
            f"  {c.name:16s} {c.value:11.5g}  +- {c.half_width:9.3g}"
            + ("" if from_zero(c) else "  not told from zero")
            for c in answer.coefficients
        ]
    lost = unpredicted(answer)
    for mode in answer.modes:
        in_it = _carried_by(answer, mode, lost)
        mark = f"  not to be relied on: {_why(answer, in_it)}" if in_it else ""
        lines.append(_mode_line(mode) + mark)
    for kind, fits in (
        ("free simulation, fitted data", answer.fits),
        ("free simulation, held-out data", answer.validation),
    ):
        if fits:
            shares = ", ".join(f"{f.name} {100.0 * f.nrmse:.1f} %" for f in fits)
            lines.append(f"  NRMSE ({kind}): {shares}")
    return lines


def _direct_verdict(answer: CoefficientAnswer) -> Verdict:
    along = sum(w.longitudinal for w in answer.windows)
    own = "" if answer.model == standard_model() else f" by the terms of '{answer.model.name}'"
    heading = (
        f"coefficients{own}: {along} maneuvers of the elevator, {len(answer.windows) - along} of"
        " aileron and rudder fitted jointly, errors of the instrument beside them"
    )
    marks = {}
    for d in answer.fit.derivatives:
        sharp = TRUSTED if d.share <= TRUST else CAREFUL
        marks[d.name] = sharp if not d.flagged else USELESS if d.share > 1.0 else UNSURE
    lines = _first_lines(heading, marks, FLAG_SHARE)
    needs = set()
    for d in answer.fit.derivatives:
        if not d.flagged:
            continue
        cause, part = answer.causes.get(d.name, ("", 0.0))
        why = f"{100.0 * part:.0f} % of the variance is {cause}" if cause else "excited too little"
        lines.append(f"  {marks[d.name]} {d.name}: +- {100.0 * min(d.share, 99.99):.0f} %, {why}")
        label = d.name.split("_")[-1]
        needs.add(
            f"measure {cause} better" if cause else f"fly {NEEDS.get(label, 'a larger input')}"
        )
    if needs:
        lines.append(f"  to learn them, {'; '.join(sorted(needs))}")
    repeats = answer.fit.maneuver_agreement
    lines += [
        f"  maneuvers do not agree on {name}: they scatter {repeats.factor[k]:.1f} times what noise"
        f" allows (chi-square {repeats.chi_square[k]:.1f} on {repeats.maneuvers[k] - 1.0:.1f}),"
        " interval widened to it"
        for k, name in enumerate(repeats.names)
        if repeats.factor[k] > 1.0
    ]
    return Verdict(heading, marks, (*lines, _prediction_words(answer)))


def _prediction_words(answer: CoefficientAnswer) -> str:
    """Return whether each maneuver is predicted by a fit to the others."""
    found, count = answer.fit.prediction, len(answer.windows)
    if found is None:
        return (
            "  no maneuver could be left out to be predicted: each alone tells a term; fly every"
            " input at least twice"
        )
    poor = [
        f"{name} (NRMSE {100.0 * unseen:.1f} %, fitted {100.0 * found.fitted[name]:.1f} %)"
        for name, unseen in found.left_out.items()
        if unseen > WORSE * found.fitted[name]
    ]
    return (
        f"  prediction of unseen maneuvers ({len(found.windows)} of {count}, each by the others): "
        + ("fails for " + ", ".join(poor) if poor else "holds for every coefficient")
    )


def coefficient_lines(answer: CoefficientAnswer) -> list[str]:
    """Return coefficients, modes, delays and fit as a table for people."""
    flight = answer.fit.condition
    lines = [
        f"coefficients at {flight.airspeed_mps:.2f} m/s, alpha"
        f" {flight.alpha_rad * DEG_PER_RAD:.1f} deg, CL {flight.lift:.3f}; value, 95 % half-width,"
        " what widens it most"
    ]
    for d in answer.fit.derivatives:
        small = " of 5 % of the row" if d.reference > abs(d.value) else ""
        cause = answer.causes.get(d.name, ("", 0.0))[0]
        line = f"  {d.name:9s} {d.value:10.4f}  +- {d.half_width:8.4f}  {100.0 * d.share:6.1f} %"
        line += f"{small}  {cause}" + ("  flagged" if d.flagged else "")
        lines.append(line.rstrip())
    lines.append("  CD_0 is the drag at zero lift, surfaces as flown")
    lines += [_mode_line(mode) for mode in answer.modes]
    delays = ", ".join(
        f"{name.split('_')[1]} {1e3 * value:+.2f} +- {1e3 * half:.2f} ms"
        for name, (value, half) in answer.delays.items()
    )
    lines.append(f"  residual delays: {delays}")
    shares = ", ".join(f"{n} {100.0 * x.nrmse:.1f} %" for n, x in answer.fit.histories.items())
    lines.append(f"  NRMSE (one-step, fitted data, gusts in it): {shares}")
    if answer.fit.prediction is not None:
        both = answer.fit.prediction.fitted, answer.fit.prediction.left_out
        shares = ", ".join(
            f"{name} {100.0 * fitted:.1f} / {100.0 * both[1][name]:.1f} %"
            for name, fitted in both[0].items()
        )
        lines.append(f"  the same below 4.5 Hz, fitted / unseen (leave-one-out): {shares}")
    return lines


def _fitted(count: int) -> str:
    return "1 maneuver fitted" if count == 1 else f"{count} maneuvers fitted jointly"


def _mode_line(mode: Mode) -> str:
    half = mode.frequency_half_width_radps
    if not mode.oscillatory:
        return f"  {mode.name}: {mode.eigenvalue.real:.3f} +- {half:.3f} 1/s"
    return (
        f"  {mode.name}: {mode.frequency_radps:.3f} +- {half:.3f} rad/s,"
        f" damping {mode.damping:.3f} +- {mode.damping_half_width:.3f}"
    )
