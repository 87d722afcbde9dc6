"""Parameters of a report: value, interval, verdict, cause of its width, prior, truth."""

from __future__ import annotations

from collections.abc import Mapping

from host.report.html_table import table
from host.report.html_text import escaped
from host.report.json_numbers import JsonNumbers

_CLASS = {"trust": "good", "use with care": "fair", "do not rely on": "poor"}


def parameter_tables(numbers: JsonNumbers, at: int, label: str, causes: Mapping[str, str]) -> str:
    """Return the tables of one answer.

    Parameters
    ----------
    numbers : JsonNumbers
        Of the whole answer.
    at : int
        Place of this one under ``answers``.
    label : str
        Under which it stands in ``truth``.
    causes : mapping of str to str
        What widens each interval most.
    """
    answer = numbers.document["answers"][at]
    parts = []
    if "parameters" in answer:
        parts.append("<h4>derivatives</h4>" + _derivatives(numbers, at, label))
    if answer.get("coefficients"):
        parts.append("<h4>coefficients</h4>" + _coefficients(numbers, at, label, causes))
    if answer.get("delays_s"):
        rows = [
            [escaped(name), numbers.html("answers", at, "delays_s", name, "value", scale=1e3),
             numbers.html("answers", at, "delays_s", name, "half_width", digits=2, scale=1e3)]
            for name in answer["delays_s"]
        ]  # fmt: skip
        parts.append("<h4>delays</h4>" + table(["sensor", "ms", "95 % \u00b1"], rows))
    return "".join(parts)


def _derivatives(numbers: JsonNumbers, at: int, label: str) -> str:
    answer = numbers.document["answers"][at]
    rows, marks = [], answer["marks"]
    for name, own in answer["parameters"].items():
        place = ("answers", at, "parameters", name)
        mark = marks.get(name, {})
        rows.append([
            escaped(name), numbers.html(*place, "value"),
            numbers.html(*place, "half_width", digits=2), escaped(own["unit"]),
            numbers.html("truth", label, name, "truth"), escaped(own["widened_by"]),
            _mark(mark.get("mark", "")), escaped("; ".join(mark.get("reasons", ()))),
        ])  # fmt: skip
    heads = ["name", "value", "95 % \u00b1", "unit", "truth", "widened most by", "verdict",
             "because"]  # fmt: skip
    judged = [row for row, name in zip(rows, answer["parameters"], strict=True) if name in marks]
    rest = [row for row, name in zip(rows, answer["parameters"], strict=True) if name not in marks]
    more = (
        "<details><summary>constants of each maneuver, places, noise</summary>"
        f"{_without_empty(heads, rest, (0, 3, 5, 6, 7))}</details>"
    )
    return _without_empty(heads, judged, (0, 3, 5, 6, 7)) + (more if rest else "")


def _coefficients(numbers: JsonNumbers, at: int, label: str, causes: Mapping[str, str]) -> str:
    answer = numbers.document["answers"][at]
    prior = _prior_of(numbers, answer)
    rows = []
    for name in answer["coefficients"]:
        place = ("answers", at, "coefficients", name)
        mark = answer["marks"].get(name, {}) if answer["template"] == "coefficients" else {}
        rows.append([
            escaped(name), numbers.html(*place, "value"),
            numbers.html(*place, "half_width", digits=2),
            numbers.html("prior", prior, name, "prior") if prior else "",
            numbers.html("truth", label, name, "truth"),
            escaped(causes.get(name, "")), _mark(mark.get("mark", "")),
            escaped("; ".join(mark.get("reasons", ()))),
        ])  # fmt: skip
    heads = ["name", "value", "95 % \u00b1", "prior", "truth", "widened most by", "verdict",
             "because"]  # fmt: skip
    return _without_empty(heads, rows, (0, 5, 6, 7))


def _prior_of(numbers: JsonNumbers, answer: dict[str, object]) -> str:
    """Return the prior's table that belongs to an answer."""
    known = numbers.document.get("prior") or {}
    wanted = f"{answer['template']}, {answer['method']}"
    return wanted if wanted in known else next(iter(known), "")


def _mark(mark: str) -> str:
    return f'<span class="{_CLASS.get(mark, "")} mark">{escaped(mark)}</span>' if mark else ""


def _without_empty(heads: list[str], rows: list[list[str]], words: tuple[int, ...]) -> str:
    """Return a table without columns that say nothing in any row."""
    kept = [
        k for k in range(len(heads)) if k < 2 or any(row[k] not in ("", "\u2013") for row in rows)
    ]
    shorter = [[row[k] for k in kept] for row in rows]
    return table([heads[k] for k in kept], shorter, [kept.index(k) for k in words if k in kept])


def method_comparison(numbers: JsonNumbers) -> str:
    """Return models that several methods estimated, a column for each method."""
    answers = [a for a in numbers.document["answers"] if "parameters" in a]
    parts = []
    for template in dict.fromkeys(a["template"] for a in answers):
        places = [k for k, a in enumerate(numbers.document["answers"])
                  if a["template"] == template and "parameters" in a]  # fmt: skip
        if len(places) < 2:
            continue
        names = dict.fromkeys(
            name for k in places for name in numbers.document["answers"][k]["parameters"]
        )
        rows = [[escaped(name), *(_pair(numbers, k, name) for k in places)] for name in names]
        heads = ["name", *(numbers.document["answers"][k]["method"] for k in places)]
        parts.append(f"<h4>{escaped(template)}</h4>" + table(heads, rows))
    return "".join(parts)


def _pair(numbers: JsonNumbers, at: int, name: str) -> str:
    place = ("answers", at, "parameters", name)
    if numbers.value(*place) is None:
        return ""
    half = numbers.html(*place, "half_width", digits=2)
    return f"{numbers.html(*place, 'value')} \u00b1 {half}"
