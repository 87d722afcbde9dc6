"""How good a log is for identification: timing, stuck and saturated channels, vane pairs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.log.flown_inputs import inputs_of_session
from host.log.servo_jumps import LONGEST_S, servo_jumps
from host.physical.calibration import Line
from host.physical.channels import END_OF_RANGE as IMU_END
from host.physical.columns import ANALOGUE, INERTIAL
from host.physical.session import Session
from host.wire.schema import Frame

Array = NDArray[np.float64]

STUCK_S = 10.0  # noise moves a live sensor's sum of four conversions by a count sooner than that
_ADC_END = 4 * 1023
_JITTER_MOST_US = 1_000_000
_DRIVEN = ("elevator", "aileron", "rudder", "throttle")
_KEPT_S = 0.5  # of a piece before: a jump may begin there
_PAIRS = {"alpha": ("alpha_a", "alpha_b"), "beta": ("beta_a", "beta_b"), "pitot": ("dp_a", "dp_b")}


@dataclass(slots=True)
class ChannelHealth:
    """One raw channel over a session."""

    rows: int = 0
    valid: int = 0
    at_end: int = 0
    longest_still_rows: int = 0
    _still_rows: int = 0
    _last: int | None = None

    def add(self, raw: NDArray[Any], valid: NDArray[Any], at_end: NDArray[Any]) -> None:
        """Take more samples into account."""
        self.rows += len(raw)
        self.valid += int(np.count_nonzero(valid))
        self.at_end += int(np.count_nonzero(at_end & valid))
        if not len(raw):
            return
        moved = np.flatnonzero(np.diff(raw)) + 1
        if self._last is not None and raw[0] != self._last:
            self._still_rows = 0
        edges = np.r_[-self._still_rows, moved, len(raw)]
        self.longest_still_rows = max(self.longest_still_rows, int(np.diff(edges).max()))
        self._still_rows = len(raw) - int(edges[-2])
        self._last = int(raw[-1])


@dataclass(slots=True)
class PairHealth:
    """Difference of two sensors of the same thing, first minus second, where both are valid.

    Roll and yaw rates move the vanes of the two wing tips apart, so that single rows may differ;
    the mean over a flight may not, beyond what the calibration allows.
    """

    unit: str
    limit: float  # largest honest mean: three standard deviations of both zeros together
    rows: int = 0
    total: float = 0.0
    squares: float = 0.0

    def add(self, difference: Array) -> None:
        """Take more rows into account."""
        self.rows += len(difference)
        self.total += float(difference.sum())
        self.squares += float(np.square(difference).sum())

    @property
    def mean(self) -> float:
        """Mean difference."""
        return self.total / self.rows if self.rows else 0.0

    @property
    def deviation(self) -> float:
        """Standard deviation of the difference."""
        if not self.rows:
            return 0.0
        return float(np.sqrt(max(0.0, self.squares / self.rows - self.mean**2)))

    @property
    def disagrees(self) -> bool:
        """True if the mean difference is more than the calibration allows."""
        return abs(self.mean) > self.limit


@dataclass(slots=True)
class Quality:
    """Figures of one session.

    Parameters
    ----------
    jitter_us : dict of str to float
        Deviation of the time between two rows from the usual interval: p50, p99, max.
    channels : dict of str to ChannelHealth
        Raw channels of the identification frame by field.
    stuck, saturated, absent : dict of str to float
        Channels that did not move (longest time, s), stood at an end of their range (share of
        rows), or were hardly ever valid (share of rows valid).
    imu_saturated : float
        Share of rows the IMU itself marked as saturated.
    pairs : dict of str to PairHealth
        Left against right vane and pitot.
    servo_jumps : dict of str to list of float
        By servo, ``t_s`` of each pulse that left and came back though the stick stood still.
    """

    jitter_us: dict[str, float] = field(default_factory=dict)
    channels: dict[str, ChannelHealth] = field(default_factory=dict)
    stuck: dict[str, float] = field(default_factory=dict)
    saturated: dict[str, float] = field(default_factory=dict)
    absent: dict[str, float] = field(default_factory=dict)
    imu_saturated: float = 0.0
    pairs: dict[str, PairHealth] = field(default_factory=dict)
    servo_jumps: dict[str, list[float]] = field(default_factory=dict)


class _JumpWatch:
    """Counts jumps of servos piece by piece."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._drives = session.store.schema.bit("valid", "mega_drives")
        self._frame = session.store.schema.by_name["ident"]
        self._before: tuple[Array, NDArray[Any]] | None = None
        self._inputs = inputs_of_session(session)
        self.found: dict[str, list[float]] = {}

    def add(self, t_us: Array, data: NDArray[Any]) -> None:
        """Take more rows into account."""
        if self._before is not None:
            t_us = np.r_[self._before[0], t_us]
            data = np.concatenate([self._before[1], data])
        t_s = self._session.seconds(t_us)
        drives = (data["valid"] & self._drives) != 0
        for name in _DRIVEN:
            servo, stick = (
                data[f"{kind}_{name}"] * self._frame.field(f"{kind}_{name}").scale
                for kind in ("servo", "rc")
            )
            for at_s in servo_jumps(t_s, servo, stick, drives & (servo > 0.0)).tolist():
                own = self.found.get(name, [])
                if own and at_s <= own[-1]:
                    continue  # seen with the piece before
                if not any(i.start_s - LONGEST_S <= at_s <= i.end_s for i in self._inputs):
                    self.found[name] = [*own, at_s]
        keep = int(np.searchsorted(t_s, t_s[-1] - _KEPT_S))
        self._before = t_us[keep:], data[keep:]


