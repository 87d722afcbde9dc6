"""What the servos saw behind the relay, judged against what the receiver sent."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from flight.rig import FlightRig

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


def spoiled(rig: FlightRig, since: int, servo: str) -> int:
    """Pulses at a servo that are not within 5 us of one the receiver sent in the last 120 ms.

    A bouncing contact cuts one pulse into several: pieces less than 3 ms apart count as one.
    """
    channel = SERVOS.index(servo)
    sent = np.array([(end - start, end) for c, start, end in rig.receiver.sent if c == channel])
    count = 0
    last = -MS * 100
    for start, end in rig.relay.servo_pulses(servo):
        if start < since:
            continue
        recent = sent[(sent[:, 1] > start - 120 * MS) & (sent[:, 1] < end + MS), 0]
        if np.any(np.abs(recent - (end - start)) <= 80):
            continue
        count += start - last > 3 * MS
        last = end
    return count


def cuts_allowed(rig: FlightRig, since: int) -> int:
    """Pulses the relay may cut since a cycle: one as a contact breaks, one as the other makes."""
    return 2 * changes(rig, since)


def changes(rig: FlightRig, since: int) -> int:
    """Change-overs of the relay since a cycle."""
    states = [state for cycle, state in rig.relay.contacts if state != 0 and cycle > since]
    before = [state for cycle, state in rig.relay.contacts if state != 0 and cycle <= since][-1]
    return int(np.count_nonzero(np.diff([before, *states])))
