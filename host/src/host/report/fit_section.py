"""Modes and figures of fit of a report."""

from __future__ import annotations

from host.people_units import people_name
from host.report.html_table import table
from host.report.html_text import escaped
from host.report.json_numbers import JsonNumbers

_KINDS = {"fitted": "free, fitted", "held_out": "free, unseen", "one_step": "one step, fitted"}


def mode_table(numbers: JsonNumbers, label_of: list[str], title_of: list[str]) -> str:
    """Return the modes of every answer with their intervals, truth where the flight was simulated.

    Parameters
    ----------
    numbers : JsonNumbers
    label_of, title_of : list of str
        What each answer is called under ``truth``, and for people.
    """
    rows = []
    for at, answer in enumerate(numbers.document["answers"]):
        for k, mode in enumerate(answer["modes"]):
            place = ("answers", at, "modes", k)
            real = abs(mode["eigenvalue"][1] or 0.0) == 0.0
            rows.append([
                escaped(title_of[at]), escaped(mode["name"]),
                numbers.html(*place, "eigenvalue", 0) if real
                else numbers.html(*place, "frequency_radps"),
                numbers.html(*place, "frequency_half_width_radps", digits=2),
                escaped("1/s" if real else "rad/s"),
                "" if real else numbers.html(*place, "damping", digits=3),
                "" if real else numbers.html(*place, "damping_half_width", digits=2),
                escaped(f"{mode['known']}: {mode['reason']}" if mode["reason"] else mode["known"]),
                _truth(numbers, label_of[at], mode["name"]),
            ])  # fmt: skip
    heads = ["model", "mode", "frequency or root", "95 % \u00b1", "unit", "damping", "95 % \u00b1",
             "known", "truth"]  # fmt: skip
    if all(row[-1] == "" for row in rows):
        heads, rows = heads[:-1], [row[:-1] for row in rows]
    return table(heads, rows, (0, 1, 4, 7))


def _truth(numbers: JsonNumbers, label: str, mode: str) -> str:
    known = numbers.value("truth", label) or {}
    return ", ".join(
        f"{escaped(name.removeprefix(mode).strip(', '))}"
        f" {numbers.html('truth', label, name, 'truth')}".strip()
        for name in known
        if name.startswith(mode)
    )


def fit_table(numbers: JsonNumbers, at: int) -> str:
    """Return NRMSE and Theil's inequality of every output, each kind of prediction named."""
    answer = numbers.document["answers"][at]
    rows = []
    for kind, signals in answer["fit"].items():
        for name, own in signals.items():
            place = ("answers", at, "fit", kind, name)
            theil = numbers.html(*place, "theil", digits=2) if "theil" in own else ""
            rows.append([
                escaped(_KINDS.get(kind, kind)), escaped(people_name(name)[0]),
                f"{numbers.html(*place, 'nrmse', digits=3, scale=100.0)} %", theil,
            ])  # fmt: skip
    one_step_nrmse = (answer.get("unseen") or {}).get("nrmse", {})
    for name in one_step_nrmse:
        number = numbers.html("answers", at, "unseen", "nrmse", name, "unseen", digits=3, scale=1e2)
        rows.append(["one step, unseen", escaped(people_name(name)[0]), f"{number} %", ""])
    return table(["prediction", "output", "NRMSE", "Theil's U"], rows, (0, 1))
