"""What the card wants of a test point, as a movement of the surface."""

from __future__ import annotations

import math

import numpy as np

from host.aircraft.airframe import Array
from host.planning.aircraft_response import STEP_S, AircraftResponse
from host.twin.testcard.cards import Segment, input_s
from host.twin.testcard.input_shapes import STEPS, staircase
from host.twin.testcard.sine_inputs import sine_inputs

SURFACES = ("elevator", "aileron", "rudder")
RESPONSE_S = 3.0  # behind the input, as the finder's window
HAND_S = 0.08  # a good one


def wanted_surfaces(segment: Segment, response: AircraftResponse) -> dict[str, Array]:
    """Return deflections of every surface, rad, every `STEP_S`, with the response behind.

    Parameters
    ----------
    segment : Segment
        A test point of a card.
    response : AircraftResponse
        Gives the servo's lag.
    """
    t = np.arange(0.0, input_s(segment) + RESPONSE_S, STEP_S)
    out = {name: np.zeros(len(t)) for name in SURFACES}
    for axis, amplitude, wave in zip(
        segment.axes, segment.amplitudes, _waves(segment, t), strict=True
    ):
        if axis in out:
            out[axis] += math.radians(amplitude) * _behind_servo(wave, response.servo_radps)
    return out


def _waves(segment: Segment, t: Array) -> list[Array]:
    if segment.kind in STEPS:
        lengths = np.array([length for _, length in STEPS[segment.kind]]) * segment.width_s
        switches = np.concatenate([[0.0], np.cumsum(lengths)])
        levels = np.array([sign for sign, _ in STEPS[segment.kind]])
        return [staircase(t, switches, levels, HAND_S)] * len(segment.axes)
    return sine_inputs(segment, t)


def _behind_servo(wave: Array, servo_radps: float) -> Array:
    out = np.zeros(len(wave))
    share = 1.0 - math.exp(-servo_radps * STEP_S)
    for k in range(1, len(wave)):
        out[k] = out[k - 1] + share * (wave[k - 1] - out[k - 1])
    return out
