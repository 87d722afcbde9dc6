"""What to measure on the ground: the cause that keeps most estimates from being good."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

# A word in a cause to what is measured, and by which of `host calibrate`, if by any.
MEASURED_BY = (
    ("pitot", "pitots"), ("airspeed", "speed"), ("vane", "vanes"), ("pot ", "pots"),
    ("servo", "servos"), ("accelerometer", "accelerometers"), ("tilt", "accelerometers"),
    ("gyro", "gyros"), ("Ixx", "inertia"), ("Iyy", "inertia"), ("Izz", "inertia"),
)  # fmt: skip
IN_THE_FILE = ("place", "mass", "density", "CG", "thrust", "upwash")
NO_FILE = "mass, CG, inertia and sizes for an aircraft file (host aircraft)"


def ground_measurements(causes: Iterable[str]) -> list[str]:
    """Return what to measure, that of most estimates first.

    Parameters
    ----------
    causes : iterable of str
        What widens each estimate most that is not good.
    """
    return [
        f"{cause} ({_how(cause)})"
        for cause, _ in Counter(causes).most_common()
        if _measurable(cause)
    ]


def _measurable(cause: str) -> bool:
    return any(word in cause for word, _ in MEASURED_BY) or any(w in cause for w in IN_THE_FILE)


def _how(cause: str) -> str:
    subject = next((subject for word, subject in MEASURED_BY if word in cause), "")
    return f"host calibrate {subject}" if subject else "aircraft file"
