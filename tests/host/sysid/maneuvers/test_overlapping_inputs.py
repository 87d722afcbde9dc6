"""Inputs of several surfaces at once: small ones are inputs too, echoes are not, all share time."""

import numpy as np
import pytest
from host.sysid.maneuvers import DetectedManeuver, detect_maneuvers
from numpy.typing import NDArray

Vector = NDArray[np.float64]
ELEVATOR, AILERON, RUDDER = "elevator_rad", "aileron_rad", "rudder_rad"
NOISE_RAD = np.radians(0.02)


def steps(t: Vector, start_s: float, unit_s: float, size_deg: float, *signs: int) -> Vector:
    """Return steps of one length."""
    at = np.floor((t - start_s + 1e-9) / unit_s).astype(int)
    inside = (at >= 0) & (at < len(signs))
    return np.asarray(np.radians(size_deg) * np.where(inside, np.array(signs)[at * inside], 0.0))


def multisine(t: Vector, start_s: float, size_deg: float) -> Vector:
    """Return 20 s of lines from 0.1 to 2 Hz."""
    lines = np.arange(2, 41) / 20.0
    phase = np.random.default_rng(3).uniform(0.0, 2.0 * np.pi, len(lines))
    wave = np.sin(2.0 * np.pi * np.outer(t - start_s, lines) + phase).sum(axis=1)
    wave *= (t >= start_s) & (t < start_s + 20.0)
    return np.asarray(np.radians(size_deg) * wave / np.max(np.abs(wave)))


def found_in(t: Vector, **columns: Vector) -> dict[str, DetectedManeuver]:
    """Return the maneuver of each surface, all of which carry the noise of a pot."""
    rng = np.random.default_rng(5)
    moved = {
        name: values
        + NOISE_RAD * rng.standard_normal(len(t)) * (name in (ELEVATOR, AILERON, RUDDER))
        for name, values in columns.items()
    }
    found = detect_maneuvers({"t_s": t, **moved})
    assert len({f.axis for f in found}) == len(found)
    return {f.axis: f for f in found}


@pytest.mark.parametrize("elevator_s", [2.7, 3.4])
@pytest.mark.parametrize("elevator", [(1, -1), (1, 1), (1, 1, 1, -1, -1, 1, -1)])
def test_a_small_step_beside_a_large_one_is_an_input(
    elevator: tuple[int, ...], elevator_s: float
) -> None:
    """1.5 degrees of the elevator beside 5 of the rudder passed for an echo of it."""
    t = np.arange(0.0, 20.0, 0.02)
    found = found_in(
        t,
        elevator_rad=steps(t, elevator_s, 0.35, 1.5, *elevator),
        aileron_rad=steps(t, 3.7, 0.35, 3.0, 1, -1),
        rudder_rad=steps(t, 3.0, 0.35, 5.0, 1, 1, -1, -1),
    )
    assert set(found) == {ELEVATOR, AILERON, RUDDER}
    for item in found.values():  # the free response of each is that after all of them
        assert item.fit_window() == pytest.approx((0.0, t[-1]), abs=0.05)
        assert item.start_s == pytest.approx(elevator_s if item.axis == ELEVATOR else 3.35, abs=0.4)


def test_a_step_within_a_multisine_of_another_surface_takes_nothing_from_it() -> None:
    t = np.arange(0.0, 28.0, 0.02)
    sines, doublet = multisine(t, 3.0, 1.5), steps(t, 9.0, 0.35, 5.0, 1, -1)
    found = found_in(t, elevator_rad=sines, rudder_rad=doublet)
    assert set(found) == {ELEVATOR, RUDDER}
    for item in found.values():
        first_s, last_s = item.fit_window()
        assert first_s < 3.1
        assert last_s > 22.9


def test_an_input_that_begins_behind_another_ends_its_window() -> None:
    t = np.arange(0.0, 30.0, 0.02)
    found = found_in(
        t,
        elevator_rad=steps(t, 3.0, 0.5, 3.0, 1, -1),
        rudder_rad=steps(t, 6.0, 0.5, 5.0, 1, -1),
    )
    assert found[ELEVATOR].fit_window()[1] == pytest.approx(6.0, abs=0.05)


def test_a_hand_that_moves_both_sticks_flies_two_inputs() -> None:
    """Each drives motion of its own, at once or apart."""
    t = np.arange(0.0, 20.0, 0.02)
    rudder = steps(t, 3.0, 0.5, 12.0, 1, -1)
    apart = steps(t, 3.3, 0.25, 1.8, 1, -1)
    for elevator in (0.15 * rudder, apart):
        assert set(found_in(t, elevator_rad=elevator, rudder_rad=rudder)) == {ELEVATOR, RUDDER}


def test_a_hand_that_levels_flies_no_input() -> None:
    """The elevator jumps to what the attitude asks for, and follows it, beside a large aileron."""
    t = np.arange(0.0, 30.0, 0.02)
    pitch = np.radians(8.0) * np.exp(-5.0 * np.maximum(t - 10.0, 0.0))
    holds = t >= 10.0
    aileron = steps(t, 9.5, 0.7, 10.0, 1, -1)
    levels = found_in(t, elevator_rad=0.5 * pitch * holds, aileron_rad=aileron, theta_rad=pitch)
    assert set(levels) == {AILERON}
    pushes = found_in(t, elevator_rad=-0.5 * pitch * holds, aileron_rad=aileron, theta_rad=pitch)
    assert set(pushes) == {ELEVATOR, AILERON}


def test_noise_of_a_pot_is_no_input() -> None:
    """0.1 degrees swing by 0.6 in two seconds, as far as the smallest input."""
    rng = np.random.default_rng(1)
    t = np.arange(0.0, 30.0, 0.02)
    noise = np.radians(0.12) * rng.standard_normal(len(t))
    assert found_in(t, elevator_rad=noise) == {}
    doublet = steps(t, 5.0, 0.5, 5.0, 1, -1)
    found = found_in(t, elevator_rad=noise, rudder_rad=doublet)
    assert set(found) == {RUDDER}
    assert found[RUDDER].end_s == pytest.approx(9.0, abs=0.05)


def test_a_pulse_at_the_start_of_a_long_record_is_an_input() -> None:
    """It passed for a change of trim. In trim nothing turns before the step."""
    t = np.arange(0.0, 60.0, 0.02)
    elevator = np.where(t < 0.7, 0.05, 0.0)
    since = t - 0.7
    behind = -0.4 * np.exp(-3.0 * since) * np.cos(6.0 * since) * (since >= 0.0)
    pushed = 0.4 * np.exp(-3.0 * t) * np.sin(6.0 * t) * (since < 0.0)
    [item] = found_in(t, elevator_rad=elevator, q_radps=pushed + behind).values()
    assert (item.start_s, item.input_end_s) == pytest.approx((0.0, 0.7), abs=0.05)
    assert item.fit_window() == pytest.approx((0.0, t[-1]), abs=0.05)
    rng = np.random.default_rng(2)
    gusts = 0.02 * rng.standard_normal(len(t))
    assert found_in(t, elevator_rad=elevator, q_radps=behind + gusts) == {}
