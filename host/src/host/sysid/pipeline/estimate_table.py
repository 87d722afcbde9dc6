"""The numbers of an answer as tables for a notebook: estimates and modes with units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from host.sysid.answer.converted_marks import converted_marks
from host.sysid.answer.mat_file import labels
from host.sysid.answer.mode_lines import coefficient_modes, linear_modes
from host.sysid.answer.parameter_words import in_words
from host.sysid.models.diagnostics import reference_values
from host.sysid.models.parameter_units import parameter_unit

if TYPE_CHECKING:
    import pandas as pd

    from host.sysid.answer.marks import Verdict
    from host.sysid.answer.mode_lines import JudgedMode
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.linear.linear_answer import Answer

COLUMNS = (
    "value", "half_width", "unit", "relative_half_width", "verdict", "widened_by", "called", "kind",
)  # fmt: skip
MODE_COLUMNS = (
    "real_1ps", "imaginary_radps", "frequency_radps", "frequency_half_width_radps",
    "damping", "damping_half_width", "known",
)  # fmt: skip
MODE_HEADINGS = ("rad/s", "95 % +-", "damping", "damping +-", "known")
PLAIN = "1"  # unit of a number
DERIVATIVE, PLACE, DELAY, COEFFICIENT = "derivative", "place", "delay", "coefficient"
NO_CAUSE = ("", 0.0)


def estimate_table(
    linear: Sequence[Answer],
    direct: CoefficientAnswer | None,
    verdicts: Sequence[Verdict],
) -> pd.DataFrame:
    """Return every estimate, a row each: derivatives, delays, coefficients.

    Parameters
    ----------
    linear : sequence of Answer
    direct : CoefficientAnswer or None
    verdicts : sequence of Verdict
        Verdict of each answer, linear ones first.

    Returns
    -------
    pandas.DataFrame
        By model and name. `half_width` is of the two-sided 95 % interval; `relative_half_width` is
        over the value, or over what would contribute 5 % of the largest of its equation; `unit` is
        SI and radian, ``1`` of a pure number; `verdict` is one of
        `host.sysid.answer.marks.MARKS`, empty where nothing is judged; `widened_by` is what widens
        the interval most; `called` is the name in words; `kind` is ``derivative``, ``place`` (of a
        sensor), ``delay`` or ``coefficient``.
    """
    rows: dict[tuple[str, str], tuple[Any, ...]] = {}
    for answer, label, verdict in zip(linear, labels(linear), verdicts, strict=False):
        rows |= {(label, name): row for name, row in _linear_rows(answer, verdict.marks)}
    if direct:
        own = _direct_rows(direct, verdicts[-1].marks)
        rows |= {(direct.template, name): row for name, row in own}
    named = {place: (*row, in_words(place[1]), kind) for place, (kind, *row) in rows.items()}
    return _frame(named, ("model", "name"), COLUMNS)


def mode_table(
    linear: Sequence[Answer], direct: CoefficientAnswer | None, verdicts: Sequence[Verdict]
) -> pd.DataFrame:
    """Return every mode by model and name, with 95 % half-widths; a real mode has damping +-1.

    `known` is ``good``, ``fair`` or ``not``.
    """
    rows: dict[tuple[str, str], tuple[Any, ...]] = {}
    for answer, label in zip(linear, labels(linear), strict=True):
        rows |= {(label, m.mode.name): _mode_row(m) for m in linear_modes(answer)}
    if direct:
        own_modes = coefficient_modes(direct, verdicts[-1])
        rows |= {(direct.template, m.mode.name): _mode_row(m) for m in own_modes}
    return _frame(rows, ("model", "mode"), MODE_COLUMNS)


def shown_tables(table: pd.DataFrame, modes: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Return what fits beneath a notebook's cell, by heading: each kind of estimate, and modes."""
    found = {}
    for kind in dict.fromkeys(table["kind"]):
        own = table[table["kind"] == kind].copy()
        own.insert(0, "in words", own["called"])
        own["95 % +-"] = own["half_width"]
        own["%"] = 100.0 * own["relative_half_width"]
        wanted = ["in words", "value", "95 % +-", "unit", "%", "verdict", "widened_by"]
        bare = [name for name in wanted if name == "value" or (own[name] != "").any()]
        found[f"{kind}s"] = own[[name for name in bare if name != "unit" or kind != COEFFICIENT]]
    own_modes = modes[list(MODE_COLUMNS[2:])]
    return found | {"modes": own_modes.set_axis(MODE_HEADINGS, axis=1)}


def _linear_rows(answer: Answer, marks: Mapping[str, str]) -> Iterator[tuple[str, tuple[Any, ...]]]:
    result = answer.result
    half = result.half_width()
    size = reference_values(answer.model, answer.maneuvers, result.estimate)
    for k, p in enumerate(answer.model.parameters):
        share = float(half[k]) / max(float(size[k]), 1e-300)
        unit = parameter_unit(answer.model, p.name)
        value = float(result.estimate[k])
        cause = answer.causes.get(p.name, "")
        mark = marks.get(p.name, "")
        kind = PLACE if unit == "m" else DERIVATIVE
        yield p.name, (kind, value, float(half[k]), unit, share, mark, cause)
    for name, (value, width) in answer.delays.items():
        yield name, (DELAY, value, width, "s", _share(value, width), "", "")
    for d in (x for x in answer.model.delays if x.name in result.names):
        k = result.index(d.name)
        value, width = float(result.estimate[k]), float(half[k])
        yield d.name, (DELAY, value, width, "s", _share(value, width), "", "")
    converted = converted_marks(answer, marks)
    for c in answer.coefficients:
        share, mark = _share(c.value, c.half_width), converted.get(c.name, "")
        yield c.name, (COEFFICIENT, c.value, c.half_width, PLAIN, share, mark, c.widened_by)


def _direct_rows(
    answer: CoefficientAnswer, marks: Mapping[str, str]
) -> Iterator[tuple[str, tuple[Any, ...]]]:
    for d in answer.fit.derivatives:
        cause = answer.causes.get(d.name, NO_CAUSE)[0]
        row = (COEFFICIENT, d.value, d.half_width, PLAIN, d.share, marks[d.name], cause)
        yield d.name, row
    for name, (value, width) in answer.delays.items():
        yield name, (DELAY, value, width, "s", _share(value, width), "", "")


def _share(value: float, half_width: float) -> float:
    return half_width / max(abs(value), 1e-300)


def _mode_row(judged: JudgedMode) -> tuple[Any, ...]:
    mode = judged.mode
    return (
        mode.eigenvalue.real,
        mode.eigenvalue.imag,
        mode.frequency_radps,
        mode.frequency_half_width_radps,
        mode.damping,
        mode.damping_half_width,
        judged.word,
    )


def _frame(
    rows: dict[tuple[str, str], tuple[Any, ...]], index: Sequence[str], columns: Sequence[str]
) -> pd.DataFrame:
    import pandas as pd

    places = pd.MultiIndex.from_tuples(list(rows), names=list(index))
    return pd.DataFrame(list(rows.values()), index=places, columns=list(columns))
