"""Every error of an instrument by name: its size, distribution, sensors, and source.

`standard.toml` has them all. A calibration and an aircraft file replace what they know better.
Identification takes one standard deviation of each from here; the virtual flight draws from here.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from host.aircraft.file import Aircraft
from host.constants import EVEN_SD
from host.errors import CalibrationError
from host.physical.calibration import Calibration, Line, load_calibration
from host.physical.recording import OWN, SURFACES

STANDARD, NO_FILE = (Path(__file__).with_name(f"{name}.toml") for name in ("standard", "no_file"))
DISTRIBUTIONS = ("even", "normal")
DRAWN = ("instrument", "flight")
CALIBRATION_FILE, AIRCRAFT_FILE = "calibration file", "aircraft file"
KEYS = ("sigma", "half_width", "distribution", "drawn", "shared", "source")
# Lines of a calibration and the errors their zero and slope have.
LINES = {
    **dict.fromkeys(("alpha_a", "alpha_b", "beta_a", "beta_b"), ("vane_zero_rad", "vane_scale")),
    **dict.fromkeys(("dp_a", "dp_b"), ("pitot_zero_pa", "pitot_scale")),
    **dict.fromkeys(
        ("pot_elevator", "pot_aileron_left", "pot_aileron_right", "pot_rudder"),
        ("pot_zero_rad", "pot_scale"),
    ),
}
PULSES = {f"pulse.{surface}": ("servo_zero_rad", "servo_scale") for surface in SURFACES}
IMU_LINES = {
    "imu.gyro": ("gyro_bias_radps", "gyro_scale"),
    "imu.accel": ("accel_bias_mps2", "accel_scale"),
}


@dataclass(frozen=True, slots=True)
class NamedError:
    """One error of all sensors that have it.

    Attributes
    ----------
    name : str
        Ends in its unit; a share or scale has none.
    sensors : tuple of str
    width : tuple of float
        One per sensor: half-width of an even distribution, standard deviation of a normal one.
    distribution : str
        ``even`` or ``normal``.
    drawn : str
        ``instrument``: constant; ``flight``: new at every power-on.
    shared : tuple of str
        Those of the sensors that have one value in common; others have their own.
    source : str
    aircraft_file : str
        The tolerance of an aircraft file that gives it; empty: none.
    origins : tuple of str
        Where each width comes from, one per sensor; empty: from `source`, a default.
    mean : float
        What is expected of it, and taken out of the columns: of errors that nature has to one side.
    """

    name: str
    sensors: tuple[str, ...]
    width: tuple[float, ...]
    distribution: str
    drawn: str
    shared: tuple[str, ...]
    source: str
    aircraft_file: str = ""
    origins: tuple[str, ...] = ()
    mean: float = 0.0

    @property
    def sigmas(self) -> tuple[float, ...]:
        """One standard deviation of each sensor."""
        return tuple(w * _sd_per_width(self.distribution) for w in self.width)

    def sigma(self, sensor: str) -> float:
        """Return one standard deviation of a sensor's error."""
        return self.sigmas[self.sensors.index(sensor)]

    @property
    def origin_of_each(self) -> tuple[str, ...]:
        """Where the width of each sensor comes from: a file, or a default with its source."""
        return self.origins or (f"default: {self.source}",) * len(self.sensors)

    def origin(self, *sensors: str) -> str:
        """Return where the deviation of these sensors (no names: of all) comes from."""
        each = dict(zip(self.sensors, self.origin_of_each, strict=True))
        return ", ".join(dict.fromkeys(each[s] for s in sensors or self.sensors))

    def of_mean(self, *sensors: str) -> float:
        """Return one standard deviation of the mean error of these sensors (no names: of all)."""
        named = sensors or self.sensors
        common = sum(self.sigma(s) for s in named if s in self.shared)
        own = sum(self.sigma(s) ** 2 for s in named if s not in self.shared)
        return math.sqrt(common**2 + own) / len(named)


@dataclass(frozen=True, slots=True)
class InstrumentErrors:
    """All errors of an instrument, by name."""

    named: Mapping[str, NamedError]

    def __getitem__(self, name: str) -> NamedError:
        """Return an error by name."""
        return self.named[name]

    def __iter__(self) -> Iterator[NamedError]:
        """Go through all errors."""
        return iter(self.named.values())

    def about_none(self) -> InstrumentErrors:
        """Return the same for columns as they are: root mean squares in place of deviations."""
        one_sided = {
            e.name: replace(
                e,
                width=tuple(math.hypot(e.mean, sigma) for sigma in e.sigmas),
                distribution="normal",
                mean=0.0,
            )
            for e in self
            if e.mean
        }
        return InstrumentErrors({**self.named, **one_sided})

    def scaled(self, factor: float, *names: str) -> InstrumentErrors:
        """Return a copy in which the named errors, or all, are `factor` times as large."""
        wanted = names or tuple(self.named)
        changed = {
            n: replace(self[n], width=tuple(factor * w for w in self[n].width)) for n in wanted
        }
        return InstrumentErrors({**self.named, **changed})


