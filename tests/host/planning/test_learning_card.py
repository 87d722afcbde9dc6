"""What the logger is given of an axis: known sensors give a known motion's coefficients back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from host.aircraft.file import load
from host.aircraft.linearisation import linearise
from host.aircraft.mass_properties import airframe_data
from host.aircraft.trim import solve
from host.instrument.deviations import sensor_error_model
from host.physical.calibration import load_calibration
from host.planning.learning_card import (
    NAMES,
    SIX_HARMONICS,
    TEN_HARMONICS,
    LearningCondition,
    learned_axes,
    learning_card,
)
from host.planning.logger_card import logger_card
from host.planning.onboard_sums import PITCH, SIGNALS, AxisCard, FourierSums
from host.twin.testcard.cards import Card, Segment, Tone
from host.wire.card_text import card_lines
from host.wire.flight_card import read_card
from numpy.typing import NDArray
from studies.onboard_equation_error import EquationError

AIRCRAFT, V, RHO = "ultrastick25e", 17.0, 1.225
STEPS = 512  # one whole turn of every harmonic
GYRO_S, VANE_S, POTS_S = 5.3e-3, -1.728e-3, {"de": -2.352e-3, "da": -2.456e-3, "dr": -2.664e-3}
RATE, VANE, POT = 2.664624812204e-4, 6.135923151543e-3 / 8.0, 5.113269292952e-3 / 4.0
Floats = NDArray[np.float64]


def motion(axis: str, harmonics: tuple[int, ...]) -> tuple[Floats, dict[str, float]]:
    """Return counts of one turn as the sensors of the file would give them, and the truth."""
    frame, sizes = load(AIRCRAFT).airframe(), airframe_data(AIRCRAFT)
    sensors = sensor_error_model(AIRCRAFT)
    linear = linearise(frame, solve(frame, V, density_kgpm3=RHO))
    long = axis == PITCH
    keep = [1, 2] if long else [0, 1, 2]
    A = (linear.longitudinal_a if long else linear.lateral_a)[np.ix_(keep, keep)].copy()
    B = (linear.longitudinal_b[:, :1] if long else linear.lateral_b)[keep].copy()
    A[:, 0] *= V
    A[0] /= V
    B[0] /= V
    omega_v = 2.0 * np.pi * sensors.vane_hz_per_mps * V
    t, rng = np.arange(STEPS + 1) / 50.0, np.random.default_rng(4)
    total = np.zeros((len(t), len(SIGNALS[axis])))
    for harmonic in harmonics:
        s = 2j * np.pi * 50.0 / 512.0 * harmonic
        u = 0.02 * np.exp(2j * np.pi * rng.random(B.shape[1]))
        angle, *rates = np.linalg.solve(s * np.eye(len(A)) - A, B @ u)
        arm_s = sensors.vanes_m[0] / V * (1.0 if long else -1.0)
        felt = (angle - arm_s * rates[-1]) * ((1.0 + sensors.upwash) if long else 1.0)
        felt *= np.exp(-s * VANE_S)
        felt /= 1.0 + 2.0 * sensors.vane_damping * s / omega_v + (s / omega_v) ** 2
        surfaces = ("de",) if long else ("da", "dr")
        pots = [x * np.exp(-s * POTS_S[n]) for x, n in zip(u, surfaces, strict=True)]
        counts = [POT * (0.5 if n == "da" else 1.0) for n in surfaces]
        read = [felt / VANE, *(r * np.exp(-s * GYRO_S) / RATE for r in rates)]
        read += [x / c for x, c in zip(pots, counts, strict=True)]
        total += np.real(np.array(read)[None, :] * np.exp(s * t)[:, None])
    inertia = np.array([[sizes.ixx_kgm2, -sizes.ixz_kgm2], [-sizes.ixz_kgm2, sizes.izz_kgm2]])
    row = sizes.iyy_kgm2 * np.r_[A[1], B[1]]
    if not long:
        row = (inertia @ np.hstack([A[1:], B[1:]]))[0 if axis == "roll" else 1]
    length_m = sizes.chord_m if long else sizes.span_m
    row = row / (0.5 * RHO * V**2 * sizes.wing_area_m2 * length_m)
    hats = [2.0 * V / length_m if s in "pqr" else 1.0 for s in SIGNALS[axis]]
    return total, dict(zip(NAMES[axis], row * np.array(hats), strict=True))


def told(axis: str) -> AxisCard:
    harmonics = TEN_HARMONICS if axis == PITCH else SIX_HARMONICS
    at = LearningCondition(V, RHO, harmonics, angle_rate_radps=0.0)  # no friction here
    return learning_card(AIRCRAFT, axis, at)


@pytest.mark.parametrize("axis", ["pitch", "roll", "yaw"])
def test_known_sensors_give_the_coefficients_back(axis: str) -> None:
    card = told(axis)
    counts, truth = motion(axis, card.harmonics)
    sums = FourierSums(card, exact=True)
    for row in np.rint(counts).astype(np.int64):
        sums.take(row)
    solver = EquationError(card, sums, double=True)
    list(solver.slices())
    assert solver.learned is not None
    largest = max(abs(v) for v in truth.values())
    for name, value, half in zip(
        NAMES[axis], solver.learned.estimate, solver.learned.half_width, strict=True
    ):
        assert value == pytest.approx(truth[name], rel=0.03, abs=2e-3 * largest), name
        assert abs(value - truth[name]) <= half


def test_what_the_instrument_leaves_grows_with_its_tolerances() -> None:
    small = told(PITCH)
    calibration = load_calibration()
    lines = dict(calibration.lines)
    for name in ("channel.alpha_a", "channel.alpha_b"):
        lines[name] = replace(lines[name], slope_sigma=0.2, default=False)
    at = LearningCondition(V, RHO, TEN_HARMONICS, angle_rate_radps=0.0)
    large = learning_card(AIRCRAFT, PITCH, at, replace(calibration, lines=lines))
    assert large.tolerance[0] > 1.5 * small.tolerance[0]
    assert large.tolerance[2] < 1.2 * small.tolerance[2]


def test_friction_makes_the_vane_later() -> None:
    at = LearningCondition(V, RHO, TEN_HARMONICS, angle_rate_radps=0.2)
    rubbed, free = learning_card(AIRCRAFT, PITCH, at), told(PITCH)
    assert rubbed.advance_s[0] - free.advance_s[0] == pytest.approx(6.8e-3, rel=0.05)
    assert rubbed.advance_s[1] == free.advance_s[1]


def test_rows_that_move_the_same_axes_teach_them_in_turn() -> None:
    tones = tuple(
        Tone(axis, 12 + k, 0.9, 0.0) for k, axis in enumerate(("elevator", "aileron", "rudder"))
    )
    sines = Segment(
        "multisine",
        axes=("elevator", "aileron", "rudder"),
        amplitudes=(2.0, 2.0, 2.0),
        duration_s=8.0,
        tones=tones,
    )
    roll = Segment("doublet", axes=("aileron",), amplitudes=(2.0,), width_s=0.4)
    card = Card("sines", "", AIRCRAFT, (sines, roll, sines, sines, roll, sines))
    data = logger_card(
        card, load(AIRCRAFT), load_calibration(), learned=learned_axes(AIRCRAFT, card)
    )
    read = read_card(data)
    assert read.teaches == ("pitch", "roll", "roll", "yaw", "roll", "pitch")
    assert card_lines(read)[-1].endswith("; teaches pitch")
    none = logger_card(card, load(AIRCRAFT), load_calibration())
    assert read_card(none).teaches == ("",) * 6
