"""What detection keeps: slow and small inputs, records cut to them, and the response after them."""

import numpy as np
import pytest
from host.sysid.maneuvers import DetectedManeuver, detect_maneuvers, joined_windows
from host.sysid.maneuvers.sustained_inputs import running_maximum
from numpy.typing import NDArray
from scipy import ndimage

Vector = NDArray[np.float64]
STEPS = ((3.0, 1.0), (2.0, -1.0), (1.0, 1.0), (1.0, -1.0))


def found_in(t: Vector, elevator: Vector, **others: Vector) -> list[DetectedManeuver]:
    return detect_maneuvers({"t_s": t, "elevator_rad": elevator, **others})


def multisine(t: Vector, start_s: float, size_rad: float, seed: int) -> Vector:
    """Return 20 s of lines from 0.1 to 2 Hz with random phases, `size_rad` at the peak."""
    lines = np.arange(2, 41) / 20.0
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(lines))
    wave = np.sin(2.0 * np.pi * np.outer(t - start_s, lines) + phase).sum(axis=1)
    return np.asarray(np.where((t >= start_s) & (t < start_s + 20.0), wave, 0.0) * size_rad
                      / np.max(np.abs(wave[(t >= start_s) & (t < start_s + 20.0)])))  # fmt: skip


def steps(t: Vector, start_s: float, unit_s: float, size_rad: float = 0.05) -> Vector:
    """Return a 3-2-1-1."""
    result, first = np.zeros(len(t)), start_s
    for length, sign in STEPS:
        result[(t >= first - 1e-9) & (t < first + length * unit_s - 1e-9)] = sign * size_rad
        first += length * unit_s
    return result


@pytest.mark.parametrize("rate_hz", [20.0, 50.0, 100.0])
@pytest.mark.parametrize("size_deg", [0.7, 2.0, 5.0])
@pytest.mark.parametrize(("lead_s", "tail_s"), [(0.0, 0.0), (3.0, 3.0), (30.0, 30.0)])
def test_all_of_a_multisine_is_found(
    rate_hz: float, size_deg: float, lead_s: float, tail_s: float
) -> None:
    t = np.arange(round((lead_s + 20.0 + tail_s) * rate_hz)) / rate_hz
    for seed in range(10):
        rng = np.random.default_rng(100 + seed)
        elevator = multisine(t, lead_s, np.radians(size_deg), seed)
        noise = np.radians(0.02) * rng.standard_normal(len(t))
        [windows] = joined_windows([found_in(t, elevator + noise)])
        [item] = windows
        assert (item.start_s, item.input_end_s) == pytest.approx((lead_s, lead_s + 20.0), abs=2.0)
        first_s, last_s = item.fit_window()
        assert first_s <= lead_s + 0.1, seed
        assert last_s >= lead_s + 19.9, seed


@pytest.mark.parametrize("share", [0.3, 0.45, 0.8])
def test_multisines_of_three_surfaces_at_once_are_all_found(share: float) -> None:
    """That of the elevator, less than half of the rudder's, passed for an echo of it."""
    t, rng = np.arange(26.0 / 0.02) * 0.02, np.random.default_rng(7)
    for seed in range(10):
        waves = [
            multisine(t, 2.0, np.radians(8.0) * size, 3 * seed + k)
            + np.radians(0.02) * rng.standard_normal(len(t))
            for k, size in enumerate((share, 0.5, 1.0))
        ]
        found = found_in(t, waves[0], aileron_rad=waves[1], rudder_rad=waves[2])
        assert {f.axis for f in found} == {"elevator_rad", "aileron_rad", "rudder_rad"}, seed
        assert all(f.input_end_s - f.start_s > 16.0 for f in found)


@pytest.mark.parametrize("unit_s", [0.3, 0.7, 1.0, 1.5])
def test_a_slow_3211_is_one_maneuver(unit_s: float) -> None:
    t = np.arange(0.0, 60.0, 0.02)
    [item] = found_in(t, steps(t, 10.0, unit_s))
    assert item.kind == "3-2-1-1"
    assert (item.start_s, item.input_end_s) == pytest.approx((10.0, 10.0 + 7.0 * unit_s), abs=0.1)


def test_a_pulse_of_two_seconds_is_found() -> None:
    t = np.arange(0.0, 40.0, 0.02)
    [item] = found_in(t, np.where((t >= 10.0) & (t < 12.0), 0.05, 0.0))
    assert item.kind == "pulse"
    assert (item.start_s, item.input_end_s) == pytest.approx((10.0, 12.0), abs=0.1)


@pytest.mark.parametrize("length_s", [1.5, 2.5, 5.0])
@pytest.mark.parametrize("begun_s", [0.0, 0.1, 0.3])
def test_a_record_cut_to_its_input_is_one_maneuver(length_s: float, begun_s: float) -> None:
    """Its first sample is in the first step; nothing of it is left out."""
    t = np.arange(0.0, length_s, 0.02)
    [item] = found_in(t, steps(t, -begun_s, 0.18))
    first_s, last_s = item.fit_window()
    assert first_s <= 0.0
    assert last_s == pytest.approx(t[-1], abs=0.03)
    assert item.kind == ("multistep" if begun_s > 0.2 else "3-2-1-1")