@cache
def standard_errors() -> InstrumentErrors:
    """Return the errors of an instrument that was calibrated once, as `standard.toml` has them."""
    document = tomllib.loads(STANDARD.read_text(encoding="utf-8"))
    found = {}
    for name, table in document["error"].items():
        key = table.get("aircraft_file", "")
        blank = NamedError(name, tuple(table["sensors"]), (), "even", "flight", (), "", key)
        kept = {k: v for k, v in table.items() if k in KEYS}
        found[name] = _apply_table(blank, kept, f"{STANDARD.name}: [error.{name}]")
    return InstrumentErrors(found)


@cache
def usual_errors(maker: str) -> InstrumentErrors:
    """Return the errors to assume for a maker's sensors (`Recording.maker`) without a calibration:
    those of `standard.toml`, with `autopilot.toml` or `foreign.toml` over them.
    """
    found = dict(standard_errors().named)
    if maker == OWN:
        return InstrumentErrors(found)
    for name, table in _of_maker(maker).items():
        found[name] = _apply_table(found[name], table, f"{maker}.toml: [error.{name}]")
    return InstrumentErrors(found)


@cache
def _of_maker(maker: str) -> Mapping[str, Mapping[str, object]]:
    """Return the tables [error.NAME] of a maker's sensors."""
    path = Path(__file__).with_name(f"{maker}.toml")
    tables: dict[str, dict[str, object]] = tomllib.loads(path.read_text(encoding="utf-8"))["error"]
    return tables


def errors_without_file(maker: str, calibration: Calibration | None = None) -> InstrumentErrors:
    """Return the errors of the sensors of an aircraft of which there is no file.

    Parameters
    ----------
    maker : str
        Whose sensors they are (`Recording.maker`).
    calibration : Calibration, optional
        That made the columns, or says better. Without one sensors of our own logger are out of the
        box.
    """
    if calibration is None and maker == OWN:
        calibration = load_calibration()
    known = instrument_errors(None, calibration, defaults=True, maker=maker)
    found = dict(known.named)
    stated = calibration.errors if calibration is not None else {}
    for name, table in tomllib.loads(NO_FILE.read_text(encoding="utf-8"))["error"].items():
        # A sensor of others is known no better by what nobody knows of it.
        if name not in stated and (maker == OWN or name not in _of_maker(maker)):
            kept = {k: v for k, v in table.items() if k in KEYS}
            usual = _apply_table(found[name], kept, f"{NO_FILE.name}: [error.{name}]")
            found[name] = replace(usual, mean=table.get("mean", 0.0))
    return InstrumentErrors(found)


def instrument_errors(
    aircraft: Aircraft | None = None,
    calibration: Calibration | None = None,
    *,
    defaults: bool = False,
    maker: str = OWN,
) -> InstrumentErrors:
    """Return the standard deviation of every named error of an instrument.

    Parameters
    ----------
    aircraft : Aircraft, optional
        Gives tolerances of mass, places and upwash.
    calibration : Calibration, optional
        Gives the deviations of its measured lines and its tables [error.NAME].
    defaults : bool
        Whether calibration lines that nobody measured on this instrument count too, because the
        columns were made with them. Their deviations are those of a sensor out of the box; if they
        do not count, the standard errors stay.
    maker : str
        Whose sensors they are (`Recording.maker`); sensors of others have larger errors.

    Raises
    ------
    CalibrationError
        If an error is unknown, or a key of it or its value is not what it may be.
    """
    found = dict(usual_errors(maker).named)
    if aircraft is not None:
        for name, error in found.items():
            if error.aircraft_file:
                tolerance = aircraft.scalar(error.aircraft_file)
                source = aircraft.sources.get(error.aircraft_file, error.source)
                count = len(error.sensors)
                found[name] = replace(
                    error,
                    width=(tolerance,) * count,
                    source=source,
                    origins=(AIRCRAFT_FILE,) * count,
                )
    if calibration is not None:
        for name, line in calibration.lines.items():
            if defaults or not line.default:
                _apply_line(found, name, line)
        for name, table in calibration.errors.items():
            where = f"{calibration.path}: [error.{name}]"
            if name not in found:
                raise CalibrationError(
                    f"{where} is unknown; known are {', '.join(n for n in found)}"
                )
            if found[name].aircraft_file:
                raise CalibrationError(
                    f"{where} belongs into the aircraft file, as {found[name].aircraft_file}"
                )
            stated = (CALIBRATION_FILE,) * len(found[name].sensors)
            found[name] = replace(_apply_table(found[name], table, where), origins=stated)
    return InstrumentErrors(found)


