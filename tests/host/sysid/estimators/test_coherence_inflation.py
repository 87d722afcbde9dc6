"""Intervals that hold what inputs drive: those of derivatives, not of the gust."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
from host.sysid.estimators.coherence_inflation import COUNTED, inflate_by_coherence
from host.sysid.estimators.gust_penetration import PREFIX, with_gust_penetration
from host.sysid.models.fit_result import FitResult
from host.sysid.models.templates import Trim, template
from host.sysid.numerics.input_coherence import InputCoherence


def test_the_parameters_of_the_gust_are_left_out() -> None:
    """Four times the power widens derivatives twice; what gusts do keeps its interval."""
    plain = template("short-period", Trim(17.0))
    model, start = with_gust_penetration(plain, 17.0, np.ones(len(plain.parameters)))
    count = len(model.parameters)
    result = FitResult(
        "filter error with gust", model, model.parameter_names, start, np.eye(count),
        np.eye(count), np.full(count, np.inf), (), (), "innovation", np.eye(3), 1, converged=True,
    )  # fmt: skip
    found = SimpleNamespace(
        suspected=("q_radps",), coherent=("q_radps",), likely_error="", outputs=("q_radps",),
        columns=np.array([8.0]), shift=np.full(count, 0.5), covariance=lambda: np.eye(count),
        widened_covariance=lambda: 4.0 * np.eye(count),
    )  # fmt: skip
    wide = inflate_by_coherence(result, cast("InputCoherence", found))
    factor = np.asarray(wide.details[COUNTED])
    gust = np.array([name.startswith(PREFIX) for name in model.parameter_names])
    assert gust.any()
    assert np.all(factor[gust] == 1.0)
    assert np.allclose(np.diag(wide.covariance)[gust], 1.0)
    assert np.allclose(factor[~gust], np.sqrt(4.25))
    assert np.all(np.isinf(wide.degrees_of_freedom[gust]))
    assert PREFIX not in " ".join(wide.warnings).replace("filter error with gust", "")