def test_a_change_of_trim_is_no_maneuver() -> None:
    t = np.arange(0.0, 80.0, 0.02)
    assert found_in(t, np.where(t < 3.0, -0.05, 0.0)) == []
    assert found_in(t, np.where(t < 40.0, -0.05, 0.0)) == []


def test_a_pilot_who_holds_the_attitude_flies_no_maneuver() -> None:
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 120.0, 0.02)
    stir = np.convolve(rng.standard_normal(len(t)), np.ones(20) / 20.0, mode="same")
    assert found_in(t, np.radians(3.0) * stir) == []


def test_the_free_response_belongs_to_the_maneuver() -> None:
    t = np.arange(0.0, 200.0, 0.02)
    [item] = found_in(t, steps(t, 40.0, 0.3))
    assert item.end_s == pytest.approx(42.1 + 3.0, abs=0.1)
    assert item.fit_window() == pytest.approx((10.0, 162.1), abs=0.1)  # two minutes behind it


def test_the_free_response_ends_where_something_moves() -> None:
    t = np.arange(0.0, 80.0, 0.02)
    turn = np.where(t > 30.0, 0.05, 0.0)  # trimmed anew: no maneuver, but no free response either
    [item] = found_in(t, steps(t, 10.0, 0.3), aileron_rad=turn)
    assert item.fit_window()[1] == pytest.approx(30.0, abs=0.1)
    first, second = found_in(t, steps(t, 10.0, 0.3) + steps(t, 40.0, 0.3))
    assert first.fit_window()[1] == pytest.approx(39.7, abs=0.1)
    assert second.fit_window()[0] == pytest.approx(39.7, abs=0.1)


@pytest.mark.parametrize("servo_s", [0.025, 0.08])
def test_the_free_response_is_kept_behind_a_servo(servo_s: float) -> None:
    """A surface that creeps back to its rest cut the phugoid off: D_V known 7 times worse."""
    t = np.arange(0.0, 60.0, 0.02)
    share = 1.0 - np.exp(-0.02 / servo_s)
    elevator = np.zeros(len(t))
    for k, command in enumerate(steps(t, 10.0, 0.3)[:-1]):
        elevator[k + 1] = elevator[k] + share * (command - elevator[k])
    [item] = found_in(t, elevator)
    assert item.fit_window() == pytest.approx((0.0, t[-1]), abs=0.05)
    turn = np.where(t > 13.0, 0.05, 0.0)  # still ends where something moves
    [item] = found_in(t, elevator, aileron_rad=turn)
    assert item.free_end_s == pytest.approx(13.0, abs=0.05)


@pytest.mark.parametrize(("size_deg", "ends"), [(0.9, False), (2.0, True)])
def test_a_window_ends_at_the_next_input_and_not_at_handling(size_deg: float, ends: bool) -> None:
    """Small swings of another surface, which begin when the pilot's hands come back."""
    t = np.arange(0.0, 40.0, 0.01)
    elevator = 0.09 * (1.0 * ((t >= 10.0) & (t < 11.0)) - 2.0 * ((t >= 10.5) & (t < 11.0)))
    aileron = multisine(t, 11.5, np.radians(size_deg), 3)
    doublet, swings = found_in(t, elevator, aileron_rad=aileron)
    assert (doublet.axis, swings.axis) == ("elevator_rad", "aileron_rad")
    assert 11.0 < swings.start_s < 13.5
    assert doublet.end_s == pytest.approx(swings.start_s if ends else 14.0, abs=0.05)


def test_a_gap_divides_a_maneuver() -> None:
    t = np.arange(0.0, 60.0, 0.02)
    bridged = ((t > 13.0) & (t < 14.0)).astype(np.float64)
    before, after = found_in(t, steps(t, 10.0, 1.0), bridged=bridged)
    assert before.fit_window() == pytest.approx((0.0, 13.0), abs=0.05)
    assert after.fit_window() == pytest.approx((14.0, 60.0), abs=0.3)


def test_windows_that_touch_stay_apart_where_one_can_be_held_out() -> None:
    t = np.arange(0.0, 80.0, 0.02)
    two = steps(t, 10.0, 0.3) + steps(t, 30.0, 0.3)
    assert len(joined_windows([found_in(t, two)])[0]) == 1
    three = two + steps(t, 50.0, 0.3)
    assert len(joined_windows([found_in(t, three)])[0]) == 3


@pytest.mark.parametrize("samples", [1, 6, 7, 1000])
@pytest.mark.parametrize("half", [1, 3, 100])
def test_the_running_maximum_is_that_of_scipy(samples: int, half: int) -> None:
    series = np.random.default_rng(samples).standard_normal(samples)
    expected = ndimage.maximum_filter1d(series, 2 * half + 1)
    np.testing.assert_array_equal(running_maximum(series, half), expected)
