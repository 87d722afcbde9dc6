"""Tests that the autopilot flew by itself: identification chirps, autotune, doublets.

ArduPilot: SIDD (a system-identification chirp), ATRP and mode AUTOTUNE (a plane tunes an axis with
steps of the stick or its own), texts of scripts that name a doublet. PX4:
autotune_attitude_control_status, whose state is above zero while it moves an axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host.arrays import Array, BoolArray
from host.readers.autopilot_log import AutopilotLog

PLANE_AUTOTUNE = 8  # ArduPlane mode number
GAP_S = 2.0  # of messages of a test that go on
SHORTEST_S = 0.5
DOUBLET_S = 5.0  # assumed length of a doublet that only a text names


@dataclass(frozen=True, slots=True)
class FlownTest:
    """A span of flight that the autopilot flew as a test, and the message that names it."""

    name: str
    from_s: float
    to_s: float
    source: str

    @property
    def line(self) -> str:
        """What is said of it."""
        return f"{self.name} from {self.from_s:.1f} to {self.to_s:.1f} s ({self.source})"


def flown_tests(log: AutopilotLog) -> list[FlownTest]:
    """Return the tests that a log names, in order of time."""
    found: list[FlownTest] = []
    for message, name in (("SIDD", "system-identification chirp"), ("ATRP", "autotune")):
        for one in log.messages.get(message, {}).values():
            found += _spans(one.t_s, np.ones(len(one), dtype=bool), name, message)
    modes = log.first("MODE")
    if modes is not None and log.vehicle == "plane":
        number = modes.fields.get("ModeNum", modes.fields.get("Mode"))
        if number is not None and number.dtype.kind in "iuf":
            ends = np.append(modes.t_s[1:], _last_s(log))
            found += [
                FlownTest("mode AUTOTUNE", float(a), float(b), "MODE")
                for a, b, n in zip(modes.t_s, ends, number, strict=True)
                if int(n) == PLANE_AUTOTUNE and b - a > SHORTEST_S
            ]
    tuned = log.first("autotune_attitude_control_status")
    if tuned is not None and "state" in tuned.fields:
        active = np.asarray(tuned.fields["state"]) > 0
        found += _spans(tuned.t_s, active, "autotune", "autotune_attitude_control_status")
    texts = log.first("MSG")
    if texts is not None and "Message" in texts.fields:
        for t, raw in zip(texts.t_s, texts.fields["Message"], strict=True):
            said = raw.decode("utf-8", "replace") if isinstance(raw, bytes) else str(raw)
            if "doublet" in said.lower():
                found.append(FlownTest("doublet of a script", float(t), float(t) + DOUBLET_S,
                                       f"MSG '{said.strip(chr(0) + ' ')[:40]}'"))  # fmt: skip
    return sorted(found, key=lambda test: (test.from_s, test.to_s))


def _last_s(log: AutopilotLog) -> float:
    return max(float(m.t_s[-1]) for every in log.messages.values() for m in every.values())


def _spans(t_s: Array, active: BoolArray, name: str, source: str) -> list[FlownTest]:
    """Return where messages of a test follow each other."""
    t = t_s[active]
    if not len(t):
        return []
    breaks = np.flatnonzero(np.diff(t) > GAP_S)
    begins, ends = np.append(t[0], t[breaks + 1]), np.append(t[breaks], t[-1])
    return [
        FlownTest(name, float(a), float(b), source)
        for a, b in zip(begins, ends, strict=True)
        if b - a > SHORTEST_S
    ]
