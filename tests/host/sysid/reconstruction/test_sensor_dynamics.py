"""Sensors as they are: undone before the linear fits where known, carried where they stay open."""

from dataclasses import replace

import numpy as np
import pytest
from host.instrument.deviations import sensor_error_model
from host.instrument.error_list import error_kinds
from host.physical.recording import AUTOPILOT, FOREIGN, Recording
from host.sysid import Maneuver
from host.sysid.estimators.filter_error_gust import fit_with_gust
from host.sysid.estimators.gust_model import gust_model
from host.sysid.estimators.gust_penetration import with_gust_penetration
from host.sysid.models import FitResult, LinearModel, Trim, template
from host.sysid.reconstruction import INSTANTANEOUS_ERRORS, Compatibility, SensorErrorEstimate
from host.sysid.reconstruction.path_preparation import compensate_lowpass
from host.sysid.reconstruction.sensor_dynamics import (
    IMU_DELAY,
    perturb_columns,
    residual_errors,
)

NAME = "ultrastick25e"
Columns = dict[str, np.ndarray]
SPEED_MPS = 20.0


def delayed(delay_s: float) -> Compatibility:
    """Return a reconstruction that told the vanes' delay to half a millisecond."""
    late = SensorErrorEstimate("vane_delay_s", delay_s, 0.0005, 0.02, data_informed=True, reason="")
    pitot = SensorErrorEstimate("pitot_scale", 0.0, 0.03, 0.031, data_informed=False, reason="")
    return Compatibility((late, pitot), {}, (), gps=True, instrument=sensor_error_model(NAME))


def still(samples: int, dt_s: float = 0.01) -> Columns:
    """Return columns of a flight in which nothing moves."""
    t = np.arange(samples) * dt_s
    zero = np.zeros(samples)
    columns = {"t_s": t, "airspeed_mps": zero + SPEED_MPS, "qbar_pa": zero + 240.0}
    columns |= {f"{a}_radps": zero for a in "pqr"} | {"ax_mps2": zero, "ay_mps2": zero}
    return columns | {"az_mps2": zero - 9.8, "alpha_rad": zero, "beta_rad": zero}


def test_only_columns_of_an_imu_that_is_known_are_sharpened() -> None:
    """With our low-pass taken out of a table of others L_p and L_da were 10 % too large."""
    ours, dt_s = sensor_error_model("ultrastick25e"), 0.01
    signal = np.sin(40.0 * dt_s * np.arange(200))
    assert np.max(np.abs(compensate_lowpass(signal, ours, dt_s))) > 1.02
    others = ours.recorded(Recording(maker=FOREIGN))
    np.testing.assert_array_equal(compensate_lowpass(signal, others, dt_s), signal)
    assert others.imu_bandwidth_hz == np.inf
    told = ours.recorded(Recording(maker=AUTOPILOT, imu_lag_s=0.005))
    assert np.max(np.abs(compensate_lowpass(signal, told, dt_s))) > 1.02


def test_what_stays_open_is_what_tolerances_leave() -> None:
    found = delayed(0.007)
    left = residual_errors(found, still(10))
    assert left["vane_delay_s"] == pytest.approx(0.0005 / 1.96, rel=1e-3)
    assert left["imu_x_m"] == pytest.approx(0.010 / np.sqrt(3.0))
    assert left["elevator_scale"] == pytest.approx(0.01 / np.sqrt(3.0))
    assert left[IMU_DELAY] > 0.0005
    assert not residual_errors(replace(found, instrument=None), still(10))


def test_every_error_that_moves_an_answer_has_words() -> None:
    """A table says 'delay of the vanes', not the name of a variable."""
    assert {
        *INSTANTANEOUS_ERRORS,
        *residual_errors(delayed(0.007), still(10)),
    } <= error_kinds().keys()
    assert not any("_" in kind.label for kind in error_kinds().values())


