"""Intervals that hold what inputs drive: those of derivatives, not of the gust."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from host.sysid.estimators.coherence_inflation import driven_by_inputs
from host.sysid.estimators.gust_penetration import PREFIX, with_gust_penetration
from host.sysid.models import FitResult, Trim, template
from host.sysid.numerics.input_coherence import InputCoherence


def _fitted(kind: str) -> FitResult:
    """Return unit deviations of a short period with the parameters of a gust."""
    plain = template("short-period", Trim(17.0))
    model, start = with_gust_penetration(plain, 17.0, np.ones(len(plain.parameters)))
    count = len(model.parameters)
    return FitResult(
        "filter error with gust", model, model.parameter_names, start, np.eye(count),
        np.eye(count), np.full(count, np.inf), (), (), kind, np.eye(3), 1, converged=True,
    )  # fmt: skip


def _coherent(count: int, variance: float, power: float, shift: float) -> InputCoherence:
    found = SimpleNamespace(
        suspected=("q_radps",), coherent=("q_radps",), likely_error="", outputs=("q_radps",),
        columns=np.array([8.0]), shift=np.full(count, shift),
        covariance=lambda: variance * np.eye(count),
        widened_covariance=lambda: power * variance * np.eye(count),
    )  # fmt: skip
    return cast("InputCoherence", found)


def test_the_parameters_of_the_gust_are_left_out() -> None:
    """Four times the power widens derivatives twice; what gusts do keeps its interval."""
    result = _fitted("innovation")
    model = result.model
    found = _coherent(len(model.parameters), 1.0, 4.0, 0.5)
    noise = result.uncertainty
    wide = noise.with_model_error([driven_by_inputs(result, noise, found)])
    factor = np.sqrt(wide.variance)
    gust = np.array([name.startswith(PREFIX) for name in model.parameter_names])
    assert gust.any()
    assert np.all(factor[gust] == 1.0)
    assert np.allclose(factor[~gust], np.sqrt(4.25))
    assert np.all(np.isinf(wide.degrees_of_freedom[gust]))
    assert PREFIX not in " ".join(wide.warnings).replace("filter error with gust", "")


@pytest.mark.parametrize(("kind", "expected"), [("output", 401.0), ("innovation", 4.01)])
def test_the_bias_of_a_free_simulation_counts_in_its_own_deviations(
    kind: str, expected: float
) -> None:
    """One that knows ten times less is biased by as much more: N_r was widened 38 times for 1 %."""
    result = _fitted(kind)
    found = _coherent(len(result.model.parameters), 100.0, 4.0, 1.0)
    noise = result.uncertainty
    wide = noise.with_model_error([driven_by_inputs(result, noise, found)])
    k = result.index("M_alpha")
    assert wide.covariance[k, k] == pytest.approx(expected)
