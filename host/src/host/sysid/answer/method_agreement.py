"""Do methods agree on a parameter, beyond what noise allows two fits to the same data?

Both fits see the same noise, so the covariance of their difference is not the sum of theirs. With
one of them efficient it is the difference of their covariances (Hausman, Econometrica 46, 1978).
Systematic errors move both alike and are left out. `LEAST_SHARE` of the narrower variance is added:
neither method is exactly efficient.

A method counts only where it is valid for the noise that was found: regressions are biased by noise
in their regressors, filter error takes coloured sensor noise for moving air.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy import special

from host.sysid.estimators.method_registry import find_method

if TYPE_CHECKING:
    from host.sysid.linear.linear_answer import Answer

SIGNIFICANCE = 0.01
LEAST_SHARE = 0.1
# What methods of `fit` are valid in, each says itself; that of the pipeline's own:
VALID = {"filter-error-gust": ("white", "gust")}


def noise_found(answers: Sequence[Answer]) -> str:
    """Return the noise that the fits of one model found: white, coloured or gust.

    Filter error says by BIC whether noise with a memory explains the data better than moving air;
    without it coloured residuals of output error decide, and a gust filter that was used.
    """
    over = [
        float(d)
        for a in answers
        if isinstance(d := a.result.details.get("bic_over_coloured_noise"), float)
    ]
    orders = [np.any(np.asarray(a.result.details.get("noise_orders", 0.0)) > 0.0) for a in answers]
    if any(a.result.method == "filter error with gust" for a in answers) or (
        over and max(over) < 0.0 and any(orders)
    ):
        return "gust"
    return "coloured" if any(orders) or (over and max(over) > 0.0) else "white"


def disagreements(answer: Answer, beside: Sequence[Answer]) -> dict[str, str]:
    """Return parameters on which another method says something else, and what.

    Parameters
    ----------
    answer : Answer
    beside : sequence of Answer
        Of any models and methods; those of the same model count.
    """
    found: dict[str, str] = {}
    for other in _judges(answer, beside):
        for name in answer.model.parameter_names:
            if name not in found and name in other.result.names and _differ(answer, other, name):
                value, theirs = answer.result.value(name), other.result.value(name)
                found[name] = f"{other.method} says {theirs:.3g}, this method {value:.3g}"
    return found


def _judges(answer: Answer, beside: Sequence[Answer]) -> list[Answer]:
    """Return the answers by other methods to the same model that are valid in the noise found."""
    same = [a for a in beside if a.template == answer.template and a.result.converged]
    same = [a for a in same if a.model.name == answer.model.name]
    noise = noise_found([*same, answer])
    others = [a for a in same if a is not answer and a.method != answer.method]
    return [a for a in others if noise in _valid_in(_kind(a))]


def _kind(answer: Answer) -> str:
    """Return the method that an answer was made by, where the default names none."""
    return {
        "filter error with gust": "filter-error-gust",
        "output error (white)": "output-error-white",
        "output error": "output-error",
    }.get(answer.result.method, answer.method)


def _valid_in(method: str) -> tuple[str, ...]:
    by = None if method in VALID else find_method(method)
    return by.valid_in if by else VALID.get(method, ())


def _differ(one: Answer, other: Answer, name: str) -> bool:
    a, b = (x.result.index(name) for x in (one, other))
    variances = [
        float((x.result.covariance if x.noise_covariance is None else x.noise_covariance)[k, k])
        for x, k in ((one, a), (other, b))
    ]
    if min(variances) == 0.0:
        return False  # on a bound: told elsewhere
    variance = abs(variances[0] - variances[1]) + LEAST_SHARE * min(variances)
    freedom = min(
        float(one.result.degrees_of_freedom[a]), float(other.result.degrees_of_freedom[b]), 1e9
    )
    limit = float(special.stdtrit(freedom, 1.0 - 0.5 * SIGNIFICANCE)) * np.sqrt(variance)
    return bool(abs(one.result.estimate[a] - other.result.estimate[b]) > limit)
