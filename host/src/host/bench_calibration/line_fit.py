"""The line or curve through held positions, and one standard deviation of its zero and its slope.

In each repeat the tool is put on anew, so that each has its own zero; slope and hysteresis are
common. Scatter is estimated from the readings and the tool's stated scatter together. Errors that
repeats cannot show (the tool itself, its scale) are added.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from host.bench_calibration.bench_plan import AIR_KGPM3, Subject, Tool, hand_worth
from host.bench_calibration.held_position import Held, directions
from host.constants import NORMAL_95
from host.errors import UsageError

Array = NDArray[np.float64]
_CUBIC_FROM = 7  # positions; fewer tell nothing of a bend
_BEYOND_DOUBT = 20.0  # Fisher's F of a curve against a line: chance gives it once in a million


@dataclass(frozen=True, slots=True)
class LineFit:
    """The fitted line, v = (raw - zero) * slope, or its curve, with residuals and deviations.

    Attributes
    ----------
    zero, slope : float
        Raw unit; SI per raw unit.
    zero_sigma, slope_sigma : float
        One standard deviation: raw unit; share. 1.96 of them hold the truth in 95 %, whatever
        the number of readings.
    residual, hysteresis : float
        Raw units: rms about the line; up against down.
    bend : float
        Raw units: largest distance of a cubic through all positions from the line; NaN: not known.
    repeat_zeros : (repeats,) array
        Zero of each repeat, raw unit.
    repeat_zero_sigma : float
        Standard deviation of one of them as the tool's file has it, raw unit.
    value, raw, residuals : (n,) array
    repeat, direction : (n,) array of int
    fitted : (n,) array
        Readings by the line or curve, without a repeat's placing and without hysteresis, raw unit.
    curve : tuple of float
        As in `host.physical.calibration.Line`; empty: a line.
    scatter : float
        One reading's standard deviation, raw unit, by its own and the tool's word.
    """

    channel: str
    zero: float
    slope: float
    zero_sigma: float
    slope_sigma: float
    residual: float
    hysteresis: float
    bend: float
    repeat_zeros: Array
    repeat_zero_sigma: float
    value: Array
    raw: Array
    residuals: Array
    repeat: NDArray[np.int64]
    direction: NDArray[np.int64]
    scatter: float
    position: Array
    fitted: Array
    curve: tuple[float, ...] = ()

    @property
    def straightened(self) -> Array:
        """Readings with the bow of the curve removed."""
        return np.asarray(self.raw - self.fitted + self.zero + self.value / self.slope)


def fit_line(
    subject: Subject,
    channel: str,
    points: Sequence[Held],
    *,
    density_kgpm3: float = AIR_KGPM3,
) -> LineFit:
    """Fit raw over value, as positions are known better than the sensor.

    Raises
    ------
    UsageError
        If there are too few points, or all at one position.
    """
    tool = subject.tool
    assert tool is not None
    position = np.array([p.position for p in points])
    raw = np.array([p.readings[channel] for p in points])
    value = np.array([tool.value(p, density_kgpm3) for p in position])
    weight = np.array([tool.per_setting(p, density_kgpm3) for p in position])
    numbers = np.array([p.repeat for p in points])
    repeats = np.unique(numbers)
    direction = np.array(directions(points))
    if subject.table == "imu" or len(np.unique(position)) < 3:
        direction = np.zeros_like(direction)
    columns = [(numbers == r).astype(float) for r in repeats] + [value]
    if {1, -1} <= set(direction.tolist()):
        columns.append(0.5 * direction)
    design = np.column_stack(columns)
    count, unknowns = design.shape
    if len(np.unique(position)) < 2 or count <= unknowns:
        raise UsageError(
            f"{channel}: {count} readings at {len(np.unique(position))} positions, expected"
            f" {unknowns + 1} or more at 2 or more; {subject.name} wants"
            f" {len(subject.positions)} positions, {subject.repeats} times"
        )
    relative = weight / weight.max()
    many = len(repeats)
    answer, inverse = _solved(design, raw, relative)
    gradient, of_gradient = float(answer[many]), float(inverse[many, many])
    bend, bowed = _bowed(value, raw, design, many)
    curved = bowed is not None and _is_curve(subject, bend, raw, design, bowed)
    if curved and bowed is not None:
        design, count_of = bowed, bowed.shape[1]
        answer, inverse = _solved(design, raw, relative)
    else:
        count_of = unknowns
    residuals = raw - design @ answer
    expected = _Expected(tool, gradient, float(weight.max()), count - count_of)
    variance, freedom = expected.scatter(float(np.sum((residuals / relative) ** 2)))
    zeros = answer[:many]
    mean = np.zeros(count_of)
    mean[:many] = 1.0 / many
    placing, placing_freedom = expected.placing(
        zeros, variance * float(np.mean(np.diag(inverse)[:many]))
    )
    hysteresis = float(answer[many + 1]) if unknowns > many + 1 else 0.0
    zero_sigma = sigma95(
        (variance * float(mean @ inverse @ mean), freedom),
        (placing / many, placing_freedom),
        (expected.own**2, math.inf),
        # Anywhere within the band is equally likely in flight.
        (hysteresis**2 / 12.0, math.inf),
    )
    slope_sigma = sigma95(
        (variance * of_gradient / gradient**2 if gradient else math.inf, freedom),
        (tool.scale**2, math.inf),
    )
    slope = 1.0 / gradient if gradient else math.inf
    curve: tuple[float, ...] = ()
    fitted = zeros.mean() + value * gradient
    if curved:
        fitted = zeros.mean() + design[:, many] * answer[many] + design[:, -2:] @ answer[-2:]
        slope, curve = _turned_over(value, fitted - zeros.mean())
    return LineFit(
        channel=channel,
        zero=float(zeros.mean()),
        slope=slope,
        zero_sigma=zero_sigma,
        slope_sigma=slope_sigma,
        residual=math.sqrt(float(np.mean(residuals**2))),
        hysteresis=abs(hysteresis),
        bend=bend,
        repeat_zeros=zeros,
        repeat_zero_sigma=math.sqrt(
            expected.word_placing + expected.word_scatter * float(np.mean(np.diag(inverse)[:many]))
        ),
        value=value,
        raw=raw,
        residuals=residuals,
        repeat=numbers,
        direction=direction,
        scatter=math.sqrt(variance),
        position=position,
        fitted=fitted,
        curve=curve,
    )


@dataclass(frozen=True, slots=True)
class _Expected:
    """Scatter and placing of the readings, in raw units: stated by the tool's file, and as seen."""

    tool: Tool
    gradient: float
    per_setting: float
    free: int

    @property
    def own(self) -> float:
        return self._raw(self.tool.own)

    @property
    def word_scatter(self) -> float:
        return self._raw(self.tool.reading) ** 2

    @property
    def word_placing(self) -> float:
        return self._raw(self.tool.placing) ** 2

    def scatter(self, squares: float) -> tuple[float, float]:
        """Return the variance of one reading and its degrees of freedom."""
        worth = hand_worth()
        return (worth * self.word_scatter + squares) / (worth + self.free), worth + self.free

    def placing(self, zeros: Array, of_fit: float) -> tuple[float, float]:
        """Return the variance of one placing of the tool and its degrees of freedom."""
        worth, free = hand_worth(), len(zeros) - 1
        seen = max(float(np.var(zeros, ddof=1)) - of_fit, 0.0) if free else 0.0
        return (worth * self.word_placing + free * seen) / (worth + free), worth + free

    def _raw(self, setting: float) -> float:
        return abs(setting * self.per_setting * self.gradient)


