"""What an answer says at first: the modes and one table; the rest is for who asks for it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from host.aircraft.gains import dimensional_name
from host.constants import DEG_PER_RAD
from host.sysid.answer.converted_marks import converted_marks
from host.sysid.answer.marks import FAIR, SMALL, Verdict, share_text
from host.sysid.answer.mode_lines import linear_mode_lines, mode_lines
from host.sysid.models.diagnostics import reference_values
from host.sysid.models.parameter_units import parameter_unit

if TYPE_CHECKING:
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.linear.linear_answer import Answer

MOST_LINES = 40  # of the table: a screen
# A derivative and the coefficient that stands beside it.
COEFFICIENT_OF = {"D": "CD", "Z": "CL", "M": "Cm", "Y": "CY", "L": "Cl", "N": "Cn"}
REST = "--full adds the constants, sensors' errors, delays, fit and every cause"


def mode_summary(linear: Sequence[Answer], direct: CoefficientAnswer | None) -> list[str]:
    """Return each model's condition and its modes."""
    lines = []
    models = [answer.template for answer in linear]
    for answer in linear:
        known = answer.trim.known
        by = f" by {answer.method}" if models.count(answer.template) > 1 else ""
        speed = f"{answer.condition.airspeed_mps:.2f} m/s" if known else "unknown airspeed"
        alpha = f"alpha {answer.trim.alpha_rad * DEG_PER_RAD:.1f} deg"
        lines += [f"modes, {answer.template}{by} at {speed}, {alpha}", *linear_mode_lines(answer)]
    if direct and not linear:
        flight = direct.fit.condition
        alpha = f"alpha {flight.alpha_rad * DEG_PER_RAD:.1f} deg"
        lines += [f"modes at {flight.airspeed_mps:.2f} m/s, {alpha}", *mode_lines(direct.modes)]
    return lines


def short_table(
    linear: Sequence[Answer], direct: CoefficientAnswer | None, verdicts: Sequence[Verdict]
) -> list[str]:
    """Return one table of at most `MOST_LINES` lines: every derivative, its coefficient beside."""
    heading = "estimate, 95 % half-width, its share, mark" + (
        "; its coefficient" if any(a.coefficients for a in linear) else ""
    )
    both = zip(linear, verdicts, strict=False)
    rows = [row for answer, verdict in both for row in _linear_rows(answer, verdict.marks)]
    if direct:
        rows += list(_direct_rows(direct, verdicts[-1]))
    room = MOST_LINES - 1
    if len(rows) > room:
        rows = [*rows[: room - 1], f"  ... and {len(rows) - room + 1} more: --full"]
    return [heading, *rows]


def _linear_rows(answer: Answer, marks: Mapping[str, str]) -> Iterator[str]:
    result = answer.result
    half = result.half_width()
    size = reference_values(answer.model, answer.maneuvers, result.estimate)
    converted = converted_marks(answer, marks)
    beside = {c.name: f"{c.name:9s}{c.value:9.4g} +- {c.half_width:.2g}"
              + _if_worse(converted.get(c.name, ""), marks.get(dimensional_name(c.name), ""))
              for c in answer.coefficients}  # fmt: skip
    left = dict(beside)
    for k, p in enumerate(answer.model.parameters):
        if p.name.startswith("imu_"):
            continue
        share = float(half[k]) / max(float(size[k]), 1e-300)
        unit = parameter_unit(answer.model, p.name)
        row, _, signal = p.name.partition("_")
        name = f"{COEFFICIENT_OF.get(row, '')}_{signal}"
        left.pop(name, None)
        yield _row(
            p.name, float(result.estimate[k]), float(half[k]), unit, share,
            marks.get(p.name, ""), beside.get(name, ""),
        )  # fmt: skip
    yield from (f"{'':64s}{text}" for text in left.values())


def _if_worse(mark: str, of_derivative: str) -> str:
    """Return a coefficient's mark where the row's is not its own."""
    return "" if mark == of_derivative else f", {mark}"


def _direct_rows(answer: CoefficientAnswer, verdict: Verdict) -> Iterator[str]:
    for d in answer.fit.derivatives:
        mark = verdict.marks[d.name]
        yield _row(d.name, d.value, d.half_width, "", d.share, mark, "", verdict.fair)


def _row(
    name: str, value: float, half_width: float, unit: str, share: float, mark: str, beside: str,
    fair: float = FAIR,
) -> str:  # fmt: skip
    mark = "small" if mark == SMALL else mark
    percent = share_text(share, fair)
    text = f"  {name:12s}{value:11.5g} +- {half_width:<8.2g} {unit:8s}{percent:>7s}  {mark:15s}"
    return f"{text}{beside}".rstrip()
