"""PX4's autotune beside a model: the truth's own discrete model agrees, a wrong one does not."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from host.aircraft.linearisation import linearise
from host.readers.autopilot_flight import read_autopilot
from host.readers.autotune_model import TunedModel
from host.sysid.flight import read_flight_columns
from numpy.typing import NDArray
from scipy import signal
from scipy.linalg import expm

import host
from tests.host.readers.autopilot_flights import FULL_TRAVEL_RAD, flown, write
from tests.host.readers.changed_logs import Topics, px4

pytestmark = pytest.mark.costs(60, "three flights are identified, and one flown")
Values = NDArray[np.float64]
DT_S = 0.0125
SHARE = -0.8  # of the elevator's travel, trailing edge down, per torque, nose up
SERVO_HZ = 8.0
RELEASES = {"1.14": (2, 3, 4, 5), "1.17": (3, 4, 6, 7)}  # roll, pause, pitch, pause


@cache
def plant() -> tuple[Values, Values, Values, Values]:
    """Return the twin's linear pitch rate over torque, behind the servo: A, B, C, D."""
    record, _ = flown()
    linear = linearise(record.frame, record.trim)
    omega = 2.0 * np.pi * SERVO_HZ
    A, B = np.zeros((5, 5)), np.zeros((5, 1))
    A[:4, :4], A[:4, 4:] = linear.longitudinal_a, linear.longitudinal_b
    A[4, 4], B[4, 0] = -omega, omega * SHARE * FULL_TRAVEL_RAD
    return A, B, np.eye(5)[2:3], np.zeros((1, 1))


def filtered(values: Values, band_hz: tuple[float, float], rate_hz: float) -> Values:
    """Return values behind a high-pass and a low-pass of first order."""
    b, a = signal.butter(1, band_hz, "band", fs=rate_hz)
    return np.asarray(signal.lfilter(b, a, values), dtype=np.float64)


@cache
def coefficients() -> tuple[float, ...]:
    """Return a1, a2, b0, b1, b2 of the plant at `DT_S`, by least squares without noise.

    As PX4 has them: the loop is faster than the model, input and output go through both filters.
    """
    rng, fine_s = np.random.default_rng(3), DT_S / 5
    u = np.repeat(rng.choice([-0.2, 0.2], 800), rng.integers(30, 90, 800))
    A, B, C, D, _ = signal.cont2discrete(plant(), fine_s)
    y = signal.dlsim((A, B, C, D, fine_s), u[:, None])[1][:, 0]
    u, y = (filtered(x, (0.5, 25.0), 1.0 / fine_s) for x in (u, y))
    u, y = u[::5], y[::5]
    past = np.column_stack([-y[2:-1], -y[1:-2], u[2:-1], u[1:-2], u[:-3]])
    return tuple(np.linalg.lstsq(past, y[3:], rcond=None)[0].tolist())


def tuning(
    model: tuple[float, ...], release: str = "1.14", axis: int = 1
) -> Callable[[Topics], None]:
    """Return the change that adds an autotune of an axis to a log, and the torque."""
    with_servos = read_autopilot(log_as_it_is())
    surface = with_servos.channels.signals["elevator"]
    rate = with_servos.channels.signals[("p_radps", "q_radps", "r_radps")[axis]]
    moves = np.flatnonzero(np.abs(surface.values - np.median(surface.values)) > 0.05)
    from_s, to_s = surface.t_s[moves[0]] - 1.0, surface.t_s[moves[-1]] + 1.0

    def change(topics: Topics) -> None:
        torque = np.zeros((len(surface.t_s), 3))
        torque[:, 1] = surface.values / SHARE
        us = (1e6 * surface.t_s).astype(np.uint64)
        topics["vehicle_torque_setpoint", 0] = {"timestamp": us, "xyz": torque.astype(np.float32)}
        t_s = np.arange(from_s - 2.0, to_s + 2.0, 0.1)
        tuned = (t_s >= from_s) & (t_s <= to_s)
        first, _, pitch, pause = RELEASES[release]
        state = np.where(t_s < from_s, 1, np.where(tuned, first if axis == 0 else pitch, pause))
        learnt = 1.0 - np.exp(-np.cumsum(tuned) / 4.0)
        y_filt = filtered(np.interp(t_s, rate.t_s, rate.values), (0.5, 4.9), 10.0)
        rows: dict[str, Any] = {
            "timestamp": (1e6 * t_s).astype(np.uint64),
            "coeff": learnt[:, None] * np.array(model),
            "coeff_var": np.full((len(t_s), 5), 1e-6),
            "fitness": np.full(len(t_s), 0.5),
            "dt_model": np.full(len(t_s), DT_S),
            "y_filt": y_filt,
        }
        rows = {k: v if k == "timestamp" else v.astype(np.float32) for k, v in rows.items()}
        topics["autotune_attitude_control_status", 0] = rows | {"state": state.astype(np.uint8)}

    return change


@cache
def log_as_it_is() -> Path:
    """Return the flight's log."""
    from tempfile import mkdtemp

    return write("ulog", Path(mkdtemp()))


def tuned_of(path: Path) -> tuple[TunedModel, ...]:
    return read_flight_columns(path).tuned


@pytest.mark.parametrize("release", RELEASES)
@pytest.mark.parametrize("axis", [0, 1])
def test_the_axis_is_told_by_what_moved_whatever_the_state_is_called(
    tmp_path: Path, release: str, axis: int
) -> None:
    (one,) = tuned_of(px4(tmp_path / "a.ulg", tuning(coefficients(), release, axis)))
    assert one.rate == ("p_radps", "q_radps")[axis]
    assert one.coefficients == pytest.approx(coefficients(), rel=0.01)
    assert one.dt_s == pytest.approx(DT_S) and one.converged
    assert tuned_of(log_as_it_is()) == ()


def test_the_truth_of_the_twin_agrees_and_a_wrong_sign_does_not(tmp_path: Path) -> None:
    true = coefficients()
    wrong = {
        "agrees": true,
        "has the opposite sign": (*true[:2], *(-b for b in true[2:])),
        "does not agree": (*true[:2], *(3.0 * b for b in true[2:])),
    }
    for number, (verdict, model) in enumerate(wrong.items()):
        path = px4(tmp_path / f"{number}.ulg", tuning(model))
        found = host.identify(path, aircraft="ultrastick25e", models="short-period")
        ((one,),) = found.opinions
        assert one.verdict == verdict and f"short-period: {one.line}" in found.to_text()
        assert len(one.short) <= 80 and one.short in found.to_text(full=False).splitlines()
        f = one.frequency_hz
        A, B, C, _ = plant()
        truth = np.array(
            [(C @ np.linalg.solve(2j * np.pi * x * np.eye(5) - A, B))[0, 0] for x in f]
        )
        scale = np.sum(model[2:]) / np.sum(true[2:])
        low = f < 5.0  # five coefficients for a plant of five states: 20 % off at most
        assert np.abs(one.theirs / truth / scale - 1.0)[low].max() < 0.25
        assert (one.mismatch < 100.0) == (number == 0)
        if number == 0:
            step = (C @ np.linalg.solve(A, (expm(A / np.pi) - np.eye(5)) @ B))[0, 0]
            assert one.step_theirs == pytest.approx(step, rel=0.2)
            assert one.step_ours == pytest.approx(step, rel=0.15)
            figures, lines = found.frequency()
            assert any("PX4's autotune of pitch" in line for line in lines)
            panels = figures[0].axes
            assert any(line.get_linestyle() == "--" and line.get_color() == "C2"
                       for axis in panels for line in axis.lines)  # fmt: skip
