"""Checks while nobody touches the aircraft: IMU, gyros' zero, pitots at rest."""

from __future__ import annotations

import math
from collections import deque

from host.constants import DEG_PER_RAD, GRAVITY_MPS2
from host.preflight.check import Check
from host.preflight.pressures import impact_pa
from host.preflight.sample import Sample, SlowReading, columns_of
from host.preflight.window import Window, mean, scatter

RATES = ("p_degps", "q_degps", "r_degps")
FORCES = ("ax_mps2", "ay_mps2", "az_mps2")
_PACKETS_S = 3.0
_ROW = columns_of(*RATES, *FORCES)
_LEVEL = "aircraft still and level, hands off"


class ImuCheck(Check):
    """The IMU is alive, still and level and measures one g; later it must only stay alive."""

    limits_of = "imu"

    def __init__(self) -> None:
        super().__init__("imu", "IMU still and level", _LEVEL)
        self._window = Window(self.limit["still_s"])
        self._last: tuple[float, ...] | None = None
        self._changed_s = self._valid_s = -1.0
        self._first_s: float | None = None
        self._odd = ""  # a fault that stands whatever comes later
        self._link = ""  # what is wrong with its packets
        self._packets: deque[tuple[float, int, int]] = deque(maxlen=10)

    def begin(self) -> None:
        """Forget what was seen."""
        super().begin()
        self._odd = ""

    def take(self, sample: Sample) -> None:
        """Judge a row."""
        row = _ROW(sample.values)
        if math.isnan(sum(row)):
            self._window.clear()
            self._dead(sample.t_s)
            return
        if row != self._last:
            self._last, self._changed_s = row, sample.t_s
        self._valid_s = sample.t_s
        if sample.t_s - self._changed_s > self.limit["frozen_s"]:
            self.fail_check("frozen: every rate and acceleration repeats to the last digit")
            return
        if self.state == "seen" or self._link or self._odd:
            return
        self._window.add(sample.t_s, row)
        if self._window.full:
            self._judge(self._window.columns())

    def take_reading(self, reading: SlowReading) -> None:
        """Take the counts of the IMU's packets."""
        if reading.name == "event" and reading.said["code"] in ("imu restarted", "imu lost"):
            self._odd = (
                f"{reading.said['code'].replace('imu ', 'it ')} meanwhile: its supply, its plug"
            )
            self.fail_check(self._odd)
        if reading.name != "system" or self._odd:
            return
        said = reading.said
        bad = said["imu_bad_packets"] + said["imu_lost"]
        self._packets.append((reading.t_s, said["imu_packets"], bad))
        span_s = reading.t_s - self._packets[0][0]
        if span_s < _PACKETS_S:
            return
        good, wrong = ((self._packets[-1][k] - self._packets[0][k]) % 65536 for k in (1, 2))
        self._link = ""
        if wrong > self.limit["bad_share"] * (good + wrong):
            self._link = f"{wrong} of its last {good + wrong} packets were damaged or lost: its bus"
        elif "imu" in said["sensors"] and good < self.limit["packets_per_s"] * span_s:
            self._link = f"sends {good / span_s:.0f} packets a second, 200 expected: its program"
        if self._link:
            self.fail_check(self._link)

    def _dead(self, t_s: float) -> None:
        if self._valid_s < 0.0:
            if self._first_s is None:
                self._first_s = t_s
            if t_s - self._first_s > self.limit["still_s"]:
                self.fail_check(
                    "no valid rates or accelerations: unplugged, or one at its range's end"
                )
        elif self._valid_s >= 0.0 and t_s - self._valid_s > self.limit["silent_s"]:
            self.fail_check(f"silent for {t_s - self._valid_s:.1f} s: its values are stale")

    def _judge(self, columns: list[list[float]]) -> None:
        noise = max(map(scatter, columns[:3]))
        force = [mean(column) for column in columns[3:]]
        size = math.hypot(*force)
        tilt = math.acos(max(-1.0, min(1.0, -force[2] / size))) * DEG_PER_RAD if size else 180.0
        self.values = {"tilt_deg": tilt, "gravity_mps2": size, "rate_noise_degps": noise}
        if noise > self.limit["rate_noise_degps"]:
            self.keep_waiting(f"not still: rates scatter by {noise:.1f} deg/s")
        elif abs(size - GRAVITY_MPS2) > self.limit["gravity_mps2"]:
            self.fail_check(f"reads {size:.1f} m/s2 at rest, not {GRAVITY_MPS2:.1f}: accelerometer")
        elif tilt > self.limit["level_deg"]:
            pitch = math.atan2(force[0], -force[2]) * DEG_PER_RAD
            roll = math.atan2(-force[1], -force[2]) * DEG_PER_RAD
            self.fail_check(
                f"tilted: pitch {pitch:+.0f}, roll {roll:+.0f} deg; level the aircraft, or the IMU"
                " sits crooked"
            )
        else:
            self.pass_check()


