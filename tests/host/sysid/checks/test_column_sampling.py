"""Quantised, held and clean columns are data; a sensor that must move and does not is stuck."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from host.readers.column_sampling import quantum, sampling_of
from host.sysid.estimators.filter_error_gust import SLOW_IN_CALM
from host.sysid.flight import read_flight_columns
from host.sysid.models import Maneuver, Trim
from host.sysid.models.templates import longitudinal
from host.sysid.numerics import OutputProblem

import host

DEG = np.pi / 180.0
TRIM = Trim(17.0, 5.0 * DEG, 5.0 * DEG)
TRUE = {
    "D_V": -0.1, "D_alpha": -3.0, "D_de": -0.3, "Z_V": -0.07, "Z_alpha": -7.5, "Z_q": 0.0,
    "Z_de": -0.6, "M_V": 0.3, "M_alpha": -180.0, "M_q": -11.0, "M_de": -190.0,
}  # fmt: skip
NOISE = {
    "airspeed_mps": 0.15, "alpha_rad": 0.15 * DEG, "q_radps": 0.5 * DEG, "theta_rad": 0.1 * DEG,
    "ax_mps2": 0.1, "az_mps2": 0.15,
}  # fmt: skip
STEPS = {"alpha_rad": 0.1 * DEG, "theta_rad": 0.1 * DEG, "airspeed_mps": 0.5}
SLOW = 5  # rows
SERVO_RADPS, FINE = 46.0, 8  # it moves between the samples too


def record(seed: int, noise: float = 1.0) -> pd.DataFrame:
    """Return 20 s of a linear aircraft with two 3-2-1-1s and a doublet, at 50 Hz."""
    model, dt_s, rows = longitudinal(TRIM), 0.02, 1000
    t, u = dt_s / FINE * np.arange(rows * FINE), np.zeros(rows * FINE)
    for start_s in (5.0, 9.5):
        for first_s, last_s, sign in ((0, 0.6, 1), (0.6, 1.0, -1), (1.0, 1.2, 1), (1.2, 1.4, -1)):
            u[(t > start_s + first_s) & (t <= start_s + last_s)] = sign * 3.0 * DEG
    u[(t > 14.0) & (t <= 14.4)], u[(t > 14.4) & (t <= 14.8)] = 3.0 * DEG, -3.0 * DEG
    left = np.exp(-SERVO_RADPS * dt_s / FINE)
    for k in range(1, len(t)):
        u[k] = u[k - 1] + (1.0 - left) * (u[k] - u[k - 1])
    still = Maneuver(dt_s / FINE, u[:, None], np.zeros((len(t), len(model.outputs))))
    problem = OutputProblem(model, [still])
    theta = np.zeros(len(problem.names))
    theta[: len(model.parameters)] = [TRUE.get(p.name, 0.0) for p in model.parameters]
    found = problem.outputs(theta)
    assert found is not None
    t, u, found = t[::FINE], u[::FINE], [found[0][:, ::FINE]]
    rng, g = np.random.default_rng(seed), 9.80665
    level = {
        "airspeed_mps": 17.0, "alpha_rad": TRIM.alpha_rad, "theta_rad": TRIM.alpha_rad,
        "ax_mps2": g * np.sin(TRIM.alpha_rad), "az_mps2": -g * np.cos(TRIM.alpha_rad),
    }  # fmt: skip
    columns = {
        name: level.get(name, 0.0) + y + noise * NOISE[name] * rng.standard_normal(rows)
        for name, y in zip(model.outputs, found[0], strict=True)
    }
    return pd.DataFrame({"t_s": t, **columns, "elevator_rad": u})


def quantised(table: pd.DataFrame) -> pd.DataFrame:
    return table.assign(**{k: np.round(table[k] / step) * step for k, step in STEPS.items()})


def held(table: pd.DataFrame, names: tuple[str, ...] = tuple(STEPS)) -> pd.DataFrame:
    rows = np.arange(len(table)) // SLOW * SLOW
    return table.assign(**{k: table[k].to_numpy()[rows] for k in names})


def test_a_step_is_seen_and_noise_has_none() -> None:
    x = np.random.default_rng(1).standard_normal(4000)
    assert quantum(x) == 0.0
    assert quantum(np.round(x / 0.25) * 0.25) == pytest.approx(0.25)
    assert quantum(np.round(x / 0.25) * 0.25 * DEG) == pytest.approx(0.25 * DEG)
    assert quantum(np.zeros(100)) == 0.0


@pytest.mark.parametrize("step", [0.0, 0.3])
@pytest.mark.parametrize("phase", [0, 3])
def test_a_hold_is_seen_behind_a_step(step: float, phase: int) -> None:
    x = np.cumsum(0.3 * np.random.default_rng(2).standard_normal(3000))
    x = np.round(x / step) * step if step else x
    rows = np.maximum((np.arange(3000) - phase) // SLOW * SLOW + phase, 0)
    found = sampling_of(x[rows])
    assert found.hold == SLOW
    assert found.sampled[phase::SLOW].all()
    assert found.sampled.mean() == pytest.approx(1 / SLOW, abs=0.01)
    assert sampling_of(x).hold == 1  # a quantised value repeats, but at no regular rows


def test_missing_cells_hide_no_hold() -> None:
    """One empty cell, and steps counted as measurements: Cl_p of a held table was 38 % off."""
    rng = np.random.default_rng(3)
    rows = np.arange(3000) // SLOW * SLOW
    x = np.cumsum(0.3 * rng.standard_normal(3000))[rows]
    for missing in ([0], rng.choice(3000, 100, replace=False)):
        holed = x.copy()
        holed[missing] = np.nan
        found = sampling_of(holed)
        assert found.hold == SLOW
        assert found.sampled[::SLOW].all()
        assert found.sampled.mean() == pytest.approx(1 / SLOW, abs=0.01)
    empty_between = np.where(np.arange(3000) % SLOW == 0, x, np.nan)
    assert sampling_of(empty_between).hold == 1
    assert sampling_of(np.full(3000, np.nan)).hold == 1


def test_a_held_column_keeps_its_swings() -> None:
    """Lines between its samples took 9 % off a motion of 3.5 Hz, and Cm_q was 4 % off."""
    t = 0.01 * np.arange(2000)
    swing = 0.05 * np.sin(2.0 * np.pi * 3.5 * t)
    table = pd.DataFrame({"t_s": t, "q_radps": np.gradient(swing, t), "alpha_rad": swing})
    inner = slice(SLOW, -2 * SLOW)
    found = read_flight_columns(held(table, ("alpha_rad",))).columns["alpha_rad"]
    assert np.std(found[inner]) == pytest.approx(np.std(swing[inner]), rel=0.02)


def test_a_quiet_quantised_record_is_whole() -> None:
    """Values of airspeed stayed for 0.7 s: they counted as missing, and as gaps."""
    table = quantised(record(0))
    found = read_flight_columns(table)
    assert found.findings == []
    assert "bridged" not in found.columns
    assert found.resolution["airspeed_mps"] == pytest.approx(0.5)
    assert found.resolution["theta_rad"] == pytest.approx(0.1 * DEG, rel=1e-6)
    for name in STEPS:
        np.testing.assert_allclose(found.columns[name], table[name], atol=1e-9)


def test_a_clean_record_at_rest_is_whole() -> None:
    found = read_flight_columns(record(0, noise=0.0))
    assert found.findings == []
    assert "bridged" not in found.columns


@pytest.mark.parametrize("name", tuple(NOISE))
def test_one_clean_column_at_rest_beside_noisy_ones_is_whole(name: str) -> None:
    clean = record(0, noise=0.0)[name]
    assert read_flight_columns(record(0).assign(**{name: clean})).findings == []


def stuck(name: str, first: int, end: int) -> Callable[[pd.DataFrame], pd.DataFrame]:
    def change(table: pd.DataFrame) -> pd.DataFrame:
        values = table[name].to_numpy().copy()
        values[first:end] = values[first]
        return table.assign(**{name: values})

    return change


@pytest.mark.parametrize("name", ["theta_rad", "alpha_rad", "q_radps"])
@pytest.mark.parametrize("made", ["noisy", "quantised", "clean"])
def test_a_sensor_that_must_move_and_does_not_is_stuck(name: str, made: str) -> None:
    whole = record(0, noise=0.0 if made == "clean" else 1.0)
    whole = quantised(whole) if made == "quantised" else whole
    table = stuck(name, 250, 320)(whole)  # over a 3-2-1-1
    found = read_flight_columns(table)
    assert [(f.check, f.channels) for f in found.findings] == [("stuck-sensor", (name,))]
    assert found.columns["bridged"][260:310].all()
    kept = read_flight_columns(table, accept=("stuck-sensor",))
    assert kept.findings[0].accepted
    assert "bridged" not in kept.columns


def test_in_calm_air_output_error_tells_delays_by_slow_columns() -> None:
    """By the filter the gyro's delay scattered twice as far as it was known."""
    table = held(record(0), tuple(NOISE))
    result = host.identify(table, models="longitudinal", stretches=[(4.0, 11.5)]).linear[0].result
    assert result.residual_kind == "output"
    assert SLOW_IN_CALM in result.warnings
    assert {"delay_vanes_s", "delay_imu_s"} <= set(result.names)


def test_without_a_compiler_output_error_stands_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("host.sysid.numerics.model_problems.has_compiler", lambda: False)
    answer = host.identify(held(record(0)), models="longitudinal", stretches=[(4.0, 19.5)])
    assert answer.linear[0].method == "output-error-white"
    assert any("numba" in line for line in answer.linear[0].result.warnings)


def test_intervals_hold_beside_a_clean_column() -> None:
    """Its information drowned that of all others: 73 to 93 % held, none of M_alpha's."""
    start = {name: 0.8 * value for name, value in TRUE.items()}
    model = replace(longitudinal(TRIM), name="own")
    model = model.with_start([start.get(p.name, p.start) for p in model.parameters])
    clean = record(0, noise=0.0)
    true = []
    for names in (("alpha_rad",), ("theta_rad", "airspeed_mps"), ("q_radps",), tuple(NOISE)):
        table = record(0).assign(**{name: clean[name] for name in names})
        found = host.identify(table, models=model, stretches=[(0.0, 19.9)]).linear[0].result
        half = found.half_width()
        true += [abs(found.value(n) - x) <= half[found.index(n)] for n, x in TRUE.items()]
    assert np.mean(true) > 0.9
