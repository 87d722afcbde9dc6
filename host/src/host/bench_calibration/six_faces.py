"""The accelerometer on six faces: held positions at plus and minus gravity, mounting angle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from host.bench_calibration.bench_plan import Subject
from host.bench_calibration.calibrated_lines import Calibrated
from host.bench_calibration.held_position import Held
from host.bench_calibration.reading_table import number_of, rows_of
from host.constants import DEG_PER_RAD
from host.errors import UsageError
from host.files.user_text import shown

AXES = ("x", "y", "z")
FORCES = ("ax", "ay", "az")
FACES = tuple(f"{sign}{axis}" for axis in AXES for sign in "+-")


def face_held(
    face: str,
    repeat: int,
    forces: Sequence[float],
    gravity_mps2: float,
    noise: Sequence[float] = (),
) -> Held:
    """Return one face as a held position: an axis that points up reads plus free fall."""
    readings = dict(zip(FORCES, map(float, forces), strict=True))
    loud = dict(zip(FORCES, map(float, noise), strict=True)) if len(noise) else {}
    sign = 1.0 if face[0] == "+" else -1.0
    return Held(f"a{face[1]}", repeat, sign * gravity_mps2, readings, loud)


class FaceTable:
    """Six faces from a table with columns repeat, up (+x ... -z), ax, ay, az (m/s2)."""

    def __init__(self, path: Path, gravity_mps2: float, first_repeat: int = 1) -> None:
        self._path, self._gravity, self._first = path, gravity_mps2, first_repeat

    def held(self) -> list[Held]:
        """Return a held position for each row.

        Raises
        ------
        UsageError
            If a face is unknown or a number missing.
        """
        found = []
        for index, row in enumerate(rows_of(self._path, ("up", *FORCES)), start=2):
            face = (row["up"] or "").strip().lower()
            if face not in FACES:
                raise UsageError(
                    f"{self._path}: row {index} up is {shown(face)}, expected {', '.join(FACES)}"
                )
            forces = [number_of(self._path, row, a, index) for a in FORCES]
            if any(math.isnan(f) for f in forces):
                raise UsageError(f"{self._path}: row {index} needs ax, ay and az in m/s2")
            number = number_of(self._path, row, "repeat", index)
            repeat = 1 if math.isnan(number) else round(number)
            found.append(face_held(face, repeat + self._first - 1, forces, self._gravity))
        return found


def crooked_deg(held: Sequence[Held], lines: Sequence[Calibrated]) -> float:
    """Return the largest angle between an axis of the IMU and its face, deg."""
    fits = {c.channel: c.fit for c in lines if c.fit is not None}
    worst = 0.0
    for up in FORCES:
        for other in FORCES:
            if up == other or other not in fits:
                continue
            pairs = [(p.position, p.readings[other]) for p in held if p.moved == up]
            high = [r for at, r in pairs if at > 0.0]
            low = [r for at, r in pairs if at < 0.0]
            if high and low:
                lean = (float(np.mean(high)) - float(np.mean(low))) * fits[other].slope
                worst = max(worst, abs(lean) / (2.0 * max(abs(at) for at, _ in pairs)))
    return math.asin(min(worst, 1.0)) * DEG_PER_RAD


def crooked_doubt(subject: Subject, angle_deg: float) -> str | None:
    """Return the doubt about an IMU whose axes are tilted on its cube; None within the limit."""
    limit = subject.limits["crooked_deg"]
    if angle_deg <= limit:
        return None
    return (
        f"the IMU sits crooked by {angle_deg:.1f} deg, limit {limit:g}: shim it; a calibration line"
        " cannot turn axes"
    )
