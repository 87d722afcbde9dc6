"""Margins of a flown loop from sines injected at the actuator, and those computed for it."""

from __future__ import annotations

import math

import numpy as np
from host.arrays import Array
from host.control.margins import Margins, margins
from host.control.plant import continuous, sampled
from host.control.scenarios import law_response

from studies.tuned_flights.closed_loop_flight import (
    COMMANDS,
    SENSE,
    ClosedLoop,
    Demand,
    computed_parts,
    fly,
)

PERIOD_S = 20.0
SETTLED_PERIODS = 1
LOWEST_HZ, HIGHEST_HZ, COUNT = 0.1, 16.0, 40
LARGEST_SHARE = 0.08  # of travel: below saturation of travel and of the servo's rate


def harmonics() -> Array:
    """Return whole cycles a period, even in the logarithm; odd ones, as no square law makes."""
    first, last = LOWEST_HZ * PERIOD_S, HIGHEST_HZ * PERIOD_S
    cycles = np.unique(np.round(np.geomspace(first, last, COUNT) / 2.0) * 2.0 + 1.0)
    return np.asarray(cycles)


def sines(steps: int) -> Array:
    """Return one period of all sines together, phases as Schroeder (1970) against peaks."""
    cycles = harmonics()
    phase = -np.pi * np.arange(len(cycles)) ** 2 / len(cycles)
    t = np.arange(steps) / steps
    wave = np.cos(2.0 * np.pi * cycles[:, None] * t + phase[:, None]).sum(axis=0)
    return np.asarray(LARGEST_SHARE * wave / np.max(np.abs(wave)))


def measured(loop: ClosedLoop, axis: str) -> Margins:
    """Return the margins of one axis in calm air, from what comes back of injected sines."""
    period = loop.laws[axis].loop(loop.gains[axis], loop.trim.airspeed_mps).period_s
    steps = round(PERIOD_S / period)
    wave = sines(steps)
    demand = Demand(
        seconds=(SETTLED_PERIODS + 1) * PERIOD_S,
        injected={axis: np.tile(wave, SETTLED_PERIODS + 1)},
    )
    flown = fly(loop, demand)
    if flown.lost:
        lost = np.zeros(1)
        return Margins(lost, lost, lost, lost)
    cycles = harmonics().astype(int)
    back = np.fft.rfft(flown.output[axis][-steps:])[cycles]
    total = np.fft.rfft(flown.total[axis][-steps:])[cycles]
    return margins((-back / total)[None], 2.0 * np.pi * cycles / PERIOD_S)


def computed(loop: ClosedLoop, axis: str) -> Margins:
    """Return the margins of one axis of this very aircraft, from its equations at its trim."""
    system, servo_hz, delay_s = computed_parts(loop, axis)
    law = loop.laws[axis].loop(loop.gains[axis], loop.trim.airspeed_mps)
    travel = loop.full_rad or float(loop.frame.surface_limit_rad[COMMANDS[axis]])
    plant = sampled(
        continuous(axis, system, travel, servo_hz, loop.laws[axis].gyro_filter_hz, SENSE[axis]),
        delay_s,
        law.period_s,
    )
    # As far as sines were injected: beyond it nothing was measured.
    w = np.geomspace(2.0 * math.pi * LOWEST_HZ, 2.0 * math.pi * HIGHEST_HZ, 400)
    w = w[w < 0.98 * np.pi / law.period_s]
    by_angle, by_rate = law_response(law, w)
    seen = plant.response(w)
    return margins(-(by_angle * seen[:, 0] + by_rate * seen[:, 1])[None], w)
