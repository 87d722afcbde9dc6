"""Delays of vane and IMU beside a gust that acts on a point: true ones are found, none is made."""

from dataclasses import replace

import numpy as np
import pytest
from host.sysid.estimators.filter_error_gust import fit_with_gust
from host.sysid.estimators.gust_model import gust_model
from host.sysid.models import Maneuver, Trim, template
from host.sysid.models.residual_delays import STANDARD_DELAYS, delays_of
from scipy import interpolate, linalg

SPEED_MPS, DT_S, FINE = 18.0, 0.01, 10
TRUE = {
    "Z_alpha": -7.4, "Z_q": -0.08, "Z_de": -0.6, "M_alpha": -91.0, "M_q": -11.3, "M_de": -121.0,
}  # fmt: skip


def _flown(seed: int, vane_s: float, imu_s: float) -> Maneuver:
    """Fly 15 s of 3-2-1-1s in gusts of 0.5 m/s; sensors read what was some milliseconds ago."""
    model = template("short-period", Trim(SPEED_MPS), delays=())
    wide = gust_model(model, SPEED_MPS, 50.0)
    A, B, C, D = wide.matrices(np.array([TRUE[p.name] for p in model.parameters]))
    rng, n, fine_s = np.random.default_rng(seed), len(wide.states), DT_S / FINE
    whole = np.zeros((n + 2, n + 2))
    whole[:n, :n], whole[:n, n], whole[wide.states.index("gust_rad"), n + 1] = A, B[:, 0], 1.0
    step = linalg.expm(whole * fine_s)
    coarse = np.zeros(round(15.0 / DT_S))
    for begin in (1.0, 6.0, 11.0):
        for k, sign in enumerate((1, 1, 1, -1, -1, 1, -1)):
            first = round((begin + 0.25 * k) / DT_S)
            coarse[first : first + round(0.25 / DT_S)] = np.deg2rad(3.0) * sign
    at = np.arange(FINE * len(coarse)) / FINE
    elevator = np.interp(at, np.arange(len(coarse)), coarse)
    power = 0.5 / SPEED_MPS * np.sqrt(2.0 * SPEED_MPS / 50.0 / fine_s)
    x, rows = np.zeros(n), []
    for u in elevator:
        rows.append(C @ x + D[:, 0] * u)
        x = (step @ np.concatenate([x, [u, power * rng.standard_normal()]]))[:n]
    late = [round(vane_s / fine_s) if y == "alpha_rad" else round(imu_s / fine_s)
            for y in wide.outputs]  # fmt: skip
    read = np.maximum(FINE * np.arange(len(coarse))[:, None] - np.array(late), 0)
    outputs = np.take_along_axis(np.array(rows), read, axis=0)
    noise = np.where(np.char.endswith(wide.outputs, "mps2"), 0.1, 0.0025)
    outputs += noise * rng.standard_normal(outputs.shape)
    return Maneuver(dt_s=DT_S, inputs=coarse[:, None], outputs=outputs)


@pytest.mark.parametrize(("vane_s", "imu_s"), [(0.0, 0.0), (0.013, 0.001)])
def test_a_delay_is_found_in_gusts_and_none_is_made_up(vane_s: float, imu_s: float) -> None:
    """With lags in place of a delay the vane seemed 3 ms late, known to 5, M_alpha 3 % off."""
    model = template("short-period", Trim(SPEED_MPS))
    model = template("short-period", Trim(SPEED_MPS), delays=delays_of(model.outputs))
    assert {d.name for d in STANDARD_DELAYS} > {d.name for d in model.delays}
    flown = [_flown(seed, vane_s, imu_s) for seed in (1, 2)]
    found = fit_with_gust(model, flown, SPEED_MPS)
    for name, true_s in (("delay_vanes_s", vane_s), ("delay_imu_s", imu_s)):
        value, half = found.delays[name]
        assert abs(value - true_s) < 0.0008, (name, value)
        assert half < 0.0015, (name, half)
    result = found.result
    for name in ("Z_alpha", "M_alpha", "M_q", "M_de"):
        k = result.index(name)
        assert abs(result.estimate[k] - TRUE[name]) < 2.0 * result.half_width()[k], name
        assert abs(result.estimate[k] / TRUE[name] - 1.0) < 0.04, name


def _with_slow_vane(whole: Maneuver) -> Maneuver:
    """Return what is left of a vane that is read every fifth row, a curve in between."""
    sampled = np.ones(whole.outputs.shape, dtype=bool)
    sampled[:, 0] = np.arange(whole.samples) % 5 == 3
    rows, outputs = np.flatnonzero(sampled[:, 0]), whole.outputs.copy()
    outputs[:, 0] = interpolate.CubicSpline(rows, outputs[rows, 0])(np.arange(whole.samples))
    return replace(whole, outputs=outputs, sampled=sampled)


def test_the_delay_of_a_slow_vane_is_found() -> None:
    """Its samples move with it: with those of the rows in between M_alpha was 8 % off."""
    vane_s, model = 0.013, template("short-period", Trim(SPEED_MPS))
    model = template("short-period", Trim(SPEED_MPS), delays=delays_of(model.outputs))
    assert model.outputs[0] == "alpha_rad"
    whole = [_flown(seed, vane_s, 0.0) for seed in (1, 2)]
    found = fit_with_gust(model, [_with_slow_vane(m) for m in whole], SPEED_MPS)
    unspoilt = fit_with_gust(model, whole, SPEED_MPS).result
    value, half = found.delays["delay_vanes_s"]
    assert abs(value - vane_s) < min(half, 0.0016)
    half_width = found.result.half_width()
    for name in ("Z_alpha", "M_alpha", "M_q", "M_de"):
        k = found.result.index(name)
        assert abs(found.result.estimate[k] - TRUE[name]) < 1.5 * half_width[k], name
        wider = half_width[k] / unspoilt.half_width()[unspoilt.index(name)]
        assert 1.0 < wider < 3.0, (name, wider)
