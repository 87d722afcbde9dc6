"""Identification frames -> channels in SI at the instants of the rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.physical.calibration import Calibration, Line
from host.physical.columns import ANALOGUE, ATTITUDE, INERTIAL, PULSES
from host.physical.sampling import SLOW_US, ConstantDelay, Interpolator, usual_interval_us
from host.wire.schema import Field, Schema

Array = NDArray[np.float64]
TURN_RAD = 2.0 * np.pi
END_OF_RANGE = 32_766.0  # raw rates and accelerations at or beyond it are clipped


@dataclass(slots=True)
class Rows:
    """Identification frames of one session, and the time of each.

    Parameters
    ----------
    data : NDArray, shape (n,)
        Frames `ident`.
    t_us : Array, shape (n,)
        Unwrapped ``t_us`` since the session's first frame.
    """

    data: NDArray[Any]
    t_us: Array


class ChannelMaker:
    """Turns identification frames into columns.

    Parameters
    ----------
    schema : Schema
    calibration : Calibration
    dlpf : int
        DLPF_CFG of the IMU, key of its filter delays.
    interval_us : float
        Usual time between two rows.
    aligned : bool
        False leaves each value where it was sampled instead of bringing it to the row's instant.
    """

    def __init__(
        self,
        schema: Schema,
        calibration: Calibration,
        *,
        dlpf: int,
        interval_us: float,
        aligned: bool = True,
    ) -> None:
        self._frame = schema.by_name["ident"]
        self._lines = calibration.lines
        self._dlpf = dlpf
        self._interval_us = interval_us
        self._aligned = aligned
        self._fresh = schema.bit("valid", "imu_fresh")
        self._unsaturated = schema.bit("valid", "imu_unsaturated")
        self._original = schema.bit("valid", "imu_original")

    def columns(self, rows: Rows, into: Mapping[str, Array] | None = None) -> dict[str, Array]:
        """Return the channels of `rows`: every analogue, inertial, attitude and pulse column.

        Parameters
        ----------
        rows : Rows
        into : mapping of str to Array, optional
            Memory for columns that are not interpolated; new arrays without it.

        Returns
        -------
        dict of str to Array, each of shape (n,)
            NaN where a channel has no valid value. Angles wrapped as recorded are unwrapped from
            the first row on.
        """
        data = rows.data
        bits = data["valid"].astype(np.uint16)
        always = int(np.bitwise_and.reduce(bits)) if len(bits) else 0xFFFF
        out: dict[str, Array] = {}
        late = ConstantDelay(rows.t_us, self._interval_us) if self._aligned else None
        for name, (column, line) in ANALOGUE.items():
            field = self._frame.field(name)
            value = _floats(data[name], column, into)
            _calibrate(value, field.scale, self._lines[line])
            self._mask(value, bits, always, field.valid)
            out[column] = self._at_rows(rows, field, value, late)
        out |= self._inertial(rows, bits, always, into)
        for name, column in PULSES.items():
            field = self._frame.field(name)
            value = _floats(data[name], column, into)
            _erase(value, value == field.invalid)
            value *= field.scale
            out[column] = value
        return out

    def _inertial(
        self,
        rows: Rows,
        bits: NDArray[np.uint16],
        always: int,
        into: Mapping[str, Array] | None,
    ) -> dict[str, Array]:
        age_us = self._age_us(rows)
        fresh: NDArray[np.bool_] | None = np.isfinite(age_us)
        if not always & self._fresh:
            fresh &= (bits & self._fresh) != 0
        if fresh is not None and fresh.all():
            fresh = None
        original = (bits & self._original) != 0 if self._original else np.zeros(len(bits), bool)
        any_original, clipped = bool(original.any()), not always & self._unsaturated
        groups: dict[str, Interpolator | None] = {}
        out: dict[str, Array] = {}
        for name, (column, kind, axis) in INERTIAL.items():
            field = self._frame.field(name)
            value = _floats(rows.data[name], column, into)
            lost = value == field.invalid
            if clipped:
                lost |= (np.abs(value) >= END_OF_RANGE) & ((bits & self._unsaturated) == 0)
            raw = value.copy() if any_original else value
            value *= field.scale
            _axis(value, self._lines[f"imu.{kind}"], axis)
            if any_original:
                _axis(raw, self._lines[f"imu_original.{kind}"], axis)
                np.copyto(value, raw, where=original)
            _erase(value, lost)
            if kind not in groups:
                groups[kind] = self._interpolator(rows, field, age_us, fresh)
            out[column] = self._apply(groups[kind], value, fresh)
        for name, column in ATTITUDE.items():
            field = self._frame.field(name)
            value = _floats(rows.data[name], column, into)
            lost = value == field.invalid
            value *= field.scale
            _erase(value, lost)
            self._mask(value, bits, always, field.valid)
            if "attitude" not in groups:
                groups["attitude"] = self._interpolator(rows, field, age_us, fresh)
            out[column] = self._apply(groups["attitude"], unwrapped(value), fresh)
        return out

    def _age_us(self, rows: Rows) -> Array:
        field = self._frame.field("imu_age")
        age = rows.data["imu_age"].astype(np.float64)
        _erase(age, age == field.invalid)
        age *= field.scale
        return age

    def delay_us(self, field: Field) -> float:
        """Return the constant part of a field's sampling delay."""
        return constant_delay_us(field, self._dlpf)

    def _interpolator(
        self, rows: Rows, field: Field, age_us: Array, fresh: NDArray[np.bool_] | None
    ) -> Interpolator | None:
        if not self._aligned:
            return None
        sampled = rows.t_us - self.delay_us(field) - age_us
        if fresh is not None:
            sampled = sampled[fresh]
        # Instants must not fall; an age is a few us uncertain.
        np.maximum.accumulate(sampled, out=sampled)
        interval = self._interval_us
        if fresh is not None:
            interval = max(interval, usual_interval_us(sampled))
        return Interpolator(sampled, rows.t_us, interval)

    def _apply(
        self, group: Interpolator | None, value: Array, fresh: NDArray[np.bool_] | None
    ) -> Array:
        if group is None:
            if fresh is not None:
                _erase(value, ~fresh)
            return value
        return group(value if fresh is None else value[fresh])

    def _at_rows(self, rows: Rows, field: Field, value: Array, late: ConstantDelay | None) -> Array:
        delay = self.delay_us(field)
        if late is None or delay == 0.0:
            return value
        if 0.0 < -delay <= late.shortest_us and self._interval_us <= SLOW_US:
            return late(value, -delay)
        return Interpolator(rows.t_us - delay, rows.t_us, self._interval_us)(value)

    @staticmethod
    def _mask(value: Array, bits: NDArray[np.uint16], always: int, bit: int | None) -> None:
        if bit is not None and not always >> bit & 1:
            value[(bits >> bit & 1) == 0] = np.nan


