"""Calibration files: raw -> SI, with source and uncertainty of every number (hw/calibration)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.errors import CalibrationError
from host.files.quantities import Quantity
from host.files.user_text import parse_toml, read_text, shown
from host.resources import resource

FORMAT = "flight-test-calibration"
VERSION = 1
_NUMBERS = ("zero", "slope", "zero_sigma", "slope_sigma")
ERRORS = "error"
_TEXTS = ("unit", "source")
_AXES = 3
_CONVERTER = "of a converter of at most 24 bits, or pulses in microseconds"
_RANGES = {
    "zero": Quantity("", -2e7, 2e7, _CONVERTER),
    "slope": Quantity("", -1e6, 1e6, "the span of a converter in at most 1e6 steps of the unit"),
    "zero_sigma": Quantity("", 0.0, 2e7, _CONVERTER),
    "slope_sigma": Quantity("", 0.0, 10.0, "a share: 0.03 is 3 %, 10 is nothing known"),
    "curve": Quantity("", -100.0, 100.0, "a bend of a line, not another one"),
}
_CURVE = 2
_SLOPES = {
    "rad": Quantity("rad per raw unit", -0.1, 0.1, "an encoder of 64 steps a turn"),
    "Pa": Quantity("Pa per raw unit", -1000.0, 1000.0, "8 bits of 2 bar"),
    "": Quantity("per raw unit", -0.1, 0.1, "the throttle in ten steps"),
    "rad/s": Quantity("", -10.0, 10.0, "rad/s per rad/s, or per count of a gyro"),
    "m/s2": Quantity("", -100.0, 100.0, "m/s2 per m/s2, or per count of an accelerometer"),
}


@dataclass(frozen=True, slots=True)
class Line:
    """value = v + curve[0] v^2 + curve[1] v^3, with v = (raw - zero) * slope.

    Parameters
    ----------
    zero : tuple of float
        Raw value that means 0, in the unit of protocol/frames.toml; one number, or one per axis.
    slope : tuple of float
        Unit of the value per raw unit; one number, or one per axis.
    zero_sigma : float
        One standard deviation of `zero`, in the raw unit (IMU: in the unit of the value).
    slope_sigma : float
        One standard deviation of `slope` as a share of it.
    unit : str
        Unit of the value.
    source : str
        Where the numbers come from.
    default : bool
        True for numbers that were not measured on this instrument.
    curve : tuple of float
        Per unit of the value, per its square; empty: a line.
    """

    zero: tuple[float, ...]
    slope: tuple[float, ...]
    zero_sigma: float
    slope_sigma: float
    unit: str
    source: str
    default: bool
    curve: tuple[float, ...] = ()

    def bend(self, value: NDArray[np.float64]) -> None:
        """Bend values of the straight line in place."""
        if self.curve:
            value *= 1.0 + value * (self.curve[0] + value * self.curve[1])


@dataclass(frozen=True, slots=True)
class Calibration:
    """Every line of an instrument.

    Parameters
    ----------
    name, date : str
        As the file says.
    path : Path
        The file.
    text : str
        Its text, copied into every export.
    lines : dict of str to Line
        By table and channel: ``channel.alpha_a``, ``pulse.elevator``, ``imu.gyro``, ...
    errors : dict
        Tables [error.NAME], unread: errors of the instrument beyond its lines (`host.instrument`
        reads them).
    """

    name: str
    date: str
    path: Path
    text: str
    lines: dict[str, Line]
    errors: dict[str, dict[str, Any]] = field(default_factory=dict)

    def defaults(self) -> list[str]:
        """Names of the lines that nobody measured on this instrument."""
        return [name for name, line in self.lines.items() if line.default]


def load_calibration(path: Path | str | None = None) -> Calibration:
    """Read a calibration file; what it does not name is taken from the default.

    Parameters
    ----------
    path : Path or str, optional
        The file; the packed default without it.

    Returns
    -------
    Calibration

    Raises
    ------
    CalibrationError
        If the file cannot be read, or a number in it is missing, of the wrong kind, or unknown.
    """
    if path is None:
        return _read(resource("default.toml"))
    return _completed(_read(Path(path)), path)


def calibration_of_text(text: str, path: Path) -> Calibration:
    """Return the calibration whose text was kept in `path`, as `load_calibration` does of a file.

    Raises
    ------
    CalibrationError
        As `load_calibration`.
    """
    return _completed(_of_text(text, path), path)


def _completed(own: Calibration, path: Path | str) -> Calibration:
    """Return a calibration whose missing lines are the default's."""
    default = _read(resource("default.toml"))
    unknown = sorted(set(own.lines) - set(default.lines))
    if unknown:
        raise CalibrationError(
            f"{path}: unknown entry [{unknown[0]}]; known are {', '.join(default.lines)}"
        )
    for name, line in own.lines.items():
        if len(line.zero) != len(default.lines[name].zero):
            raise CalibrationError(
                f"{path}: [{name}] has {len(line.zero)} numbers in zero and slope,"
                f" expected {len(default.lines[name].zero)}"
            )
        if line.unit != default.lines[name].unit:
            raise CalibrationError(
                f"{path}: [{name}] unit is {line.unit!r}, expected {default.lines[name].unit!r}:"
                " slope is in that unit per raw unit"
            )
    return replace(own, lines=default.lines | own.lines)


