"""What widens an interval most: of a variance put together by hand, the largest part is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from host.sysid.aerodynamics import ShiftedEstimate
from host.sysid.errors import add_systematic_covariance
from host.sysid.errors.widest_errors import NOISE, OUTSIDE_MODEL, widest_errors
from host.sysid.models import FitResult, free_model


def _result(variance: list[float]) -> FitResult:
    names = ("a", "b", "c", "d", "e")
    nothing = np.zeros((5, 5))
    return FitResult(
        method="output-error", model=free_model("m", ("x",), ("u",)), names=names,
        estimate=np.arange(5.0), covariance=np.diag(variance), covariance_white=nothing,
        degrees_of_freedom=np.full(5, np.inf), residuals=(), fitted=(), residual_kind="output",
        noise_covariance=nothing, iterations=1, converged=True,
    )  # fmt: skip


def test_the_largest_part_is_named() -> None:
    """a: noise; b: repeats; c: one sensor; d: two errors of one name; e: many small, none named."""
    fit = _result([1.0, 1.0, 1.0, 1.0, 0.2])
    statistical = replace(fit, covariance=np.diag([1.2, 9.0, 1.5, 1.0, 0.2]))
    size = np.array([
        [0.1, 0.1, 4.0, 0.1, 0.5], [0.1, 0.1, 0.1, 1.5, 0.5], [0.1, 0.1, 0.1, 1.5, 0.5],
        [0.1, 0.1, 0.1, 1.9, 0.5], [0.0, 0.0, 0.0, 0.0, 0.5],
    ])  # fmt: skip
    errors = ("pitot_scale", "servo_delay_s", "servo_delay_s", "imu_delay_s", "alpha_scale")
    shifts = tuple(
        ShiftedEstimate(error, statistical.estimate + row, 1.0, 1.0)
        for error, row in zip(errors, size, strict=True)
    )
    total = add_systematic_covariance(statistical, shifts)
    assert widest_errors(fit, statistical, total, shifts) == {
        "a": NOISE, "b": OUTSIDE_MODEL, "c": "scale of the pitot", "d": "delay of the servos",
        "e": "delay of the servos",
    }  # fmt: skip
    many = tuple(ShiftedEstimate(f"e{k}", statistical.estimate + 0.5, 1.0, 1.0) for k in range(20))
    total = add_systematic_covariance(statistical, many)
    assert "a" not in widest_errors(fit, statistical, total, many)
