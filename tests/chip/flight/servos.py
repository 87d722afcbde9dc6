"""What the servos saw behind the relay, judged against what the receiver sent."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from flight.rig import FlightRig

# Whether the card may have made a pulse: its start, its width, the sticks' widths by then; cycles.
Made = Callable[[int, int, NDArray[np.int64]], bool]

MS = 16_000
SERVOS = ("aileron", "elevator", "rudder", "throttle")
LONGEST_GAP_MS = 110


def released_ms(rig: FlightRig, since: int) -> float:
    """Time from a cycle to the moment the Mega's contact opens for good."""
    assert not rig.relay.engaged
    last_mega = max(cycle for cycle, state in rig.relay.contacts if state == 2)
    opened = next(cycle for cycle, state in rig.relay.contacts if cycle > last_mega and state != 2)
    return max(0, opened - since) / MS


def worst_gap_ms(rig: FlightRig, since: int, *, servos: tuple[str, ...] = SERVOS) -> float:
    """Longest time between the starts of two pulses at any servo, the end of the run included."""
    worst = 0
    for servo in servos:
        starts = rig.relay.servo_pulses(servo)[:, 0]
        starts = starts[starts > since - 30 * MS]
        edges = np.concatenate((starts, [rig.chip.cycle]))
        worst = max(worst, int(np.diff(edges).max()))
    return worst / MS


def strange(rig: FlightRig, since: int, servo: str) -> Iterator[tuple[int, int, NDArray[np.int64]]]:
    """Give pulses at a servo that are not within 5 us of one the receiver sent in the last 120 ms.

    Each comes with its start and width, and the widths sent by then, all in cycles.
    """
    channel = SERVOS.index(servo)
    sent = np.array([(end - start, end) for c, start, end in rig.receiver.sent if c == channel])
    pulses = rig.relay.servo_pulses(servo)
    for start, end in pulses[pulses[:, 0] >= since].tolist():
        recent = sent[(sent[:, 1] > start - 120 * MS) & (sent[:, 1] < end + MS), 0]
        if not np.any(np.abs(recent - (end - start)) <= 80):
            yield start, end - start, recent


def nobodys(start: int, width: int, sticks: NDArray[np.int64]) -> bool:
    """No input may be flown: what is not the pilot's is spoilt."""
    return False


def spoiled(rig: FlightRig, since: int, servo: str, made: Made = nobodys) -> int:
    """Count pulses at a servo that are neither the pilot's nor, by `made`, the card's.

    A bouncing contact cuts one pulse into several: pieces less than 3 ms apart count as one.
    """
    count = 0
    last = -MS * 100
    for start, width, sticks in strange(rig, since, servo):
        if made(start, width, sticks):
            continue
        count += start - last > 3 * MS
        last = start + width
    return count


def cuts_allowed(rig: FlightRig, since: int) -> int:
    """Pulses the relay may cut since a cycle: one as a contact breaks, one as the other makes."""
    return 2 * changes(rig, since)


def changes(rig: FlightRig, since: int) -> int:
    """Change-overs of the relay since a cycle."""
    states = [state for cycle, state in rig.relay.contacts if state != 0 and cycle > since]
    before = [state for cycle, state in rig.relay.contacts if state != 0 and cycle <= since][-1]
    return int(np.count_nonzero(np.diff([before, *states])))
