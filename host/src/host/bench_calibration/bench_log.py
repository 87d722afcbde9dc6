"""Held positions from a log of the bench, or from a captured radio stream."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from host.bench_calibration.bench_plan import Subject
from host.bench_calibration.held_position import Held
from host.bench_calibration.plateaus import Plateau, before_marks, matched, plateaus
from host.bench_calibration.raw_channel import raw_channel
from host.bench_calibration.six_faces import AXES, FORCES, face_held
from host.bench_calibration.turned_gyro import RATES, Rest, Turn
from host.constants import RAD_PER_DEG
from host.errors import UsageError
from host.log import FlightLog, read_log
from host.physical.timebase import WRAP_US

Array = NDArray[np.float64]
_ANEW_US = 1_000_000
_LEAK_S = 45.0  # the procedure holds 60 s
_MOVES = 0.1  # share of the smallest step between positions: less in 0.3 s is no motion
_FACE = 0.9  # share of gravity that an axis must read to point up or down
_STILL_MPS2, _STILL_RADPS = 0.3, 0.05
_WHOLE_RAD = 90.0 * RAD_PER_DEG  # a smaller turn comes from a moved table


@dataclass(frozen=True)
class BenchLog:
    """The raw channels of one recording.

    Parameters
    ----------
    path : Path
    log : FlightLog
    """

    path: Path
    log: FlightLog

    @classmethod
    def read(cls, path: Path) -> BenchLog:
        """Read a log or a captured radio stream.

        Raises
        ------
        UsageError
            If it holds no identification frames; LogError as `read_log`.
        """
        log = read_log(path)
        if "ident" not in log.frames or not len(log.frames["ident"]):
            raise UsageError(f"{path}: no identification frames; record the bench, then again")
        return cls(path, log)

    @cached_property
    def t_s(self) -> Array:
        """Time since the first row, s; a clock that starts anew goes on a second later."""
        raw = self.log.frames["ident"]["t_us"].astype(np.int64)
        step = (np.diff(raw, prepend=raw[:1]) + WRAP_US // 2) % WRAP_US - WRAP_US // 2
        step[step < 0] = _ANEW_US
        return np.asarray(np.cumsum(step) * 1e-6)

    @cached_property
    def marks_s(self) -> list[float]:
        """Times of the button's marks, s."""
        events = self.log.frames.get("event")
        if events is None or not len(events):
            return []
        first = int(self.log.frames["ident"]["t_us"][0])
        marks = events["t_us"][events["code"] == self.log.schema.number("event", "mark")]
        return [((int(t) - first) % WRAP_US) * 1e-6 for t in marks]

    def raw(self, name: str) -> Array:
        """Return a channel in the raw unit; NaN where it was not valid."""
        return raw_channel(self.log.schema, self.log.frames["ident"], name)

    def magnetic_counts(self) -> Array:
        """Return the readings of the magnetometer, counts (n, 3)."""
        rows = self.log.frames.get("mag")
        if rows is None or not len(rows):
            return np.empty((0, 3))
        frame = self.log.schema.by_name["mag"]
        field = np.column_stack([rows[m].astype(float) for m in ("mx", "my", "mz")])
        good = np.all([field[:, k] != frame.field(m).invalid
                       for k, m in enumerate(("mx", "my", "mz"))], axis=0)  # fmt: skip
        return np.asarray(field[good])

    def temperature_degc(self) -> float | None:
        """Return the mean temperature of the pressure sensor, degC; None without its frames."""
        rows = self.log.frames.get("baro")
        if rows is None or not len(rows):
            return None
        field = self.log.schema.by_name["baro"].field("temperature")
        known = rows["temperature"][rows["temperature"] != field.invalid]
        return float(known.mean() * field.scale) if len(known) else None