@dataclass(slots=True)
class _Counts:
    """How often each whole number came: few of them in a clean log, at most one per row."""

    values: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, np.int32))
    counts: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))

    def add(self, numbers: NDArray[np.int32]) -> None:
        """Count more numbers."""
        values, counts = np.unique(numbers, return_counts=True)
        every = np.concatenate([self.values, values])
        self.values, where = np.unique(every, return_inverse=True)
        both = np.concatenate([self.counts, counts])
        self.counts = np.bincount(where, both, len(self.values)).astype(np.int64)

    def percentiles(self) -> dict[str, float]:
        """Return p50, p99 and max; nothing without numbers."""
        if not len(self.values):
            return {}
        passed = np.cumsum(self.counts)
        at = {
            name: float(self.values[np.searchsorted(passed, share * passed[-1])])
            for name, share in (("p50", 0.5), ("p99", 0.99))
        }
        return at | {"max": float(self.values[-1])}


def judge(session: Session) -> Quality:
    """Walk a session's identification frames once and return its figures."""
    schema = session.store.schema
    frame = schema.by_name["ident"]
    unsaturated = schema.bit("valid", "imu_unsaturated")
    fresh_bit = schema.bit("valid", "imu_fresh")
    quality = Quality(channels={name: ChannelHealth() for name in (*ANALOGUE, *INERTIAL)})
    lines = {name: session.calibration.lines[line] for name, (_, line) in ANALOGUE.items()}
    quality.pairs = {
        pair: PairHealth(lines[a].unit, 3.0 * float(np.hypot(_zero(lines[a]), _zero(lines[b]))))
        for pair, (a, b) in _PAIRS.items()
    }
    jitter = _Counts()
    clipped = fresh = 0
    before: tuple[float, int] | None = None
    jumps = _JumpWatch(session)
    for part in session.store.fast_pieces(session.span):
        if not len(part.data):
            continue
        t_us, count = session.since_start_us(part), part.data["count"].astype(np.int64)
        jumps.add(t_us, part.data)
        if before is not None:
            t_us, count = np.r_[before[0], t_us], np.r_[before[1], count]
        before = (float(t_us[-1]), int(count[-1]))
        step = np.diff(t_us)[np.diff(count) & 0xFFFF == 1]
        jitter.add(np.minimum(np.abs(step - session.interval_us), _JITTER_MOST_US).astype(np.int32))
        bits = part.data["valid"]
        is_fresh = (bits & fresh_bit) != 0
        fresh += int(np.count_nonzero(is_fresh))
        clipped += int(np.count_nonzero(is_fresh & ((bits & unsaturated) == 0)))
        for name, health in quality.channels.items():
            raw = part.data[name].astype(np.int32)
            if name in ANALOGUE:
                valid = _is_valid(frame, bits, name)
                health.add(raw, valid, (raw <= 0) | (raw >= _ADC_END))
            else:
                keep = raw[is_fresh]
                health.add(keep, np.ones(len(keep), bool), np.abs(keep) >= IMU_END)
        for pair, (a, b) in _PAIRS.items():
            both = _is_valid(frame, bits, a) & _is_valid(frame, bits, b)
            sides = [
                (part.data[name][both] * frame.field(name).scale - lines[name].zero[0])
                * lines[name].slope[0]
                for name in (a, b)
            ]
            for name, side in zip((a, b), sides, strict=True):
                lines[name].bend(side)
            quality.pairs[pair].add(sides[0] - sides[1])
    quality.imu_saturated = clipped / fresh if fresh else 0.0
    quality.servo_jumps = jumps.found
    quality.jitter_us = jitter.percentiles()
    _find_faults(quality, session)
    return quality


def _zero(line: Line) -> float:
    return line.zero_sigma * abs(line.slope[0])


def _is_valid(frame: Frame, bits: NDArray[np.uint16], name: str) -> NDArray[np.bool_]:
    bit = frame.field(name).valid
    if bit is None:
        return np.ones(len(bits), np.bool_)
    return np.asarray((bits >> bit & 1) != 0)


def _find_faults(quality: Quality, session: Session) -> None:
    for name, health in quality.channels.items():
        if not health.rows:
            continue
        share = health.valid / health.rows
        if share < 0.5:
            quality.absent[name] = share
            continue
        still_s = health.longest_still_rows / session.rate_hz
        if still_s >= STUCK_S and health.longest_still_rows > 0.2 * health.rows:
            quality.stuck[name] = still_s
        if health.at_end:
            quality.saturated[name] = health.at_end / health.rows
