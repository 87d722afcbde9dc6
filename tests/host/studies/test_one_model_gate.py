"""The gate of the whole flight as one model: its aircraft are those stated, its limits bite."""

from dataclasses import replace

import numpy as np
import pytest
from studies.field_records.ranges import draw
from studies.field_records.record_flight import drawn_aircraft
from studies.field_records.true_derivatives import true_derivatives
from studies.foreign.aeroplane import FLYING_WING
from studies.foreign.flight import SPEED_MPS, Air, fly
from studies.one_model_gate.gate_cells import CELLS
from studies.one_model_gate.gate_limits import lines
from studies.one_model_gate.worn_coefficients import coefficients_of

CELL = "twin, 0 m/s"


def test_the_flying_wing_turns_as_its_coefficients_say() -> None:
    _, true = fly(Air(), 0, FLYING_WING)
    a, V = FLYING_WING, true["airspeed_mps"]
    force = 0.5 * 1.2 * V**2 * a.area * a.chord
    q_hat = true["q_radps"] * a.chord / (2.0 * V)
    told = a.Cm_0 + a.Cm_alpha * true["alpha_rad"] + a.Cm_q * q_hat + a.Cm_de * true["elevator_rad"]
    inside = (true["t_s"] > 34.0) & (true["t_s"] < 37.0)
    turning = np.gradient(true["q_radps"], true["t_s"])[inside]
    left = turning - (force * told / a.iyy)[inside]
    assert np.median(np.abs(left)) < 0.005 * np.ptp(turning)  # it is late where servos start


def test_coefficients_of_a_worn_aircraft_are_its_own_at_the_trim() -> None:
    rng = np.random.default_rng(3)
    by = draw(rng)
    no_wake = replace(by, values={**by.values, "downwash": 0.0, "sidewash": 0.0})
    plane = drawn_aircraft(rng, no_wake)
    dimensional = true_derivatives(plane, SPEED_MPS, plane.trim_alpha, plane.trim_de)
    found = coefficients_of(plane, dimensional, SPEED_MPS, plane.trim_alpha)
    for name, value in found.items():
        if name not in ("CD_alpha", "CD_q", "CD_de"):
            expected = getattr(plane, name, 0.0)
            assert value == pytest.approx(expected, rel=1e-3, abs=1e-4), name
    lift = 2.0 * plane.CD_CL2 * plane.trim_lift
    assert found["CD_alpha"] == pytest.approx(lift * plane.CL_alpha, rel=1e-3)


@pytest.mark.parametrize(
    ("off", "half", "said"),
    [
        (0.01, 0.04, "passed"),
        (0.06, 0.04, "coverage"),
        (0.01, 0.12, "score above"),
        (0.02, 0.04, "mean error of Cm_q"),
    ],
)
def test_each_limit_is_missed_by_what_it_is_for(off: float, half: float, said: str) -> None:
    def rows(off: float, half: float, *, turns: bool) -> list[dict[str, str]]:
        return [
            {
                "world": CELL, "seed": str(seed), "name": name, "true": "1", "reference": "1",
                "estimate": str(1.0 + off * (1.0 + 0.01 * seed) * (-1.0) ** (turns * seed)),
                "half_width": str(half), "mark": "trust", "cpu_s": "1",
            }
            for seed in range(8)
            for name in CELLS[CELL].names
        ]  # fmt: skip

    trial, standard = rows(off, half, turns=off != 0.02), rows(0.05, 0.1, turns=True)
    assert said in list(lines({CELL: trial}, {CELL: standard}))[-1]
