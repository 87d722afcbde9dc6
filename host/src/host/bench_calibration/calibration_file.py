"""Write the dated calibration file: new lines replace their old ones, the rest stays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from host.bench_calibration.bench_plan import Subject
from host.bench_calibration.calibrated_lines import Calibrated
from host.bench_calibration.line_fit import LineFit
from host.errors import CalibrationError
from host.export.atomic_files import atomic_write
from host.export.toml import dumps
from host.files.user_text import read_toml
from host.physical.calibration import FORMAT, VERSION, load_calibration

IMU = {"accelerometers": "accel", "gyros": "gyro"}


@dataclass(frozen=True, slots=True)
class Made:
    """Particulars of a calibration: person, serials, temperature.

    Attributes
    ----------
    instrument, date : str
    by : str
        Who; empty: nobody said.
    serials : mapping of str to str
        By channel.
    temperature_degc : float or None
    """

    instrument: str
    date: str
    by: str = ""
    serials: Mapping[str, str] | None = None
    temperature_degc: float | None = None


def lines_of(subject: Subject, lines: Sequence[Calibrated], made: Made) -> dict[str, Any]:
    """Return the tables of a calibration file for the lines nobody doubts; of the IMU one table,
    and only where all three axes are there."""
    good = [c for c in lines if c.fit is not None and c.doubt is None]
    if subject.table != "imu":
        return {c.channel: _entry(subject, c.fit, made) for c in good if c.fit is not None}
    fits = [c.fit for c in good if c.fit is not None]
    if len(fits) != len(subject.channels):
        return {}
    first = _entry(subject, fits[0], made)
    entry = {
        **first,
        "zero": [_short(f.zero) for f in fits],
        "slope": [_short(f.slope) for f in fits],
        "zero_sigma": _short(_rms([f.zero_sigma for f in fits])),
        "slope_sigma": _short(_rms([f.slope_sigma for f in fits])),
        "residual": _short(max(f.residual for f in fits)),
    }
    del entry["hysteresis"]
    return {IMU[subject.name]: entry}


def _entry(subject: Subject, fit: LineFit, made: Made) -> dict[str, Any]:
    unit = {"deg": "rad", "mm": "Pa", "m/s": "Pa", "m/s2": "m/s2", "deg/s": "rad/s", "share": ""}
    assert subject.tool is not None
    repeats = len(set(fit.repeat.tolist()))
    serial = (made.serials or {}).get(fit.channel, "")
    words = [
        f"host calibrate {subject.name} with {subject.tool.name}",
        f"{repeats} repeats, {len(fit.raw)} readings",
        *([made.by] if made.by else []),
        made.date,
    ]
    entry: dict[str, Any] = {
        "unit": unit[subject.tool.setting],
        "zero": _short(fit.zero),
        "slope": _short(fit.slope, 10),
        "zero_sigma": _short(fit.zero_sigma),
        "slope_sigma": _short(fit.slope_sigma),
        "source": ", ".join(words),
        "default": False,
        "date": made.date,
        "residual": _short(fit.residual),
        "hysteresis": _short(fit.hysteresis),
    }
    if fit.curve:
        entry["curve"] = [_short(c) for c in fit.curve]
    if serial:
        entry["serial"] = serial
    if made.temperature_degc is not None:
        entry["temperature_degc"] = round(made.temperature_degc, 1)
    return entry


def write_lines(path: Path, subject: Subject, tables: Mapping[str, Any], made: Made) -> None:
    """Write lines into a calibration file; what else it holds stays.

    Raises
    ------
    CalibrationError
        If the file there is none.
    UsageError
        If it cannot be written.
    """
    document: dict[str, Any] = {"format": FORMAT, "version": VERSION}
    if path.exists():
        load_calibration(path)  # refuses what is no calibration
        document = read_toml(path, CalibrationError)
        if document.get("default"):
            raise CalibrationError(
                f"{path}: the default, which nobody measured; name another file with --into"
            )
    document |= {"name": made.instrument, "date": made.date}
    document[subject.table] = {**document.get(subject.table, {}), **tables}
    head = {k: v for k, v in document.items() if not isinstance(v, dict)}
    rest = {k: v for k, v in document.items() if isinstance(v, dict)}
    with atomic_write(path) as part:
        part.write_text(dumps(head | rest), encoding="utf-8")
        load_calibration(part)


def _short(value: float, digits: int = 6) -> float:
    return float(f"{value:.{digits}g}")


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
