"""Compare two calibration files line by line: numbers that moved by more than their deviations."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from host.constants import NORMAL_95
from host.errors import CalibrationError
from host.physical.calibration import Calibration, Line, load_calibration

_AXES = "xyz"


@dataclass(frozen=True, slots=True)
class Moved:
    """How far one number of a line moved.

    Attributes
    ----------
    line, what : str
        ``channel.alpha_a``; ``zero`` or ``slope``, of the IMU with its axis.
    old, new : float
    sigmas : float
        The difference over the deviation of both files' numbers together.
    """

    line: str
    what: str
    old: float
    new: float
    sigmas: float

    @property
    def beyond(self) -> bool:
        """Whether it is more than 95 % of honest repeats would show."""
        return abs(self.sigmas) > NORMAL_95


def compare(old: Calibration, new: Calibration) -> list[Moved]:
    """Return every number of the lines that somebody measured for both files."""
    found = []
    for name, line in new.lines.items():
        before = old.lines.get(name)
        if before is None or line.default or before.default:
            continue
        for k in range(len(line.zero)):
            axis = f" {_AXES[k]}" if len(line.zero) > 1 else ""
            pairs = ((before.zero[k], line.zero[k], _zero(before, line, k)),
                     (before.slope[k], line.slope[k], _slope(before, line, k)))  # fmt: skip
            for what, (was, now, sigma) in zip(("zero", "slope"), pairs, strict=True):
                sigmas = (now - was) / sigma if sigma else math.copysign(math.inf, now - was)
                found.append(Moved(name, what + axis, was, now, sigmas if now != was else 0.0))
    return found


def _zero(old: Line, new: Line, axis: int) -> float:
    return math.hypot(old.zero_sigma, new.zero_sigma)


def _slope(old: Line, new: Line, axis: int) -> float:
    return math.hypot(old.slope_sigma * old.slope[axis], new.slope_sigma * new.slope[axis])


def newest_calibration(folder: Path, old: Path) -> Path:
    """Return the calibration file of a folder with the latest date, the old one left out.

    Raises
    ------
    CalibrationError
        If there is none.
    """
    found = []
    for path in sorted(folder.glob("*.toml")):
        if path.resolve() == old.resolve():
            continue
        try:
            one = load_calibration(path)
        except CalibrationError:
            continue
        if len(one.defaults()) < len(one.lines):
            found.append((one.date, path.name, path))
    if not found:
        raise CalibrationError(
            f"{folder.resolve()}: no calibration file to compare {old} with; name one before"
            " --check, or calibrate first: host calibrate"
        )
    return max(found)[2]
