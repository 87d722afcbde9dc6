"""The receiver's pulses on the Mega's five pins, and how they fail."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from host.aircraft.airframe import Array
from host.twin.faults import Fault
from host.twin.flight.fly import RC_PERIOD_S, FlightRecord
from host.twin.flight.stick_commands import GAP_US
from host.twin.sensors.mega_clock import Ticks, ticks

EDGE = np.dtype([("at", np.int64), ("levels", np.uint8)])
GLITCH_S = (50e-6, 4e-3)


def edges(record: FlightRecord) -> NDArray[np.void]:
    """Return every edge: pulses one after the other, as a Futaba receiver of that time sends them.

    Parameters
    ----------
    record : FlightRecord

    Returns
    -------
    (n,) structured array
        ``at`` in Mega ticks, ``levels`` of the five lines behind it: bit 0 aileron, elevator,
        rudder, throttle, switch.
    """
    out = frame_edges(record, slice(None))
    keep = np.ones(record.pulses_us.shape, dtype=bool)
    for fault in record.card.faults:
        inside = fault.inside(record.pulse_starts_s)
        if fault.kind == "receiver_lost":
            keep[inside] = False
        elif fault.kind == "receiver_channel_lost":
            keep[inside, fault.place] = False
    out = out[np.repeat(keep.ravel(), 2)]
    rng = np.random.default_rng([record.seed, 13])
    for fault in record.card.faults:
        if fault.kind == "receiver_glitch":
            out = _merged(out, *_glitches(record, fault, rng), fault.place)
        elif fault.kind == "receiver_storm":
            half_s = 0.5 / fault.amount
            flips = np.arange(fault.at_s, min(fault.end_s, float(record.t_s[-1])), half_s)
            flips = flips[: len(flips) // 2 * 2]
            out = _merged(out, ticks(record, flips[0::2]), ticks(record, flips[1::2]), fault.place)
    return out


def frame_edges(record: FlightRecord, frames: slice) -> NDArray[np.void]:
    """Return the edges of some frames of a receiver without a fault, as `edges`."""
    widths_s = record.pulses_us[frames] * 1e-6
    starts = record.pulse_starts_s[frames, None] + np.concatenate(
        [np.zeros((len(widths_s), 1)), np.cumsum(widths_s[:, :-1] + GAP_US * 1e-6, axis=1)], axis=1
    )
    out = np.zeros(2 * widths_s.size, dtype=EDGE)
    out["at"][0::2] = ticks(record, starts.ravel())
    out["at"][1::2] = ticks(record, (starts + widths_s).ravel())
    out["levels"][0::2] = np.tile(1 << np.arange(widths_s.shape[1]), len(widths_s))
    return out


def _glitches(record: FlightRecord, fault: Fault, rng: np.random.Generator) -> tuple[Ticks, Ticks]:
    """Return rise and fall of pulses in the silence behind some frames."""
    frames = record.pulse_starts_s[fault.inside(record.pulse_starts_s)]
    frames = frames[rng.random(len(frames)) < fault.amount]
    busy_s = float((record.pulses_us.sum(axis=1).max() + 5 * GAP_US) * 1e-6)
    width_s = GLITCH_S[0] * (GLITCH_S[1] / GLITCH_S[0]) ** rng.random(len(frames))
    rise_s: Array = frames + busy_s + rng.random(len(frames)) * (RC_PERIOD_S - busy_s - width_s)
    return ticks(record, rise_s), ticks(record, rise_s + width_s)


def _merged(clean: NDArray[np.void], rise: Ticks, fall: Ticks, line: int) -> NDArray[np.void]:
    """Add pulses on one line: it is high while either source drives it."""
    bit = 1 << line
    levels = clean["levels"].astype(np.int64)
    at = np.concatenate([clean["at"], rise, fall])
    before = np.concatenate([[0], levels[:-1]])
    change = np.concatenate(
        [
            ((levels & bit) > 0).astype(np.int64) - ((before & bit) > 0),
            np.ones(len(rise), dtype=np.int64),
            -np.ones(len(fall), dtype=np.int64),
        ]
    )
    order = np.argsort(at, kind="stable")
    high = np.cumsum(change[order]) > 0
    # The other lines stand as the clean edge before left them.
    own = np.concatenate([np.arange(len(clean)), np.full(len(rise) + len(fall), -1)])
    last = np.maximum.accumulate(own[order])
    others = np.where(last >= 0, levels[np.maximum(last, 0)] & ~bit, 0)
    out = np.zeros(len(at), dtype=EDGE)
    out["at"], out["levels"] = at[order], others | np.where(high, bit, 0)
    changed = np.concatenate([[True], out["levels"][1:] != out["levels"][:-1]])
    return np.asarray(out[changed])
