"""Several flights as one fit: noise averages out, an error that all share does not."""

from dataclasses import replace

import numpy as np
import pytest
from host.arrays import Array
from host.sysid.coefficients import CoefficientFit
from host.sysid.coefficients.coefficient_fit import (
    CoefficientHistory,
    Derivative,
    MeanCondition,
    ThrustEffect,
)
from host.sysid.coefficients.deletion_diagnostics import CrossValidation
from host.sysid.coefficients.pooled_flights import pool_fits
from host.sysid.numerics.maneuver_agreement import scatter_test

NOISE = np.array([0.04, 0.02])
SHARED = np.array([[0.0, 0.0], [0.06, 0.0]])  # derivatives by one deviation of each error
ERRORS = np.array([0.5, 0.2])


def fit(values: Array, noise: Array = NOISE, errors: Array = ERRORS) -> CoefficientFit:
    through = np.vstack([SHARED, np.diag(errors)])
    covariance = np.diag([*noise**2, 0.0, 0.0]) + through @ through.T
    sd = np.sqrt(np.diag(covariance))
    names = ("CL_alpha", "Cm_q")
    return CoefficientFit(
        derivatives=tuple(
            Derivative(n, float(v), 1.96 * float(s), abs(float(v)))
            for n, v, s in zip(names, values, sd, strict=False)
        ),
        covariance=covariance,
        errors={"cg_x_m": (0.1, float(errors[0])), "imu_tilt_y_rad": (0.0, float(errors[1]))},
        condition=MeanCondition(
            17.0, 180.0, 0.1, 0.3, 0.03, ThrustEffect(2.0, 0.1, 0.0), (0.0, 0.2), (1.0, 1.0)
        ),
        histories={"CL": CoefficientHistory(np.arange(9.0), np.arange(9.0))},
        prediction=CrossValidation((0, 1), {"CL": 0.03}, {"CL": 0.04}),
        maneuver_agreement=scatter_test(names, np.zeros((2, 2)), np.full((2, 2), 0.5), np.ones(2)),
    )


def test_one_flight_stays_as_it_is() -> None:
    alone = fit(np.array([4.0, -11.0]))
    assert pool_fits([alone]) is alone


def test_noise_averages_out_and_a_shared_error_does_not() -> None:
    found = pool_fits([fit(np.array([4.0, -11.0])) for _ in range(4)])
    lift, pitch = found.derivatives
    assert (lift.value, pitch.value) == (4.0, -11.0)
    assert lift.half_width == pytest.approx(1.96 * 0.04 / 2.0)
    assert pitch.half_width == pytest.approx(1.96 * np.hypot(0.02 / 2.0, 0.06))
    assert found.errors["cg_x_m"] == pytest.approx((0.1, 0.5))
    assert found.covariance[1, 2] == pytest.approx(0.06 * 0.5)
    assert found.prediction is not None
    assert len(found.prediction.windows) == 8
    assert len(found.histories["CL"].model) == 36


def test_the_sharper_flight_counts_more() -> None:
    sharp, blunt = fit(np.array([4.0, -11.0]), 0.5 * NOISE), fit(np.array([4.05, -11.0]))
    found = pool_fits([sharp, blunt]).derivatives[0]
    assert found.value == pytest.approx(4.0 * 0.8 + 4.05 * 0.2)


def test_an_error_that_one_flight_has_is_certain_in_the_other() -> None:
    """A flight with GPS and pots beside one without: the clock is no error of the first."""
    first = fit(np.array([4.0, -11.0]))
    own = {"clock_share": first.errors["cg_x_m"], "imu_tilt_y_rad": first.errors["imu_tilt_y_rad"]}
    alone = replace(first, errors=own)
    found = pool_fits([first, alone])
    assert tuple(found.errors) == ("cg_x_m", "imu_tilt_y_rad", "clock_share")
    for name in ("cg_x_m", "clock_share"):
        assert found.errors[name] == pytest.approx((0.1, 0.5))
    # Either moves half of the answer by its 0.06, and they are two errors, not one.
    expected = np.hypot(0.02, 0.06) / np.sqrt(2.0)
    assert found.derivatives[1].half_width == pytest.approx(1.96 * expected)


def test_flights_that_do_not_agree_widen_the_interval() -> None:
    values = [np.array([4.0 + shift, -11.0]) for shift in (-0.3, -0.1, 0.1, 0.3)]
    wide, fair = (pool_fits([fit(v) for v in own]) for own in (values, values[:1] * 4))
    assert wide.maneuver_agreement.factor[0] > 3.0
    assert wide.maneuver_agreement.factor[1] == 1.0
    assert wide.derivatives[0].half_width > 3.0 * fair.derivatives[0].half_width
    assert wide.derivatives[1].half_width == pytest.approx(fair.derivatives[1].half_width)


def test_intervals_of_pooled_flights_cover() -> None:
    """Instruments drawn new for each case, noise new for each flight."""
    rng = np.random.default_rng(7)
    truth, inside = np.array([4.0, -11.0]), np.zeros(2)
    for _ in range(400):
        z = rng.standard_normal(2)
        fits = [fit(truth + SHARED @ z + NOISE * rng.standard_normal(2)) for _ in range(3)]
        found = pool_fits(fits)
        pooled = found.derivatives
        inside += [abs(pooled[k].value - truth[k]) <= pooled[k].half_width for k in range(2)]
    assert (inside / 400.0 > 0.92).all()
    assert (inside / 400.0 < 0.99).all()


def test_a_flight_without_prediction_does_not_hide_the_others() -> None:
    blind = replace(fit(np.array([4.0, -11.0])), prediction=None)
    seen = fit(np.array([4.0, -11.0]))
    found = pool_fits([blind, seen]).prediction
    assert found is not None
    assert found.left_out == {"CL": pytest.approx(0.04)}
    assert pool_fits([blind, blind]).prediction is None