def _read(path: Path) -> Calibration:
    return _of_text(read_text(path, CalibrationError, "TOML"), path)


def _of_text(text: str, path: Path) -> Calibration:
    raw = parse_toml(text, str(path), CalibrationError)
    if raw.get("format") != FORMAT or raw.get("version") != VERSION:
        raise CalibrationError(
            f"{path}: format {shown(raw.get('format'))} version {shown(raw.get('version'))},"
            f" expected {FORMAT!r} version {VERSION}"
        )
    default = bool(raw.get("default", False))
    lines = {
        f"{table}.{channel}": _line(path, f"{table}.{channel}", entry, default)
        for table, entries in raw.items()
        if isinstance(entries, dict) and table != ERRORS
        for channel, entry in entries.items()
    }
    errors = raw.get(ERRORS, {})
    if not isinstance(errors, dict) or not all(isinstance(e, dict) for e in errors.values()):
        raise CalibrationError(f"{path}: {ERRORS} is {errors!r}, expected tables [{ERRORS}.NAME]")
    name, date = str(raw.get("name", path.stem)), str(raw.get("date", ""))
    return Calibration(name, date, path, text, lines, errors)


def _line(path: Path, name: str, entry: Any, default: bool) -> Line:
    if not isinstance(entry, dict):
        raise CalibrationError(f"{path}: {name} is {shown(entry)}, expected a table of numbers")
    missing = [key for key in (*_NUMBERS, *_TEXTS) if key not in entry]
    if missing:
        raise CalibrationError(f"{path}: [{name}] lacks {', '.join(missing)}")
    numbers: dict[str, tuple[float, ...]] = {}
    for key in _NUMBERS:
        value = entry[key]
        values = value if isinstance(value, list) else [value]
        if not 1 <= len(values) <= _AXES:
            raise CalibrationError(f"{path}: [{name}] {key} has {len(values)} numbers")
        numbers[key] = tuple(
            _RANGES[key].check(f"{path}: [{name}] {key}", one, CalibrationError) for one in values
        )
    if len(numbers["zero"]) != len(numbers["slope"]) or not all(numbers["slope"]):
        raise CalibrationError(
            f"{path}: [{name}] needs as many zeros as slopes, and no slope of 0;"
            f" found zero {shown(entry['zero'])}, slope {shown(entry['slope'])}"
        )
    unit = str(entry["unit"])
    for slope in numbers["slope"] if unit in _SLOPES else ():
        _SLOPES[unit].check(f"{path}: [{name}] slope", slope, CalibrationError)
    return Line(
        zero=numbers["zero"],
        slope=numbers["slope"],
        zero_sigma=numbers["zero_sigma"][0],
        slope_sigma=numbers["slope_sigma"][0],
        unit=unit,
        source=str(entry["source"]),
        default=bool(entry.get("default", default)),
        curve=_curve(path, name, entry.get("curve", []), len(numbers["zero"])),
    )


def _curve(path: Path, name: str, value: Any, axes: int) -> tuple[float, ...]:
    """Return the two numbers of a curve, or none."""
    if value == []:
        return ()
    if not isinstance(value, list) or len(value) != _CURVE or axes != 1:
        raise CalibrationError(
            f"{path}: [{name}] curve is {shown(value)}, expected two numbers with one zero"
        )
    where = f"{path}: [{name}] curve"
    return tuple(_RANGES["curve"].check(where, one, CalibrationError) for one in value)