def constant_delay_us(field: Field, dlpf: int) -> float:
    """Return the constant sampling delay of a field, microseconds; negative: after ``t_us``."""
    if field.delay_us is None:
        return 0.0
    if isinstance(field.delay_us, Mapping):
        return field.delay_us.get(dlpf, 0.0)
    return field.delay_us


def unwrapped(angle: Array) -> Array:
    """Return an angle without its jumps of a whole turn; NaN stays NaN.

    Parameters
    ----------
    angle : Array
        rad.
    """
    known = np.isfinite(angle)
    kept = angle if known.all() else angle[known]
    if len(kept) < 2:
        return angle
    step = np.diff(kept)
    if float(np.abs(step).max()) < np.pi:
        return angle
    turns = np.r_[0.0, np.cumsum(np.rint(step / TURN_RAD))]
    out = angle.copy()
    out[known] = kept - turns * TURN_RAD
    return out


def _floats(raw: NDArray[Any], column: str, into: Mapping[str, Array] | None) -> Array:
    if into is None:
        return raw.astype(np.float64)
    value = into[column]
    np.copyto(value, raw)
    return value


def _calibrate(value: Array, scale: float, line: Line) -> None:
    slope = line.slope[0]
    value *= scale * slope
    value -= line.zero[0] * slope
    line.bend(value)


def _axis(value: Array, line: Line, axis: int) -> None:
    if line.zero[axis]:
        value -= line.zero[axis]
    if line.slope[axis] != 1.0:
        value *= line.slope[axis]


def _erase(value: Array, lost: NDArray[np.bool_]) -> None:
    if lost.any():
        value[lost] = np.nan