class LogSource:
    """Held positions of one channel in a recording; marks of the button say where, if there are
    as many as positions, else the plateaus are found.

    Parameters
    ----------
    bench : BenchLog
    subject : Subject
    channel : str
    positions : sequence of float
        Positions of one round, in the tool's setting.
    first_repeat : int
    """

    def __init__(
        self,
        bench: BenchLog,
        subject: Subject,
        channel: str,
        positions: Sequence[float],
        first_repeat: int = 1,
    ) -> None:
        self._bench, self._subject, self._channel = bench, subject, channel
        self._positions, self._first = positions, first_repeat

    def held(self) -> list[Held]:
        """Return a held position for each plateau.

        Raises
        ------
        UsageError
            If the channel was never valid, or the number of plateaus fits no round.
        """
        bench, family = self._bench, self._subject.channels
        prefix = "rc_" if self._subject.table == "pulse" else ""
        raw = np.column_stack([bench.raw(prefix + c) for c in family])
        if not np.isfinite(raw[:, family.index(self._channel)]).any():
            raise UsageError(f"{bench.path}: {self._channel} was never valid; is it plugged in?")
        moved = self._moved(raw)
        found = self._found(raw[:, moved])
        leaks = [p for p in found if self._is_leak(p)]
        rest = [p for p in found if p not in leaks]
        levels = [float(np.nanmean(raw[p.first : p.last, moved])) for p in rest]
        name = f"{bench.path}: {self._channel}"
        points = matched(rest, self._positions, levels, name)
        held = [self._held(raw, r, at, p) for r, at, p in points]
        far = max(self._positions, key=abs)
        return [self._held(raw, 1, self._nearest(held, raw, p, far), p) for p in leaks] + held

    def _moved(self, raw: Array) -> int:
        """Return the column that moved: the named channel's, or another if that stood still."""
        spans = [float(np.ptp(c[np.isfinite(c)])) if np.isfinite(c).any() else 0.0 for c in raw.T]
        own = self._subject.channels.index(self._channel)
        expected = np.ptp(self._positions) / self._subject.limits["slope"][1]
        return own if spans[own] > 0.2 * expected else int(np.argmax(spans))

    def _found(self, raw: Array) -> list[Plateau]:
        marks = self._bench.marks_s
        size = len(self._positions)
        if len(marks) >= size and len(marks) % size == 0:
            return before_marks(self._bench.t_s, marks)
        steps = np.abs(np.diff(self._positions))
        least = _MOVES * float(steps[steps > 0.0].min()) / self._subject.limits["slope"][1]
        return plateaus(self._bench.t_s, raw[:, None], [least])

    def _is_leak(self, plateau: Plateau) -> bool:
        return "leak" in self._subject.limits and plateau.duration_s >= _LEAK_S

    def _nearest(self, held: Sequence[Held], raw: Array, plateau: Plateau, far: float) -> float:
        """Return the position whose reading is nearest to that of a plateau."""
        own = self._subject.channels.index(self._channel)
        level = float(np.nanmean(raw[plateau.first : plateau.last, own]))
        near = min(held, key=lambda p: abs(p.readings[self._channel] - level), default=None)
        return near.position if near is not None else far

    def _held(self, raw: Array, repeat: int, position: float, plateau: Plateau) -> Held:
        inside = slice(plateau.first, plateau.last)
        t = self._bench.t_s[inside]
        readings, noise, change = {}, {}, {}
        for k, name in enumerate(self._subject.channels):
            x = raw[inside, k]
            good = np.isfinite(x)
            if good.sum() < 3:
                continue
            readings[name] = float(x[good].mean())
            trend = np.polyfit(t[good] - t[0], x[good], 1)
            noise[name] = float(np.std(x[good] - np.polyval(trend, t[good] - t[0])))
            if plateau.duration_s >= _LEAK_S:
                change[name] = float(trend[0])
        if self._channel not in readings:
            raise UsageError(
                f"{self._bench.path}: {self._channel} was not valid at {plateau.begin_s:.0f} s"
            )
        number = repeat + self._first - 1
        return Held(self._channel, number, position, readings, noise, change, plateau.duration_s)


class FaceLog:
    """The six faces in a recording, in any order; a round is complete when a face returns."""

    def __init__(self, bench: BenchLog, gravity_mps2: float, first_repeat: int = 1) -> None:
        self._bench, self._gravity, self._first = bench, gravity_mps2, first_repeat

    def held(self) -> list[Held]:
        """Return a held position for each plateau with an axis that points up or down.

        Raises
        ------
        UsageError
            If none is found.
        """
        forces = np.column_stack([self._bench.raw(a) for a in FORCES])
        seen: list[str] = []
        found = []
        for p in plateaus(self._bench.t_s, forces, [_STILL_MPS2] * 3):
            part = forces[p.first : p.last]
            mean, noise = np.nanmean(part, axis=0), np.nanstd(part, axis=0)
            axis = int(np.argmax(np.abs(mean)))
            if abs(mean[axis]) < _FACE * self._gravity:
                continue
            face = f"{'+' if mean[axis] > 0.0 else '-'}{AXES[axis]}"
            if seen and seen[-1] == face:
                continue  # the same face, held on
            seen.append(face)
            repeat = self._first + seen.count(face) - 1
            found.append(face_held(face, repeat, mean, self._gravity, noise))
        if not found:
            raise UsageError(f"{self._bench.path}: no face held still; 10 s on each of the six")
        return found


def turns_of(
    bench: BenchLog, angle_deg: float, first_repeat: int = 1
) -> tuple[list[Rest], list[Turn]]:
    """Return rests and turns of a recording; each turn was by the same angle, either way.

    Raises
    ------
    UsageError
        If nothing rests or nothing turns.
    """
    rates = np.column_stack([bench.raw(r) for r in RATES])
    still = plateaus(bench.t_s, rates, [_STILL_RADPS] * 3)
    rests, turns = [], []
    for p in still:
        p_, q, r = (float(x) for x in np.nanmean(rates[p.first : p.last], axis=0))
        rests.append(Rest(first_repeat, (p_, q, r)))
    for before, after in itertools.pairwise(still):
        turn = _turn(bench, rates, before, after, angle_deg * RAD_PER_DEG, first_repeat)
        if turn is not None:
            turns.append(turn)
    if not rests or not turns:
        raise UsageError(
            f"{bench.path}: {len(rests)} rests and {len(turns)} turns found; rest 10 s, turn by"
            f" {angle_deg:g} deg, rest 10 s"
        )
    return rests, turns


def _turn(
    bench: BenchLog,
    rates: Array,
    before: Plateau,
    after: Plateau,
    angle_rad: float,
    repeat: int,
) -> Turn | None:
    inside = slice(before.last - 1, after.first + 1)
    t, x = bench.t_s[inside], rates[inside]
    good = np.isfinite(x).all(axis=1)
    zero = np.nanmean(rates[before.first : before.last], axis=0)
    if good.sum() < 3:
        return None
    angles = np.trapezoid(x[good] - zero, t[good], axis=0)
    axis = int(np.argmax(np.abs(angles)))
    if abs(angles[axis]) < _WHOLE_RAD:
        return None
    seconds = float(t[good][-1] - t[good][0])
    p, q, r = (float(np.trapezoid(x[good, k], t[good])) / seconds for k in range(3))
    return Turn(repeat, axis, float(np.sign(angles[axis])) * angle_rad, seconds, (p, q, r))
