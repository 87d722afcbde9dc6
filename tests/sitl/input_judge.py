"""What the servos may have seen of a flight with inputs, from the script and the card alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from host.twin.recorder.sitl_library import TICKS_PER_S
from numpy.typing import NDArray

from tests.sitl.input_flight import LEAST_US, MOST_US, THROTTLE, InputFlight

Pulses = tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.uint16]]
MEMORY_S = 0.1  # a pulse repeats a width accepted in the last 100 ms
LAG_S = 0.065  # a servo period, and what the rate's whole ticks lose
STEP_TICKS = 3


@dataclass(frozen=True, slots=True)
class Trigger:
    """An input that may run: from when, until when at most, and its deflections by time.

    Attributes
    ----------
    start_s, end_s : float
        No deflected pulse begins before the one or behind the other.
    quiet_s : float
        Between the trigger and the shape.
    deflection : (milliseconds, 3) array
        Ticks, 1 ms apart from the beginning of the shape.
    held_ticks : (3,) sequence
        Authority over each axis that the row holds, from the trigger on; else 0.
    """

    start_s: float
    end_s: float
    quiet_s: float
    deflection: NDArray[np.float64]
    held_ticks: Sequence[float] = (0.0, 0.0, 0.0)


def slewed(shape: NDArray[np.float64], rate_usps: float) -> NDArray[np.float64]:
    """Return the shape, 1 ms a row, followed no faster than the rate."""
    most = 2.0 * rate_usps / 1000.0
    out = np.zeros_like(shape)
    at = np.zeros(shape.shape[1])
    for i, target in enumerate(shape):
        at = at + np.clip(target - at, -most, most)
        out[i] = at
    return out


def wrong_pulses(
    pulses: Pulses, flight: InputFlight, trigger: Trigger | None, *, near: int = 0
) -> list[str]:
    """Return what is wrong: pulses that are neither the pilot's nor the card's, travel exceeded.

    A pulse is the pilot's when a width of the receiver is `near` ticks or less away. The deflection
    is compared on its way: within what the card asked for in the last `LAG_S`.
    """
    receiver = flight.receiver()
    wrong = []
    start, output, width = pulses
    for channel in range(4):
        mine = output == channel
        falls = receiver.start[:, channel] + receiver.width[:, channel]
        widths = receiver.width[:, channel]
        order = np.searchsorted(falls, start[mine])
        for at, ticks, newest in zip(
            start[mine].tolist(), width[mine].tolist(), order.tolist(), strict=True
        ):
            oldest = np.searchsorted(falls, at - round(MEMORY_S * TICKS_PER_S))
            base = widths[oldest:newest]
            base = base[base > 0]
            if np.any(np.abs(base - ticks) <= near):
                continue
            why = _card_made(at / TICKS_PER_S, channel, ticks, base, trigger, near)
            if why:
                wrong.append(f"servo {channel} at {at / TICKS_PER_S:.4f} s: {ticks / 2} us, {why}")
    return wrong


def _card_made(
    at_s: float,
    channel: int,
    ticks: int,
    base: NDArray[np.int64],
    trigger: Trigger | None,
    near: int,
) -> str:
    if channel == THROTTLE:
        return "the throttle is nobody's but the pilot's"
    if trigger is None or not trigger.start_s <= at_s <= trigger.end_s:
        return "not the pilot's, and no input may run"
    if not 2 * LEAST_US - near <= ticks <= 2 * MOST_US + near:
        return "beyond the travel shown"
    ms = round((at_s - trigger.start_s - trigger.quiet_s) * 1000)
    lag = round(LAG_S * 1000)
    window = trigger.deflection[max(0, ms - lag) : max(0, ms) + 2, channel]
    if held := trigger.held_ticks[channel]:
        low, high = -held, held
    elif not window.size:
        return "before the shape" if ms < 0 else "behind the shape"
    elif ms > lag + 5:
        low, high = window.min(), window.max()
    else:
        low, high = min(0.0, window.min()), max(0.0, window.max())
    slack = STEP_TICKS + near
    if np.any((ticks - base >= low - slack) & (ticks - base <= high + slack)):
        return ""
    return f"deflected by none of {low:.0f} to {high:.0f} ticks"


def deflected(
    pulses: Pulses, flight: InputFlight, start_s: float, *, near: int = 0
) -> NDArray[np.int64]:
    """Return the starts (ticks) of surface pulses behind `start_s` that are not the pilot's."""
    receiver = flight.receiver()
    start, output, width = pulses
    found = []
    for channel in range(3):
        mine = (output == channel) & (start >= start_s * TICKS_PER_S)
        falls = receiver.start[:, channel] + receiver.width[:, channel]
        for at, ticks in zip(start[mine].tolist(), width[mine].tolist(), strict=True):
            newest = np.searchsorted(falls, at)
            oldest = np.searchsorted(falls, at - round(MEMORY_S * TICKS_PER_S))
            base = receiver.width[oldest:newest, channel]
            if not np.any(np.abs(base - ticks) <= near):
                found.append(at)
    return np.array(sorted(found), dtype=np.int64)
