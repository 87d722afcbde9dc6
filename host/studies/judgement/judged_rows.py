"""A row of every parameter of a model in every flight, those without an estimate too."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from host.errors import IdentificationError
from host.sysid.pipeline import Identification

from studies.stored_rows import Row

COLUMNS = (
    "world", "seed", "name", "true", "reference", "estimate", "half_width", "mark", "cpu_s",
)  # fmt: skip
LATERAL = ("beta", "p", "r", "da", "dr")
DERIVATIVES = (
    "D_V", "Z_V", "M_V", "D_alpha", "Z_alpha", "M_alpha", "Z_q", "M_q", "D_de", "Z_de", "M_de",
    *(f"{row}_{label}" for row in "YLN" for label in LATERAL),
)  # fmt: skip
COEFFICIENTS = (
    *(f"{row}_{label}" for row in ("CL", "Cm") for label in ("alpha", "q", "de")),
    "CD_alpha", "CD_de",
    *(f"{row}_{label}" for row in ("CY", "Cl", "Cn") for label in LATERAL),
)  # fmt: skip
PRINCIPAL = {
    "Z_alpha", "M_alpha", "M_q", "M_de", "L_p", "L_da", "N_beta", "N_r", "N_dr",
    "CL_alpha", "Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da", "Cn_beta", "Cn_r", "Cn_dr",
}  # fmt: skip
MISSING = "missing"
MODE = "mode"  # in place of a mark: modes are kept apart, and not judged
Truth = dict[str, Any]
Estimates = dict[str, dict[str, object]]


@dataclass(frozen=True, slots=True)
class Flown:
    """One flight that can be identified.

    Attributes
    ----------
    truth : dict
        As `host simulate` writes it: maneuvers with times, coefficients, dimensional derivatives.
    identify : callable
        Gives the answer, compared with the truth.
    """

    truth: Truth
    identify: Callable[[], Identification]


def judged_rows(world: str, seed: int, flown: Flown, names: tuple[str, ...]) -> Iterator[Row]:
    """Identify a flight; return a row of each name.

    Without an estimate there is only the truth, under the mark "missing".
    """
    start = time.process_time()
    try:
        answer: Identification | None = flown.identify()
    except IdentificationError:
        answer = None
    found, modes = _estimates(answer) if answer is not None else ({}, {})
    cpu_s = time.process_time() - start
    for name in names:
        row = {"world": world, "seed": seed, "name": name, "cpu_s": round(cpu_s, 2)}
        if name in found:
            yield row | found[name]
        else:
            true = _mean_truth(flown.truth, name)
            yield row | {"true": true, "reference": abs(true), "mark": MISSING}
    for name, own in modes.items():
        yield {"world": world, "seed": seed, "name": name, "cpu_s": round(cpu_s, 2)} | own


def _estimates(answer: Identification) -> tuple[Estimates, Estimates]:
    """Return the estimate of each parameter that the truth has, and of each mode."""
    marks = answer.table["verdict"].to_dict()
    found: Estimates = {}
    modes: Estimates = {}
    for model, compared in answer.document()["truth"].items():
        for name, own in compared.items():
            mark = marks.get((model, name), MODE)
            (modes if mark == MODE else found)[name] = {
                "true": own["truth"],
                "reference": own["reference"],
                "estimate": own["value"],
                "half_width": own["half_width"],
                "mark": mark,
            }
    return found, modes


def _mean_truth(truth: Truth, name: str) -> float:
    """Return a true value, the mean over the maneuvers that drive it."""
    lateral = name.partition("_")[2] in LATERAL
    mine = [
        m
        for m in truth["maneuver"]
        if lateral == bool({"aileron", "rudder"} & set(m["axes"]))
        and (lateral or "elevator" in m["axes"])
    ]
    values = [{**m["derivatives"], **m["dimensional"]}[name] for m in mine]
    return float(sum(values) / len(values))
