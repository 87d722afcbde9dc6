"""Inputs of a segment that has no steps: multisines and sweeps."""

from __future__ import annotations

from host.aircraft.airframe import Array
from host.twin.testcard.cards import Segment
from host.twin.testcard.input_shapes import (
    multisine,
    multisine_signal,
    sweep_signal,
    tone_signal,
)


def sine_inputs(s: Segment, t_s: Array) -> list[Array]:
    """Return the inputs of a multisine or a sweep in units of their amplitude, one per axis.

    Parameters
    ----------
    s : Segment
        Segment of a kind that has no steps.
    t_s : Array, shape (n,)
        Time from the start of the input.
    """
    if s.tones:
        return [tone_signal(t_s, s.duration_s, s.tones_of(axis)) for axis in s.axes]
    if s.kind == "multisine":
        sums = multisine(s.duration_s, s.low_hz, s.high_hz, len(s.axes))
        return [multisine_signal(t_s, s.duration_s, *one) for one in zip(*sums, strict=True)]
    return [sweep_signal(t_s, s.duration_s, s.low_hz, s.high_hz)] * len(s.axes)