def _apply_line(found: dict[str, NamedError], name: str, line: Line) -> None:
    """Take zero and slope deviations from a calibration line for the sensors of that line."""
    channel = name.partition(".")[2]
    if name in IMU_LINES:
        zero, scale = IMU_LINES[name]
        sensors, by_zero = found[zero].sensors, line.zero_sigma
    elif name.startswith("channel.") and channel in LINES:
        zero, scale = LINES[channel]
        sensors, by_zero = (channel,), line.zero_sigma * abs(line.slope[0])
    elif name in PULSES:
        zero, scale = PULSES[name]
        sensors, by_zero = (channel,), line.zero_sigma * abs(line.slope[0])
    else:
        return
    own = f"default: {line.source}" if line.default else CALIBRATION_FILE
    for error, sigma in ((zero, by_zero), (scale, line.slope_sigma)):
        old = found[error]
        width = sigma / _sd_per_width(old.distribution)
        widths = tuple(
            width if s in sensors else w for s, w in zip(old.sensors, old.width, strict=True)
        )
        origins = tuple(
            own if s in sensors else before
            for s, before in zip(old.sensors, old.origin_of_each, strict=True)
        )
        found[error] = replace(old, width=widths, source=line.source, origins=origins)


def _apply_table(error: NamedError, table: Mapping[str, object], where: str) -> NamedError:
    """Return the error updated by its table [error.NAME]; raise for a wrong key or value."""
    unknown = [key for key in table if key not in KEYS]
    if unknown:
        raise CalibrationError(f"{where} has {unknown[0]!r}, expected of {', '.join(KEYS)}")
    for key, known in (("distribution", DISTRIBUTIONS), ("drawn", DRAWN)):
        if table.get(key, known[0]) not in known:
            choice = " or ".join(known)
            raise CalibrationError(f"{where} {key} is {table[key]!r}, expected {choice}")
    if not isinstance(table.get("source"), str) or not table["source"]:
        raise CalibrationError(f"{where} has no source")
    shared = table.get("shared", list(error.shared))
    if not isinstance(shared, list) or any(s not in error.sensors for s in shared):
        raise CalibrationError(f"{where} shared is {shared!r}, expected of {list(error.sensors)}")
    distribution = str(table.get("distribution", error.distribution))
    width = error.width
    if distribution != error.distribution and width:
        ratio = _sd_per_width(error.distribution) / _sd_per_width(distribution)
        width = tuple(ratio * w for w in width)  # the same deviation
    if "sigma" in table and "half_width" in table:
        raise CalibrationError(f"{where} has sigma and half_width, expected one of them")
    for key in ("sigma", "half_width"):
        if key not in table:
            continue
        if key == "half_width" and distribution != "even":
            raise CalibrationError(f"{where} is {distribution} and has half_width, expected sigma")
        width = _one_per_sensor(table[key], len(error.sensors), f"{where} {key}")
        if key == "sigma" and distribution == "even":
            width = tuple(w / EVEN_SD for w in width)
    if not width:
        raise CalibrationError(f"{where} has no sigma")
    return replace(
        error,
        width=width,
        distribution=distribution,
        drawn=str(table.get("drawn", error.drawn)),
        shared=tuple(shared),
        source=str(table["source"]),
    )


def _sd_per_width(distribution: str) -> float:
    """Return the standard deviation of a distribution over its width."""
    return EVEN_SD if distribution == "even" else 1.0


def _one_per_sensor(value: object, count: int, where: str) -> tuple[float, ...]:
    """Return one number per sensor, of a number or a list."""
    listed = value if isinstance(value, list) else [value] * count
    good = [
        x
        for x in listed
        if isinstance(x, int | float) and not isinstance(x, bool) and 0.0 <= x < math.inf
    ]
    if len(good) != len(listed) or len(listed) != count:
        raise CalibrationError(
            f"{where} is {value!r}, expected a number of 0 or more, or {count} of them"
        )
    return tuple(float(x) for x in good)
