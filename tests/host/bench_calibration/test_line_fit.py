"""The line of a calibration: known lines come back, its deviations are what repeats show."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from host.bench_calibration.bench_plan import find_subject, hand_worth, subjects, tools
from host.bench_calibration.channel_doubts import doubt
from host.bench_calibration.held_position import Held, directions
from host.bench_calibration.line_fit import LineFit, fit_line
from host.constants import NORMAL_95, RAD_PER_DEG
from host.errors import UsageError
from host.physical.calibration import Line

VANES = subjects()["vanes"]
PER_DEG = 2.9  # counts


def _held(
    raw: Callable[[float, int], float], *, repeats: int = 3, positions: tuple[float, ...] = ()
) -> list[Held]:
    places = positions or VANES.positions
    return [
        Held("alpha_a", r, float(p), {"alpha_a": raw(float(p), r)})
        for r in range(1, repeats + 1)
        for p in places
    ]


def _fit(points: list[Held]) -> LineFit:
    return fit_line(VANES, "alpha_a", points)


def test_a_line_comes_back_exactly() -> None:
    fit = _fit(_held(lambda deg, _: 498.5 - PER_DEG * deg))
    assert fit.zero == pytest.approx(498.5)
    assert fit.slope == pytest.approx(-RAD_PER_DEG / PER_DEG)
    assert (fit.residual, fit.hysteresis, fit.bend) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_play_is_hysteresis_and_not_residual() -> None:
    points = _held(lambda deg, _: 500.0 + PER_DEG * deg)
    sides = directions(points)
    points = [
        replace(p, readings={"alpha_a": p.readings["alpha_a"] + 2.0 * side})
        for p, side in zip(points, sides, strict=True)
    ]
    fit = _fit(points)
    assert fit.hysteresis == pytest.approx(4.0)
    assert fit.residual == pytest.approx(0.0, abs=1e-9)
    assert fit.zero_sigma > 4.0 / math.sqrt(12.0)


def test_a_bend_is_told() -> None:
    fit = _fit(_held(lambda deg, _: 500.0 + PER_DEG * deg + 5.0 * (deg / 40.0) ** 2))
    assert 1.0 < fit.bend < 5.0
    assert fit.bend > fit.residual


def test_an_arm_that_is_not_square_becomes_a_curve_that_decoding_follows() -> None:
    """The line through it is 3.1 deg wrong at the end, the curve that is written 0.15 deg at most;
    a pot with a dead spot is no curve."""
    servos, rng = subjects()["servos"], np.random.default_rng(6)
    positions = np.array(servos.positions, dtype=float)

    def pulse_us(deg: np.ndarray) -> np.ndarray:
        return np.asarray(1500.0 + 10.0 * deg + 0.05 * deg**2 + 0.002 * deg**3)

    points = [
        Held("elevator", r, p, {"elevator": x + rng.normal(0.0, 2.0)})
        for r in (1, 2, 3)
        for p, x in zip(positions, pulse_us(positions), strict=True)
    ]
    fit = fit_line(servos, "elevator", points)
    assert len(fit.curve) == 2
    every = np.linspace(-20.0, 20.0, 81)
    line = Line((fit.zero,), (fit.slope,), 0.0, 0.0, "rad", "", False, fit.curve)
    decoded = (pulse_us(every) - line.zero[0]) * line.slope[0]
    straight = np.abs(decoded / RAD_PER_DEG - every).max()
    line.bend(decoded)
    assert np.abs(decoded / RAD_PER_DEG - every).max() < 0.15 < 3.0 < straight
    assert doubt(servos, fit, points) is None
    pots = subjects()["pots"]
    spot = [
        Held("pot_rudder", r, float(p), {"pot_rudder": 512.0 + 3.4 * p + 40.0 * (p == 15)})
        for r in (1, 2, 3)
        for p in pots.positions
    ]
    assert fit_line(pots, "pot_rudder", spot).curve == ()


def test_placing_of_the_tool_counts_once_for_each_repeat() -> None:
    """Three zeros 4 counts apart say more than the tool's word of 0.2 deg."""
    calm = _fit(_held(lambda deg, _: 500.0 + PER_DEG * deg))
    apart = _fit(_held(lambda deg, r: 500.0 + PER_DEG * deg + 4.0 * (r - 2)))
    assert apart.zero == pytest.approx(500.0)
    assert apart.repeat_zeros == pytest.approx([496.0, 500.0, 504.0])
    assert apart.zero_sigma > 1.1 * calm.zero_sigma
    assert apart.slope_sigma == pytest.approx(calm.slope_sigma)