def sigma95(*parts: tuple[float, float]) -> float:
    """Return the deviation of which 1.96 are the 95 % interval of a sum of parts, each with its
    variance and degrees of freedom (Welch and Satterthwaite)."""
    total = sum(v for v, _ in parts)
    if not 0.0 < total < math.inf:
        return math.sqrt(total)
    inner = sum(v**2 / f for v, f in parts)
    freedom = total**2 / inner if inner > 0.0 else math.inf
    widen = float(stdtrit(freedom, 0.975)) / NORMAL_95 if freedom < 1e6 else 1.0
    return math.sqrt(total) * widen


def _solved(design: Array, raw: Array, relative: Array) -> tuple[Array, Array]:
    """Return weighted least squares and the inverse of its normal matrix."""
    x = design / relative[:, None]
    inverse = np.linalg.pinv(x.T @ x)
    return np.asarray(inverse @ (x.T @ (raw / relative))), np.asarray(inverse, dtype=np.float64)


def _bowed(value: Array, raw: Array, design: Array, many: int) -> tuple[float, Array | None]:
    """Return the largest distance of the cubic from the line, and the cubic's columns."""
    if len(np.unique(value)) < _CUBIC_FROM:
        return math.nan, None
    x = value / np.abs(value).max()
    more = np.column_stack([design, x**2, x**3])
    answer = np.linalg.lstsq(more, raw, rcond=None)[0]
    plain = np.linalg.lstsq(design, raw, rcond=None)[0]
    lines = answer[many] * value + answer[-2] * x**2 + answer[-1] * x**3
    distance = lines + answer[:many].mean() - plain[many] * value - plain[:many].mean()
    return float(np.abs(distance).max()), more


def _is_curve(subject: Subject, bend: float, raw: Array, design: Array, bowed: Array) -> bool:
    """Return whether a bend is large and significant, and leaves no other residual."""
    straight, curved = (_squares(d, raw) for d in (design, bowed))
    free = len(raw) - bowed.shape[1]
    if free <= 0 or not bend > subject.limits.get("bend", math.inf):
        return False
    smooth = math.sqrt(curved / len(raw)) <= float(subject.limits["residual"])
    return smooth and (straight - curved) * free > 2.0 * _BEYOND_DOUBT * curved


def _squares(design: Array, raw: Array) -> float:
    left = raw - design @ np.linalg.lstsq(design, raw, rcond=None)[0]
    return float(left @ left)


def _turned_over(value: Array, raw: Array) -> tuple[float, tuple[float, ...]]:
    """Return slope and curve of value over raw (less its zero)."""
    scale = float(np.abs(raw).max())
    x = raw / scale
    a, b, c = np.linalg.lstsq(np.column_stack([x, x**2, x**3]), value, rcond=None)[0]
    return float(a / scale), (float(b / a**2), float(c / a**3))
