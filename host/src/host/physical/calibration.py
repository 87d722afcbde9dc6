"""Calibration files: raw -> SI, with source and uncertainty of every number (hw/calibration)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from host.errors import CalibrationError
from host.files.document import parse_toml, read_text
from host.resources import resource

FORMAT = "flight-test-calibration"
VERSION = 1
_NUMBERS = ("zero", "slope", "zero_sigma", "slope_sigma")
ERRORS = "error"
_TEXTS = ("unit", "source")


@dataclass(frozen=True, slots=True)
class Line:
    """value = (raw - zero) * slope.

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
        True if nobody measured them on this instrument.
    """

    zero: tuple[float, ...]
    slope: tuple[float, ...]
    zero_sigma: float
    slope_sigma: float
    unit: str
    source: str
    default: bool


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
        Tables [error.NAME] as they stand: what the instrument may be wrong by beside its lines
        (`host.instrument` reads them).
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
    default = _read(resource("default.toml"))
    if path is None:
        return default
    own = _read(Path(path))
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
    return replace(own, lines=default.lines | own.lines)


def _read(path: Path) -> Calibration:
    text = read_text(path, CalibrationError, "TOML")
    raw = parse_toml(text, str(path), CalibrationError)
    if raw.get("format") != FORMAT or raw.get("version") != VERSION:
        raise CalibrationError(
            f"{path}: format {raw.get('format')!r} version {raw.get('version')!r},"
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
        raise CalibrationError(f"{path}: {name} is {entry!r}, expected a table of numbers")
    missing = [key for key in (*_NUMBERS, *_TEXTS) if key not in entry]
    if missing:
        raise CalibrationError(f"{path}: [{name}] lacks {', '.join(missing)}")
    numbers: dict[str, tuple[float, ...]] = {}
    for key in _NUMBERS:
        value = entry[key]
        values = value if isinstance(value, list) else [value]
        if not all(isinstance(one, int | float) and not isinstance(one, bool) for one in values):
            raise CalibrationError(f"{path}: [{name}] {key} is {value!r}, expected a number")
        numbers[key] = tuple(float(one) for one in values)
        if key.endswith("sigma") and not all(0.0 <= one < math.inf for one in numbers[key]):
            raise CalibrationError(f"{path}: [{name}] {key} is {value!r}, expected 0 or more")
    if len(numbers["zero"]) != len(numbers["slope"]) or not all(numbers["slope"]):
        raise CalibrationError(
            f"{path}: [{name}] needs as many zeros as slopes, and no slope of 0;"
            f" found zero {entry['zero']!r}, slope {entry['slope']!r}"
        )
    return Line(
        zero=numbers["zero"],
        slope=numbers["slope"],
        zero_sigma=numbers["zero_sigma"][0],
        slope_sigma=numbers["slope_sigma"][0],
        unit=str(entry["unit"]),
        source=str(entry["source"]),
        default=bool(entry.get("default", default)),
    )
