"""The aircraft turned by hand about each axis: sign, order and life of the gyros."""

from __future__ import annotations

import math

from host.constants import DEG_PER_RAD
from host.preflight.check import AskedCheck
from host.preflight.sample import Sample
from host.preflight.still_checks import RATES

_WAYS = ("right wing down", "nose up", "nose to the right")
_LONGEST_S = 0.5


class TurnCheck(AskedCheck):
    """Nose up, right wing down, nose to the right, each by 20 deg and back."""

    limits_of = "turn"

    def __init__(self) -> None:
        super().__init__(
            "imu_turned",
            "IMU turned by hand",
            "nose up by 20 deg and back; right wing down and back; nose to the right and back",
        )

    def begin(self) -> None:
        """Forget what was seen."""
        super().begin()
        self._t_s = math.nan
        self._rest = [0.0] * 3
        self._count = 0
        self._angle = [0.0] * 3
        self._least = [0.0] * 3
        self._most = [0.0] * 3
        self._first = [0] * 3
        self._force: list[tuple[float, float]] = [(0.0, 0.0), (0.0, 0.0)]  # of roll, of pitch
        self._changed = [False] * 3
        self._row: tuple[float, ...] = ()

    def take(self, sample: Sample) -> None:
        """Integrate the rates, and look at gravity."""
        row = tuple(sample[name] for name in RATES)
        if not all(map(math.isfinite, row)):
            return
        step_s = sample.t_s - self._t_s if math.isfinite(self._t_s) else 0.0
        self._t_s = sample.t_s
        if self._row:
            self._changed = [
                c or a != b for c, a, b in zip(self._changed, row, self._row, strict=True)
            ]
        self._row = row
        if self._count < 5:  # a quarter of a second at rest: what is left of their zeros
            self._count += 1
            self._rest = [r + (v - r) / self._count for r, v in zip(self._rest, row, strict=True)]
            return
        for k in range(3):
            self._angle[k] += (row[k] - self._rest[k]) * min(step_s, _LONGEST_S)
            self._least[k] = min(self._least[k], self._angle[k])
            self._most[k] = max(self._most[k], self._angle[k])
            if not self._first[k] and abs(self._angle[k]) > self.limit["angle_deg"]:
                self._first[k] = 1 if self._angle[k] > 0.0 else -1
        self._gravity(sample)
        if all(self._first) and all(abs(one) < self.limit["angle_deg"] for one in self._angle):
            self._judge()

    def missing(self) -> str:
        """Return why it is not yet passed: the values seen so far."""
        if not self._row:
            return "no valid rates"
        for k, way in enumerate(_WAYS):
            if self._first[k]:
                continue
            name = RATES[k][0]
            if not self._changed[k]:
                return f"{name} does not change by a digit: dead axis"
            accelerated = k < 2 and self._force[k][1] - self._force[k][0] > self.limit["angle_deg"]
            if accelerated:
                return f"{name} saw nothing of {way}, which gravity did: dead axis, or swapped"
            return f"{way} by 20 deg was not seen"
        return self.reason or "the aircraft is not back where it was"

    def _gravity(self, sample: Sample) -> None:
        force = [sample[name] for name in ("ax_mps2", "ay_mps2", "az_mps2")]
        roll = math.atan2(-force[1], -force[2]) * DEG_PER_RAD
        pitch = math.atan2(force[0], math.hypot(force[1], force[2])) * DEG_PER_RAD
        self._force = [
            (min(span[0], one), max(span[1], one))
            for span, one in zip(self._force, (roll, pitch), strict=True)
        ]

    def _judge(self) -> None:
        self.values = {
            f"turned_{RATES[k][0]}_deg": self._most[k] if self._first[k] > 0 else self._least[k]
            for k in range(3)
        }
        wrong = [RATES[k][0] for k in range(3) if self._first[k] < 0]
        for k in range(2):
            least, most = self._force[k]
            if max(most, -least) < self.limit["angle_deg"] or most < -least:
                self.fail_check(
                    f"gravity does not see {_WAYS[k]}: accelerometer, or the IMU is mounted turned"
                )
                return
        if wrong:
            self.fail_check(
                f"{', '.join(wrong)}: wrong direction ({', '.join(_WAYS)} are positive), or the"
                " aircraft was turned the other way"
            )
        else:
            self.pass_check()