class GyroZeroCheck(Check):
    """Mean rates of the still aircraft are zero, and each axis is alive."""

    latched = True
    limits_of = "gyros"

    def __init__(self) -> None:
        super().__init__("gyros", "gyros' zero", _LEVEL)
        self._window = Window(3.0)
        self._noise = 0.7

    def take(self, sample: Sample) -> None:
        """Judge a row."""
        row = [sample[name] for name in RATES]
        self._window.add(sample.t_s, row)
        if not self._window.full:
            missing = [name[0] for name, one in zip(RATES, row, strict=True) if math.isnan(one)]
            if missing:
                self.fail_check(f"no valid {', '.join(missing)}: unplugged, or at its range's end")
            return
        columns = self._window.columns()
        if max(map(scatter, columns)) > self._noise:
            self.keep_waiting("not still")
            return
        means = [mean(column) for column in columns]
        self.values = dict(
            zip(("zero_p_degps", "zero_q_degps", "zero_r_degps"), means, strict=True)
        )
        still = [name[0] for name, one in zip(RATES, columns, strict=True) if min(one) == max(one)]
        worst = max(range(3), key=lambda k: abs(means[k]))
        if still:
            self.fail_check(f"{', '.join(still)} does not change by a digit: dead axis")
        elif abs(means[worst]) > self.limit["zero_degps"]:
            name = RATES[worst][0]
            self.fail_check(
                f"{name} reads {means[worst]:+.1f} deg/s at rest: power the logger anew and"
                " keep the aircraft still, or calibrate the gyros"
            )
        else:
            self.pass_check()

    def missing(self) -> str:
        """Return why it is not yet passed: the values seen so far."""
        return self.reason or "no rates came"


class RestPressureCheck(Check):
    """Both pitots read zero in still air."""

    latched = True
    limits_of = "pitots"

    def __init__(self, sides: tuple[str, ...] = ("a", "b")) -> None:
        super().__init__("airspeed_rest", "airspeed at rest", "pitots covered from the wind")
        self._sides = sides
        self._window = Window(self.limit["rest_s"])

    def take(self, sample: Sample) -> None:
        """Judge a row."""
        row = [impact_pa(sample, side) for side in self._sides]
        dead = [side for side, one in zip(self._sides, row, strict=True) if math.isnan(one)]
        if dead:
            names = " and ".join({"a": "left", "b": "right"}[side] for side in dead)
            self.fail_check(
                f"{names} pitot: open or shorted, its voltage is at an end of its range"
            )
        self._window.add(sample.t_s, row)
        if not self._window.full:
            return
        columns = self._window.columns()
        if max(map(scatter, columns)) > 0.5 * self.limit["rest_pa"]:
            if self.state == "waiting":
                self.keep_waiting("not steady: cover the pitots from the wind")
            return
        self.values = {f"rest_{s}_pa": mean(c) for s, c in zip(self._sides, columns, strict=True)}
        for side, column in zip(self._sides, columns, strict=True):
            pressure, name = mean(column), {"a": "left", "b": "right"}[side]
            if abs(pressure) > self.limit["rest_pa"]:
                self.fail_check(
                    f"{name} pitot reads {pressure:+.0f} Pa at rest: cover it from the wind, or its"
                    " zero is off (host calibrate pitots)"
                )
                return
        self.pass_check()

    def missing(self) -> str:
        """Return why it is not yet passed: the values seen so far."""
        return self.reason or "no pressures came"
