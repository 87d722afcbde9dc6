"""The gains that the University of Minnesota flew on the Ultra Stick 25e, on its published model.

OpenFlight's heading_tracker.c at 50 Hz; servo of 6 Hz, 50 ms and 20 ms of delay
(OpenFlightAnalysis, US25e_Lin.py). Margins of the same loops computed here with every other
loop closed: aileron 6.8 rad/s, 63 degrees, 6.4 dB, disk 0.65; elevator 4.6, 84, 6.0, 0.63.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from host.aircraft.linear_aircraft import load
from host.aircraft.linearisation import linearise
from host.aircraft.trim import solve
from host.arrays import Array
from host.control.margins import Margins, margins
from host.control.plant import continuous, sampled
from host.control.scenarios import law_response

GAINS = {"roll": (0.64, 0.20, 0.07), "pitch": (0.90, 0.30, 0.08)}
STATES = {
    "roll": ("v_mps", "p_radps", "r_radps", "phi_rad"),
    "pitch": ("u_mps", "w_mps", "q_radps", "theta_rad"),
}


@dataclass(frozen=True)
class Tracker:
    """Angle with its integral, updated first, less the rate: radians of surface."""

    p: float
    i: float
    damping: float
    period_s: float = 0.02
    states: int = 1

    def step(self, state: Array, angle_error: Array, rate: Array) -> tuple[Array, Array]:
        integral = state[..., 0] + angle_error * self.period_s
        out = self.p * angle_error + self.i * integral - self.damping * rate
        return np.stack([integral], axis=-1), out


def published(axis: str, delay_s: float) -> Margins:
    frame = load("ultrastick25e_linear17").airframe()
    linear = linearise(frame, solve(frame, 17.0))
    pair = {
        "roll": (linear.lateral_a, linear.lateral_b[:, :1]),
        "pitch": (linear.longitudinal_a, linear.longitudinal_b),
    }[axis]
    # Theirs is positive trailing edge down on the right: the sense is that of the moment.
    sense = {"roll": 1.0, "pitch": -1.0}[axis]
    system = continuous(axis, (*pair, STATES[axis]), 1.0, 6.0, 1e4, sense)
    w = np.geomspace(0.05, 0.98 * np.pi / 0.02, 4000)
    seen = sampled(system, delay_s, 0.02).response(w)
    by_angle, by_rate = law_response(Tracker(*GAINS[axis]), w)
    return margins(-(by_angle * seen[:, 0] + by_rate * seen[:, 1])[None], w)


@pytest.mark.parametrize(
    ("axis", "delay_s", "crossover", "phase", "gain", "disk"),
    [
        ("roll", 0.07, 6.8, 63.0, 6.4, 0.65),
        ("pitch", 0.07, 4.6, 84.0, 6.0, 0.63),
        ("roll", 0.02, None, None, 12.5, 1.08),
        ("pitch", 0.02, None, None, 11.8, 1.03),
    ],
)
def test_margins_of_the_flown_gains(
    axis: str,
    delay_s: float,
    crossover: float | None,
    phase: float | None,
    gain: float,
    disk: float,
) -> None:
    # The rudder's damper is open here: that is what is left between the two.
    found = published(axis, delay_s)
    assert found.gain_db[0] == pytest.approx(gain, abs=0.8)
    assert found.disk[0] == pytest.approx(disk, abs=0.04)
    if crossover is not None and phase is not None:
        assert found.crossover_radps[0] == pytest.approx(crossover, rel=0.06)
        assert found.phase_deg[0] == pytest.approx(phase, abs=4.0)
