"""What of an answer is frozen, taken from its JSON document, and how many intervals hold."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import host
from tests.answers.stored_input import HERE

Record = dict[str, Any]
DECIMALS = 12  # of a correlation
# Keys of a linear model and of coefficients: words, and lists of words.
WORDS = (
    "template", "model", "method", "converged", "residual_kind", "at_bound", "unpredicted",
    "constant_inputs", "maneuvers", "held_out",
)  # fmt: skip


def record_of(answer: host.Identification, folder: Path, truth: Path | None = None) -> Record:
    """Return what is frozen of an answer.

    Parameters
    ----------
    answer : Identification
    folder : Path
        Where inputs were unpacked; its name is taken out of all texts.
    truth : Path, optional
        JSON file of true values.
    """
    document = json.loads(answer.to_json())
    answers = [_of_answer(one) for one in document["answers"]]
    for one, correlation in zip(answers, _correlations(answer), strict=True):
        one["correlation"] = correlation
    found = {
        "findings": document["findings"],
        "notes": document["notes"],
        "answers": answers,
        "marks": _marks_of_table(answer),
    }
    if truth is not None:
        found["off"] = _off(answers, json.loads(truth.read_text(encoding="utf-8")))
    record: Record = _without(found, folder)
    return record


def refusal(error: Exception, folder: Path) -> Record:
    """Return what is frozen of a refusal."""
    record: Record = _without({"refused": str(error).split("; ")}, folder)
    return record


def _of_answer(document: Mapping[str, Any]) -> Record:
    """Return estimates with half-widths, marks, texts and figures of one fitted model."""
    estimates = {
        name: [item["value"], item["half_width"]]
        for key in ("parameters", "coefficients")
        for name, item in document.get(key, {}).items()
    }
    estimates |= {
        f"{name}, delay": [item["value"], item["half_width"]]
        for name, item in document["delays_s"].items()
    }
    estimates |= {
        f"{name}, error": [item["value"], item["standard_deviation"]]
        for name, item in document.get("instrument_errors", {}).items()
    }
    estimates |= {
        f"{name}, correction": [item["value"], item["half_width"]]
        for name, item in document.get("corrections", {}).items()
    }
    causes = {
        name: item["widened_by"]
        for key in ("parameters", "coefficients")
        for name, item in document.get(key, {}).items()
        if item.get("widened_by")
    }
    modes = {
        mode["name"]: [
            [mode["frequency_radps"], mode["frequency_half_width_radps"]],
            [mode["damping"], mode["damping_half_width"]],
        ]
        for mode in document["modes"]
    }
    return {
        **{key: document[key] for key in WORDS if key in document},
        "figures": _figures(document),
        "estimates": estimates,
        "modes": modes,
        "marks": {name: item["mark"] for name, item in document["marks"].items()},
        "reasons": {n: item["reasons"] for n, item in document["marks"].items()},
        "causes": causes,
        "refused": [item["name"] for item in document.get("refused", ())],
        "verdict": document["verdict"],
        "warnings": document.get("warnings", []),
    }


def _figures(document: Mapping[str, Any]) -> dict[str, float]:
    """Return the flight condition, and how well each output is fitted and predicted."""
    found = {name: document[name] for name in ("airspeed_mps", "qbar_pa", "alpha_rad")}
    for kind in ("fitted", "held_out"):
        for name, fit in document["fit"].get(kind, {}).items():
            found[f"{kind} {name}"] = fit["nrmse"]
    for name, fit in document["fit"].get("one_step", {}).items():
        found[f"one step {name}"] = fit["nrmse"]
    return found


def _marks_of_table(answer: host.Identification) -> dict[str, str]:
    """Return the mark of every row of the table: coefficients of linear models have theirs here."""
    table = answer.table
    names = ["/".join(str(level) for level in row) for row in table.index]
    marks = zip(names, (str(mark) for mark in table["verdict"]), strict=True)
    return {name: mark for name, mark in marks if mark}


def _correlations(answer: host.Identification) -> list[list[list[float]]]:
    """Return of each answer the correlations below the diagonal; no document has them.

    The only place that knows where an answer keeps its covariance.
    """
    covariances = [one.result.covariance for one in answer.linear]
    if answer.coefficients is not None:
        covariances.append(answer.coefficients.fit.covariance)
    return [_lower(np.asarray(covariance)) for covariance in covariances]


def _lower(covariance: NDArray[np.float64]) -> list[list[float]]:
    sd = np.sqrt(np.diag(covariance))
    sd = np.where(sd > 0.0, sd, 1.0)
    rows = np.round(covariance / np.outer(sd, sd), DECIMALS) + 0.0
    return [row[:k].tolist() for k, row in enumerate(rows)]


def _off(answers: Sequence[Record], truth: Mapping[str, Any]) -> dict[str, float]:
    """Return how far each estimate is from the truth in half-widths: below 1 its interval holds."""
    found = {}
    for one in answers:
        speed = (one["figures"]["airspeed_mps"] or truth["airspeed_mps"]) / truth["airspeed_mps"]
        for name, (value, power) in truth["values"].get(one["template"], {}).items():
            if name in one["estimates"]:
                estimate, half_width = one["estimates"][name]
                off = abs(estimate - value * speed**power) / half_width
                found[f"{one['template']}, {one['method']}, {name}"] = round(off, 4)
    return found


def _without(value: Any, folder: Path) -> Any:
    """Return a record whose texts name files, not where they lay."""
    if isinstance(value, dict):
        return {key: _without(item, folder) for key, item in value.items()}
    if isinstance(value, list):
        return [_without(item, folder) for item in value]
    if isinstance(value, str):
        for place in (folder, HERE / "inputs", HERE / ".." / "data"):
            value = value.replace(f"{place}/", "")
    return value