def test_the_tool_itself_is_never_averaged_away() -> None:
    many = _fit(_held(lambda deg, _: 500.0 + PER_DEG * deg, repeats=40))
    tool = tools()["vane_jig"]
    assert many.zero_sigma >= tool.own * PER_DEG
    assert many.slope_sigma >= tool.scale


@pytest.mark.parametrize("repeats", [1, 3])
def test_stated_intervals_hold_what_a_hand_scatters(repeats: int) -> None:
    """400 calibrations by hands as careful as the file says, of one tool that is off itself."""
    rng, inside = np.random.default_rng(8), 0
    tool = tools()["vane_jig"]
    positions = np.array(VANES.positions, dtype=float)
    for _ in range(400):
        care = math.sqrt(hand_worth() / rng.chisquare(hand_worth()))
        own, scale = tool.own * rng.standard_normal(), tool.scale * rng.standard_normal()
        points = []
        for r in range(1, repeats + 1):
            placing = care * tool.placing * rng.standard_normal()
            read = care * tool.reading * rng.standard_normal(len(positions))
            raw = 500.0 + PER_DEG * (positions * (1.0 + scale) + own + placing + read)
            points += [
                Held("alpha_a", r, p, {"alpha_a": x}) for p, x in zip(positions, raw, strict=True)
            ]
        fit = _fit(points)
        inside += abs(fit.zero - 500.0) < NORMAL_95 * fit.zero_sigma
        inside += abs(fit.slope * PER_DEG / RAD_PER_DEG - 1.0) < NORMAL_95 * fit.slope_sigma
    assert 0.93 < inside / 800 < 0.97


def test_a_speed_run_weighs_slow_runs_as_well_as_fast_ones() -> None:
    """0.3 m/s is 1.8 Pa at 5 m/s and 8 Pa at 22: the slow end must not be drowned."""
    speed = subjects()["speed"]
    rng = np.random.default_rng(2)
    points = [
        Held("dp_a", r, v, {"dp_a": 512.0 + 0.5 * 1.225 * (v + 0.3 * rng.standard_normal()) ** 2
                            / 4.88})
        for r in (1, 2) for v in (0.0, 12.0, 15.0, 18.0, 22.0)
    ]  # fmt: skip
    fit = fit_line(speed, "dp_a", points)
    assert fit.zero == pytest.approx(512.0, abs=NORMAL_95 * fit.zero_sigma)
    assert fit.slope == pytest.approx(4.88, rel=NORMAL_95 * fit.slope_sigma)


@pytest.mark.parametrize(
    ("positions", "said"), [((0.0, 10.0), "expected 4 or more"), ((5.0,) * 9, "at 1 positions")]
)
def test_points_that_make_no_line(positions: tuple[float, ...], said: str) -> None:
    points = _held(lambda deg, _: 500.0 + PER_DEG * deg, repeats=1, positions=positions)
    if said.startswith("expected"):
        points = points[:2]
        said = "2 readings at 2 positions"
    with pytest.raises(UsageError, match=said):
        _fit(points)


def test_sides_are_known_from_the_order() -> None:
    points = _held(lambda deg, _: 0.0, repeats=2, positions=(0.0, 10.0, 0.0, -10.0, 0.0))
    assert directions(points) == [0, 1, -1, -1, 1] * 2


def test_every_channel_of_the_default_has_a_plan() -> None:
    from host.physical.calibration import load_calibration

    measured = {"imu.accel", "imu.gyro"}
    for subject in subjects().values():
        if subject.table in ("channel", "pulse"):
            measured |= {f"{subject.table}.{c}" for c in subject.channels}
    lines = load_calibration().lines
    old = {name for name in lines if name.startswith(("imu_original.", "original."))}
    assert measured == set(lines) - old


def test_both_directions_pass_every_position() -> None:
    for name in ("vanes", "pots", "servos", "pitots"):
        positions = subjects()[name].positions
        up = {b for a, b in pairwise(positions) if b > a}
        down = {b for a, b in pairwise(positions) if b < a}
        inner = {p for p in positions if abs(p) < max(positions)}
        assert inner <= up & down, name


def test_a_misspelt_channel_gets_the_near_name() -> None:
    with pytest.raises(UsageError, match="alpha_a"):
        find_subject("alpha_aa")
