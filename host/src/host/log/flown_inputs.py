"""Test inputs that the logger flew itself: from its events, to the microsecond.

An ``input_start`` names the row, whose shape begins its quiet time later; ``input_end`` names the
reason, and from there on the sticks pass plainly (protocol/frames.toml).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from host.wire.flight_card import AXES, held_axes, number, read_row

if TYPE_CHECKING:
    from host.log.flight_log import FlightLog
    from host.physical.session import Session

UNKNOWN = "unknown"  # stands for a shape or reason that the log lost


@dataclass(frozen=True, slots=True)
class FlownInput:
    """One row as it was flown.

    Attributes
    ----------
    row : int
        Row of the flight card, counted from 0.
    start_s, end_s : float
        Begin and end of the shape, in the time of the table.
    shape, reason : str
        Names of ``card_shape`` and of ``input_end``.
    amplitude_us : tuple of float
        Aileron, elevator, rudder; zeros where the log lost the row.
    held : tuple of str
        Surfaces that the logger moved to hold bank and pitch: they are feedback, not input.
    triggered_s : float
        When the row began: it holds from there on, its quiet time included.
    """

    row: int
    start_s: float
    end_s: float
    shape: str
    reason: str
    amplitude_us: tuple[float, ...]
    held: tuple[str, ...] = ()
    triggered_s: float = 0.0

    @property
    def axes(self) -> tuple[str, ...]:
        """Surfaces that it moves."""
        return tuple(a for a, size in zip(AXES, self.amplitude_us, strict=True) if size)


def flown_inputs(log: FlightLog) -> list[FlownInput]:
    """Return the inputs of a log whose shape began, in order of time.

    Parameters
    ----------
    log : FlightLog
    """
    return [one for session in log.sessions for one in inputs_of_session(session)]


def inputs_of_session(session: Session) -> list[FlownInput]:
    """Return the inputs of one session, as `flown_inputs` does of all."""
    schema = session.store.schema
    codes = schema.enums.get("event", {})
    if not {"input_start", "input_end"} <= set(codes):
        return []
    events, t_us = session.slow("event")
    begins, ends = codes["input_start"], codes["input_end"]
    rows = _rows(session)
    reasons = {value: name for name, value in schema.enums.get("input_end", {}).items()}
    shapes = {value: name for name, value in schema.enums.get("card_shape", {}).items()}
    found: list[FlownInput] = []
    begun: tuple[int, float] | None = None

    def close(end_us: float | None, reason: str) -> None:
        if begun is None:
            return
        row, at_us = begun
        known = rows.get(row)
        first_us = at_us + 1000.0 * (known["quiet_ms"] if known else 0)
        last_us = end_us
        if last_us is None and known:
            last_us = first_us + 1000.0 * known["duration_ms"]
        if last_us is None or last_us <= first_us:
            return
        times_us = np.array([at_us, first_us, last_us])
        triggered_s, start_s, end_s = session.seconds(times_us).tolist()
        sizes = tuple(map(float, known["amplitude_us"])) if known else (0.0, 0.0, 0.0)
        shape = shapes.get(known["shape"], UNKNOWN) if known else UNKNOWN
        held = held_axes(known) if known else ()
        found.append(FlownInput(row, start_s, end_s, shape, reason, sizes, held, triggered_s))

    for event, at_us in zip(events, t_us.tolist(), strict=True):
        code, arg = int(event["code"]), int(event["arg"])
        if code == begins:
            close(None, UNKNOWN)
            begun = arg & 255, at_us
        elif code == ends and begun is not None:
            close(at_us, reasons.get(arg >> 8 & 255, UNKNOWN))
            begun = None
    close(None, UNKNOWN)
    return found


def _rows(session: Session) -> dict[int, dict[str, Any]]:
    """Return the card's rows that the session recorded, by number."""
    if "card" not in session.store.schema.by_name:
        return {}
    frames, _ = session.slow("card")
    heads = number("card_head_parts")
    return {
        int(frame["part"]) - heads: read_row(frame["bytes"].tobytes())
        for frame in frames
        if int(frame["part"]) >= heads
    }
