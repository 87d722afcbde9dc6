"""PX4's autotune rule, as the bench flies it against ours."""

from __future__ import annotations

import math

import numpy as np
import pytest
from host.arrays import Array
from host.control.plant import Plant
from studies.tuned_flights.px4_autotune import fitted, gains

MODEL = np.array([-1.6, 0.65, 0.01, 0.04, 0.02])
PERIOD_S = 0.0025


def plant_of(model: Array) -> Plant:
    """Return a plant whose rate answers as a model of that kind; states are y, u of the past."""
    a1, a2, b0, b1, b2 = model
    a = np.zeros((5, 5))  # y(k), y(k-1), u(k-1), u(k-2), and the angle that nobody asks for
    a[0] = [-a1, -a2, b1, b2, 0.0]
    a[1, 0] = a[3, 2] = 1.0
    b = np.array([[b0], [0.0], [1.0], [0.0], [0.0]])
    c = np.array([[0.0, 0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0, 0.0]])
    return Plant(a, b, c, PERIOD_S)


def test_a_plant_of_the_models_own_kind_is_found_whole() -> None:
    assert fitted(plant_of(MODEL), 1.0) == pytest.approx(MODEL, rel=1e-6)
    assert fitted(plant_of(MODEL), 0.5)[2:] == pytest.approx(0.5 * MODEL[2:], rel=1e-6)


def test_the_rule_by_hand() -> None:
    found = gains(MODEL, PERIOD_S)
    # Static gain 0.07 / 0.05.
    assert found["FF"] == pytest.approx(0.05 / 0.07)
    p1, p2 = -2.0 * math.exp(-0.0125 / 0.5), math.exp(-0.0125 / 0.25)
    e1 = 1.0 + 1.6 + p1
    f0 = 1.6 * e1 - 1.6 - 0.65 + e1 + p2
    f1, f2 = -1.6 * e1 - 0.65 * e1 + 0.65, 0.65 * e1
    assert found["P"] == pytest.approx(-(f1 + 2.0 * f2) / (0.4 + (e1 + 1.0) * 0.05))
    assert found["I"] / found["P"] == pytest.approx(-(f0 + f1 + f2) / PERIOD_S / (f1 + 2 * f2) / 5)
    slow = 1.0 / (math.radians(60.0) * (found["P"] + found["FF"]))
    assert found["TC"] == pytest.approx(1.0 / min(max(slow, 1.0), 5.0))
