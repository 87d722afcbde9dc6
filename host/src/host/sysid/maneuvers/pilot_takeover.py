"""Maneuvers that are a pilot's taking over after a test input: he levels, and follows the states.

Windows find his first movement as they find a test input. To a filter it tells as much as one. A
free simulation is another matter: he follows what gusts did to the aircraft, so that what they
leave looks driven by him.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from host.arrays import Array
from host.sysid.maneuvers.maneuver_detection import STILL_RAD, DetectedManeuver
from host.sysid.numerics.state_feedback import feedback_law

# Which way a hand that levels moves a surface.
LEVELLING = {
    "elevator_rad": {"q_radps": 1.0, "theta_rad": 1.0},
    "aileron_rad": {"p_radps": -1.0, "phi_rad": -1.0},
}
# After the jump with which he takes over, until he may leave the sticks again.
FOLLOWS_S = (0.1, 1.5)


def taken_over(
    columns: Mapping[str, Array], maneuver: DetectedManeuver, surfaces: Sequence[str]
) -> bool:
    """Return whether a maneuver is a pilot's taking over: from its start on elevator or aileron
    follow rate and attitude as a hand that levels does.

    Of the independent simulator, gusts of 1 m/s that roll, it names 46 of 51 pulses of the aileron
    with which its pilot takes over, and none of 57 test inputs; of the virtual flights' pilot, who
    is late and scatters, 2 of 76 test inputs (both ailerons of the card `thesis_flight2`).

    Parameters
    ----------
    columns : mapping
        SI columns on an even grid, rows of the maneuver among them.
    maneuver : DetectedManeuver
    surfaces : sequence of str
        That are judged.
    """
    t = columns["t_s"]
    first, last = (maneuver.start_s + after for after in FOLLOWS_S)
    rows = np.flatnonzero((t >= first) & (t <= min(last, maneuver.end_s)))
    if not rows.size:
        return False
    for surface, signs in LEVELLING.items():
        if surface not in surfaces or float(np.std(columns[surface][rows])) < STILL_RAD:
            continue
        signals = {n: columns[n] for n in signs if n in columns}
        law = feedback_law(float(t[1] - t[0]), columns[surface], signals, [rows])
        if law is not None and all(
            signs[name] * gain > 0.0 for name, gain in zip(law.signals, law.gains, strict=True)
        ):
            return True
    return False