def test_a_place_is_felt_by_what_sits_there() -> None:
    """An IMU ahead of its place feels q' x; a CG behind its place moves vanes and IMU alike."""
    found = delayed(0.007)
    columns = still(400)
    t = columns["t_s"]
    columns["q_radps"] = 0.5 * np.sin(4.0 * t)
    turn = np.gradient(columns["q_radps"], 0.01)
    imu = perturb_columns(columns, "imu_x_m", 0.01, found)
    np.testing.assert_allclose(imu["az_mps2"] - columns["az_mps2"], 0.01 * turn, atol=1e-12)
    np.testing.assert_array_equal(imu["alpha_rad"], columns["alpha_rad"])
    vane = perturb_columns(columns, "vane_x_m", 0.01, found)
    np.testing.assert_allclose(vane["alpha_rad"], 0.01 * columns["q_radps"] / SPEED_MPS)
    np.testing.assert_array_equal(vane["az_mps2"], columns["az_mps2"])
    cg = perturb_columns(columns, "cg_x_m", 0.01, found)
    np.testing.assert_allclose(cg["az_mps2"] - columns["az_mps2"], -0.01 * turn, atol=1e-12)
    np.testing.assert_allclose(cg["alpha_rad"], -0.01 * columns["q_radps"] / SPEED_MPS)


def gusty() -> tuple[Columns, Maneuver, LinearModel, FitResult, Trim]:
    """Return a short period in gusts that turn the air, flown and fitted by filter error."""
    trim = Trim(SPEED_MPS, 0.0, 0.0)
    model = template("short-period", trim)
    values = {"Z_alpha": -8.0, "Z_de": -1.1, "Z_q": -0.1, "M_alpha": -300.0, "M_q": -15.0}
    truth = np.array([values.get(p.name, -280.0) for p in model.parameters])
    samples, dt_s, rng = 1200, 0.01, np.random.default_rng(5)
    turned, start = with_gust_penetration(model, SPEED_MPS, truth)
    wide = gust_model(turned, SPEED_MPS)
    lag = start[-1]
    A, B, C, D = wide.matrices(np.array([*truth, 0.1 * lag, 15.0 * lag, lag]))
    t = np.arange(samples) * dt_s
    u = 0.04 * np.sign(np.sin(3.0 * t) + np.sin(7.3 * t + 1.0))[:, None]
    x, states = np.zeros(len(A)), []
    F = np.eye(len(A)) + A * dt_s + 0.5 * A @ A * dt_s**2
    for k in range(samples):
        states.append(x)
        x = F @ x + dt_s * (B @ u[k])
        x[wide.states.index("gust_rad")] += 0.01 * np.sqrt(dt_s) * rng.standard_normal()
    y = np.array(states) @ C.T + u @ D.T
    y = y + 0.04 * y.std(axis=0) * rng.standard_normal(y.shape)
    columns = still(samples) | {"elevator_rad": u[:, 0]}
    columns |= dict(zip(model.outputs, y.T, strict=True))
    maneuver = Maneuver(dt_s, u, y)
    return columns, maneuver, model, fit_with_gust(model, [maneuver], SPEED_MPS).result, trim


def test_innovations_with_a_memory_widen_the_interval() -> None:
    """Filter error calls itself sure; what its own innovations say is never narrower."""
    _, maneuver, model, result, _ = gusty()
    own = np.sqrt(np.diag(result.covariance_white))[:6]
    assert np.all(result.standard_error[:6] >= own * (1.0 - 1e-9))
    slow = np.convolve(np.random.default_rng(1).standard_normal(1300), np.ones(60) / 60.0)
    y = maneuver.outputs.copy()
    y[:, 1] += 0.3 * y[:, 1].std() * slow[: len(y)] / slow.std()
    disturbed = fit_with_gust(model, [replace(maneuver, outputs=y)], SPEED_MPS).result
    wide = disturbed.standard_error[:6] / np.sqrt(np.diag(disturbed.covariance_white))[:6]
    assert np.max(wide) > 1.3
