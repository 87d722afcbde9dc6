"""The verdict on a linear model: a mark for each parameter, the reasons, what to fly again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from host.sysid.answer.advised_inputs import advised_input
from host.sysid.answer.correlated_inputs import correlated_inputs
from host.sysid.answer.doubt import Doubt, reasons_by_name
from host.sysid.answer.feedback_pairs import combined_derivatives
from host.sysid.answer.marks import (
    CAREFUL,
    FAIR,
    SMALL,
    TRUST,
    TRUSTED,
    UNSURE,
    USELESS,
    Verdict,
    first_lines,
    names_marked,
    share_text,
)
from host.sysid.answer.servo_lines import servo_lines
from host.sysid.answer.trust_rules import unpredicted
from host.sysid.checks.data_finding import Finding
from host.sysid.errors.surface_motion import HELD_SURFACES
from host.sysid.estimators.users_model import NOISE_CHOSEN
from host.sysid.linear.linear_answer import Answer
from host.sysid.models.diagnostics import NOT_IDENTIFIABLE, reference_values

PLACE = "imu_"  # begins the name of a sensor's place: no property of the aircraft


def linear_verdict(
    answer: Answer, doubts: Sequence[Doubt], findings: Sequence[Finding] = ()
) -> Verdict:
    """Return the verdict on each parameter of a linear model.

    Parameters
    ----------
    answer : Answer
    doubts : sequence of Doubt
        All there are.
    findings : sequence of Finding
        Of the data checks.
    """
    count = len(answer.used)
    fitted = "1 maneuver fitted" if count == 1 else f"{count} maneuvers fitted jointly"
    heading = (
        f"{answer.template}: {fitted} by {answer.result.method}, {len(answer.held_out)} held out"
    )
    shares, reasons = relative_half_widths(answer), reasons_by_name(doubts)
    marks = linear_marks(answer, doubts)
    lines = first_lines(heading, marks, FAIR)
    if not answer.result.converged:
        wrong = "  no convergence: estimates and intervals mean nothing, use another method"
        lines.insert(1, wrong)
    lines += _width_lines(answer, marks, shares, reasons)
    lines += _doubt_lines(answer, doubts)
    lines += _identifiability_lines(answer)
    lines += [*_input_lines(answer), *servo_lines(answer)]
    lines += combined_derivatives(answer, findings)
    lines += _data_lines(answer)
    return Verdict(heading, marks, tuple(lines), _all_reasons(answer, marks, shares, reasons))


def relative_half_widths(answer: Answer) -> dict[str, float]:
    """Return each parameter's 95 % half-width over what it is judged against."""
    half = answer.result.half_width()
    size = reference_values(answer.model, answer.maneuvers, answer.result.estimate)
    return {
        p.name: float(half[k]) / max(float(size[k]), 1e-300)
        for k, p in enumerate(answer.model.parameters)
    }


def linear_marks(answer: Answer, doubts: Sequence[Doubt]) -> dict[str, str]:
    """Return the mark of each parameter by its interval and all doubts about it."""
    result, shares, reasons = answer.result, relative_half_widths(answer), reasons_by_name(doubts)
    size = reference_values(answer.model, answer.maneuvers, result.estimate)
    flags = {r.name: r.grade for r in answer.identifiability_flags}
    marks = {}
    for k, parameter in enumerate(answer.model.parameters):
        name = parameter.name
        if name.startswith(PLACE):
            continue
        if not result.converged or flags.get(name) == NOT_IDENTIFIABLE:
            marks[name] = USELESS
        elif name in flags or name in reasons or shares[name] > FAIR:
            marks[name] = UNSURE
        elif size[k] > abs(float(result.estimate[k])):
            marks[name] = SMALL
        else:
            marks[name] = TRUSTED if shares[name] <= TRUST else CAREFUL
    return marks


def _all_reasons(
    answer: Answer,
    marks: Mapping[str, str],
    shares: Mapping[str, float],
    doubts: Mapping[str, tuple[str, ...]],
) -> dict[str, tuple[str, ...]]:
    """Return why each parameter stands under its mark."""
    flags = {r.name: r.reason for r in answer.identifiability_flags}
    found = {}
    for name in marks:
        own = [f"95 % half-width {share_text(shares[name])}"]
        own += [flags[name]] if name in flags else []
        own += [] if answer.result.converged else ["no convergence"]
        found[name] = (*own, *doubts.get(name, ()))
    return found


def _width_lines(
    answer: Answer,
    marks: Mapping[str, str],
    shares: Mapping[str, float],
    reasons: Mapping[str, tuple[str, ...]],
) -> list[str]:
    """Return which parameters only their width rules out, and which are small."""
    flagged = {r.name for r in answer.identifiability_flags}
    lines = []
    wide = [
        f"{name} ({share_text(shares[name])})"
        for name in names_marked(marks, UNSURE)
        if name not in flagged and name not in reasons
    ]
    if wide:
        lines.append(f"  do not rely on (above 30 %):  {', '.join(wide)}")
    if little := names_marked(marks, SMALL):
        lines.append(
            f"  small (less than 5 % of their row, and known to be so):  {', '.join(little)}"
        )
    return lines


def _doubt_lines(answer: Answer, doubts: Sequence[Doubt]) -> list[str]:
    """Return a line for each doubt; what is not identifiable has its own."""
    flagged = {r.name for r in answer.identifiability_flags}
    lines = []
    for one in doubts:
        names = ", ".join(n for n in one.names if n not in flagged)
        if names:
            lines.append(f"  do not rely on {names}, whatever the interval: {one.reason}")
    return lines


def _identifiability_lines(answer: Answer) -> list[str]:
    """Return the parameters that cannot be identified, the reasons, and what to fly."""
    flags = [r for r in answer.identifiability_flags if not r.name.startswith(PLACE)]
    lines = []
    for flag in flags:
        warning = "do not use" if flag.grade == NOT_IDENTIFIABLE else "doubtful,"
        lines.append(f"  {warning} {flag.name}: {flag.reason}")
    inputs = {advised_input(flag.name) for flag in flags} - {""}
    if inputs:
        lines.append(f"  to learn them, fly {'; '.join(sorted(inputs))}")
    return lines


def _input_lines(answer: Answer) -> list[str]:
    """Return the remarks on correlated inputs, and on inputs that did not move."""
    lines = [
        f"  {one} and {other} move together: fly them one at a time, without a mixer, or leave"
        " one out of a model of your own"
        for one, other in correlated_inputs(answer)
    ]
    lines += [
        f"  {name} never moved: its derivatives are the bias under another name"
        for name in answer.constant_inputs
    ]
    if answer.collinearity.severe:
        pairs = ", ".join(f"{a} with {b}" for a, b, _ in answer.collinearity.pairs[:3])
        lines.append("  the data are close to collinear" + (f" ({pairs})" if pairs else ""))
    return lines


def _data_lines(answer: Answer) -> list[str]:
    """Return the lines on bounds, warnings, and prediction of held-out data."""
    lines = [
        f"  {name} is at its bound: no delay of that sensor, but what the model lacks there"
        for name in answer.at_bound
    ]
    lines += [
        f"  {text}" if text.startswith((NOISE_CHOSEN, HELD_SURFACES)) else f"  warning: {text}"
        for text in answer.result.warnings
    ]
    poor = [f.name for f in unpredicted(answer)]
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
