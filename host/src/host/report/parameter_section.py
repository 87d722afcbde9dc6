"""Parameters of a report: value, interval, verdict, cause of its width, prior, truth."""

from __future__ import annotations

from collections.abc import Mapping

from host.report.html_table import table
from host.report.html_text import escaped
from host.report.json_numbers import JsonNumbers

CLASSES = {
    "trust": "good", "use with care": "fair", "do not rely on": "poor", "do not use": "poor",
}  # fmt: skip
# Shown where no single cause makes a quarter of the variance.
_SEVERAL, _DERIVATIVE = "several, none a quarter", "as its derivative"


def parameter_tables(numbers: JsonNumbers, at: int, label: str, causes: Mapping[str, str]) -> str:
    """Return the tables of one answer.

    Parameters
    ----------
    numbers : JsonNumbers
        Numbers of the whole answer.
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
            numbers.html("truth", label, name, "truth"), escaped(own["widened_by"] or _SEVERAL),
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
    usual_cause = _SEVERAL if answer["template"] == "coefficients" else _DERIVATIVE
    rows = []
    for name in answer["coefficients"]:
        place = ("answers", at, "coefficients", name)
        direct = answer["template"] == "coefficients"
        mark = answer["marks"].get(name, {}) if direct else answer["coefficients"][name]
        rows.append([
            escaped(name), numbers.html(*place, "value"),
            numbers.html(*place, "half_width", digits=2),
            numbers.html("prior", prior, name, "prior") if prior else "",
            numbers.html("truth", label, name, "truth"),
            escaped(causes.get(name) or usual_cause), _mark(mark.get("mark", "")),
            escaped("; ".join(mark.get("reasons", ()))),
        ])  # fmt: skip
    heads = ["name", "value", "95 % \u00b1", "prior", "truth", "widened most by", "verdict",
             "because"]  # fmt: skip
    return _without_empty(heads, rows, (0, 5, 6, 7))


def _prior_of(numbers: JsonNumbers, answer: dict[str, object]) -> str:
    """Return the prior comparison of an answer's model, whatever the method.

    Where coefficients were fitted directly there is theirs alone.
    """
    known = numbers.document.get("prior") or {}
    same = (name for name in known if name.startswith(f"{answer['template']}, "))
    return next(same, next(iter(known), ""))


def _mark(mark: str) -> str:
    return f'<span class="{CLASSES.get(mark, "")} mark">{escaped(mark)}</span>' if mark else ""


def _without_empty(heads: list[str], rows: list[list[str]], words: tuple[int, ...]) -> str:
    """Return a table without columns that are empty in every row."""
    kept = [
        k for k in range(len(heads)) if k < 2 or any(row[k] not in ("", "\u2013") for row in rows)
    ]
    shorter = [[row[k] for k in kept] for row in rows]
    return table([heads[k] for k in kept], shorter, [kept.index(k) for k in words if k in kept])


def method_comparison(*documents: JsonNumbers) -> str:
    """Return derivatives that several methods estimated, a column for each method."""
    answers = [
        (numbers, at, answer)
        for numbers in documents
        for at, answer in enumerate(numbers.document["answers"])
        if "parameters" in answer
    ]
    parts = []
    for template in dict.fromkeys(answer["template"] for _, _, answer in answers):
        by: dict[str, tuple[JsonNumbers, int]] = {}
        names: dict[str, None] = {}
        for numbers, at, answer in answers:
            if answer["template"] == template:
                by.setdefault(answer["method"], (numbers, at))
                names |= dict.fromkeys(answer["marks"])
        if len(by) < 2:
            continue
        rows = [[escaped(name), *(_pair(*place, name) for place in by.values())] for name in names]
        heads = ["name", *by]
        parts.append(f"<h4>{escaped(template)}</h4>" + table(heads, rows))
    return "".join(parts)


def _pair(numbers: JsonNumbers, at: int, name: str) -> str:
    place = ("answers", at, "parameters", name)
    if numbers.value(*place) is None:
        return ""
    half = numbers.html(*place, "half_width", digits=2)
    return f"{numbers.html(*place, 'value')} \u00b1 {half}"
