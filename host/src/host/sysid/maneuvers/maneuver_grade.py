"""What a test point is worth before anyone fits it: amplitude, trim before, noise, feedback."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.sysid.maneuvers.maneuver_detection import FEWEST, RESPONSE_OF, TRIM_S, DetectedManeuver

RESTLESS = 0.25  # of the response before it, or of the input after it: a surface that is not held


@dataclass(frozen=True, slots=True)
class Grade:
    """Worth of a test point before anyone fits it.

    `score` is 0 to 1; `remarks` name what is wrong in words.
    """

    score: float
    response_over_noise: float
    trim_quiet: float
    feedback: float
    remarks: tuple[str, ...]


def grade(columns: Mapping[str, Array], item: DetectedManeuver) -> Grade:
    """Grade one maneuver: amplitude, trim before, noise, pilot feedback."""
    if RESPONSE_OF[item.axis] not in columns:
        return Grade(0.0, 0.0, 0.0, 0.0, (f"no {RESPONSE_OF[item.axis]}: cannot be graded",))
    t = np.asarray(columns["t_s"], dtype=np.float64)
    # Only this part of a flight of an hour is looked at.
    near = slice(*np.searchsorted(t, (item.start_s - 2.0 * TRIM_S, item.end_s + TRIM_S)))
    t = t[near]
    response = np.nan_to_num(np.asarray(columns[RESPONSE_OF[item.axis]][near], dtype=np.float64))
    surface = np.nan_to_num(np.asarray(columns[item.axis][near], dtype=np.float64))
    inside = (t >= item.start_s) & (t <= item.end_s)
    before = (t >= item.start_s - TRIM_S) & (t < item.start_s)
    after = (t > item.input_end_s + 0.3) & (t <= item.end_s)
    # Noise of the trim before: between slow rows, as a radio's, the motion itself turns.
    # The second difference of white noise has six times its power: 1 + 4 + 1.
    still = before if before.sum() > FEWEST else inside
    noise = (
        float(np.std(np.diff(response[still], n=2))) / np.sqrt(6.0) if still.sum() > FEWEST else 0.0
    )
    power = float(np.std(response[inside])) if inside.any() else 0.0
    ratio = power / max(noise, 1e-12)
    # Neither is known of a record that was cut to its input, and neither counts against it.
    trim = float(np.std(response[before])) / max(power, 1e-12) if before.sum() > 4 else 0.0
    feedback = (
        float(np.std(surface[after])) / max(item.amplitude, 1e-12) if after.sum() > 4 else 0.0
    )
    remarks = []
    if ratio < 5.0:
        remarks.append(f"response only {ratio:.1f} times its noise: fly a larger input")
    if trim > RESTLESS:
        remarks.append(f"not trimmed before: {100.0 * trim:.0f} % of the response")
    if feedback > RESTLESS:
        remarks.append(
            f"pilot corrects during the response ({100.0 * feedback:.0f} % of the input)"
        )
    if after.sum() < 4 or item.end_s - item.input_end_s < 1.0:
        remarks.append("response cut short: wait before the next input")
    score = float(
        np.clip(ratio / 20.0, 0.0, 1.0)
        * np.clip(1.0 + RESTLESS - trim, 0.0, 1.0)
        * np.clip(1.0 + RESTLESS - feedback, 0.0, 1.0)
    )
    return Grade(score, ratio, trim, feedback, tuple(remarks))
