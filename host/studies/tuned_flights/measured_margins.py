"""Margins of a flown loop from sines injected at the actuator, and those computed for it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from host.aircraft.linearisation import Linear, linearise
from host.aircraft.trim import Trim
from host.arrays import Array
from host.control.actuator import PULSE_PERIOD_S
from host.control.lateral_pair import PairScenarios, pair_system
from host.control.margins import Margins, Spectra, margins
from host.control.plant import Plant, continuous, sampled
from host.control.scenarios import law_response

from studies.tuned_flights.closed_loop_flight import SENSE, ClosedLoop, Demand, fly

PERIOD_S = 20.0
SETTLED_PERIODS = 1
LOWEST_HZ, HIGHEST_HZ, COUNT = 0.1, 16.0, 40
LATERAL = ("v_mps", "p_radps", "r_radps", "phi_rad")
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


def measured(loops: Sequence[ClosedLoop], axis: str) -> Margins:
    """Return the margins of one axis in calm air, from what comes back of injected sines.

    Those of a lost aircraft are 0.
    """
    first = loops[0]
    period = first.laws["roll"].loop(first.gains["roll"], first.trim.airspeed_mps).period_s
    steps = round(PERIOD_S / period)
    wave = sines(steps)
    demand = Demand(
        seconds=(SETTLED_PERIODS + 1) * PERIOD_S,
        injected={axis: np.tile(wave, SETTLED_PERIODS + 1)},
    )
    flown = fly(loops, demand)
    cycles = harmonics().astype(int)
    back, total = (
        np.fft.rfft([one[axis][-steps:] for one in kept])[:, cycles]
        for kept in ([one.output for one in flown], [one.total for one in flown])
    )
    kept = np.array([not one.lost for one in flown])
    with np.errstate(all="ignore"):  # of a lost one there may be nothing
        found = margins(-back / total, 2.0 * np.pi * cycles / PERIOD_S)
    return Margins(*(np.where(kept, one, 0.0) for one in (
        found.gain_db, found.phase_deg, found.disk, found.crossover_radps)))  # fmt: skip


def computed(loop: ClosedLoop, axis: str) -> Margins:
    """Return the margins of one axis of this very aircraft, from its equations at its trim."""
    linear = linearise(loop.frame, loop.trim)
    lead = "pitch" if axis == "pitch" else "roll"
    law = loop.laws[lead]
    own = law.loop(loop.gains[lead], loop.trim.airspeed_mps)
    # As far as sines were injected: beyond it nothing was measured.
    w = np.geomspace(2.0 * math.pi * LOWEST_HZ, 2.0 * math.pi * HIGHEST_HZ, 400)
    w = w[w < 0.98 * np.pi / own.period_s]
    # A law as slow as the pulses waits for the next; of a faster one pulses hold what they meet.
    pulsed = own.period_s < PULSE_PERIOD_S
    delay_s = 0.0 if pulsed else loop.pulse_s
    servo_hz = loop.frame.servo_bandwidth_radps / (2.0 * math.pi)
    if loop.pair is not None and axis != "pitch":
        drives = np.array([[loop.full_travel_rad(one), servo_hz] for one in ("roll", "yaw")])
        system = pair_system(
            _by_sideslip(linear, loop.trim), drives, (SENSE["roll"], SENSE["yaw"]),
            law.gyro_filter_hz,
        )  # fmt: skip
        plant = _flown(sampled(system, delay_s, own.period_s), pulsed)
        here = replace(loop.pair.roll, airspeeds_mps=(loop.trim.airspeed_mps,))
        no_gusts = np.zeros((1, 1, len(w), 4), dtype=complex)
        seen = PairScenarios(
            replace(loop.pair, roll=here), w, ((plant,),), no_gusts, np.zeros((1, len(w)))
        )
        aileron, rudder, _ = seen.judged(loop.gains["yaw"])
        return aileron if axis == "roll" else rudder
    dynamics = (
        (linear.longitudinal_a, linear.longitudinal_b, ("u_mps", "w_mps", "q_radps", "theta_rad"))
        if axis == "pitch"
        else (linear.lateral_a, linear.lateral_b[:, :1], LATERAL)
    )
    travel_rad = loop.full_travel_rad(axis)
    system = continuous(axis, dynamics, travel_rad, servo_hz, law.gyro_filter_hz, SENSE[axis])
    plant = _flown(sampled(system, delay_s, own.period_s), pulsed)
    by_angle, by_rate = law_response(own, w)
    response = plant.response(w)
    return margins(-(by_angle * response[:, 0] + by_rate * response[:, 1])[None], w)


class _Pulsed(Plant):
    """A plant whose input is held from pulse to pulse in place of step to step."""

    def transfer(self, frequency_radps: Array) -> Spectra:
        s = 1j * frequency_radps
        longer, usual = ((1.0 - np.exp(-s * t)) / t for t in (PULSE_PERIOD_S, self.period_s))
        return np.asarray((longer / usual)[:, None, None] * super().transfer(frequency_radps))


def _flown(plant: Plant, pulsed: bool) -> Plant:
    return _Pulsed(plant.a, plant.b, plant.c, plant.period_s) if pulsed else plant


def _by_sideslip(linear: Linear, trim: Trim) -> tuple[Array, Array, tuple[str, ...]]:
    """Return the lateral A, B and states with the sideslip in place of the side speed."""
    scale = np.array([trim.airspeed_mps, 1.0, 1.0, 1.0])
    a = linear.lateral_a * scale / scale[:, None]
    return a, linear.lateral_b / scale[:, None], ("beta_rad", *LATERAL[1:])
