"""An autopilot's log: channels in our names, losses, and whether it serves identification."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from host.arrays import Array
from host.files.regular import regular_file
from host.readers.airborne import Airborne, airborne
from host.readers.ardupilot_channels import ardupilot_channels
from host.readers.autopilot_log import (
    AutopilotLog,
    FlightChoiceError,
    NothingToIdentifyError,
    SensorChoiceError,
)
from host.readers.flown_tests import flown_tests
from host.readers.given_outputs import OUTPUT, with_outputs
from host.readers.gzip_file import given_path
from host.readers.held_outputs import held_output
from host.readers.judgement import Judgement, judge
from host.readers.log_formats import format_of_file, read_messages
from host.readers.mavlink_channels import mavlink_channels
from host.readers.named_channels import Channels
from host.readers.px4_channels import not_flying_signals, px4_channels
from host.readers.signals import Signal
from host.readers.written_parameters import Parameters

SURFACES = ("elevator", "aileron", "rudder")
CLOCK_SHARE = 5e-5  # one deviation of a crystal of 50 ppm


@dataclass(frozen=True, slots=True)
class FlightLine:
    """One flight of a log with several.

    Attributes
    ----------
    number : int
        From 1, in order of the log; what ``--flight`` takes.
    start_s, length_s, airborne_s : float
        By the clock of its own start.
    fastest_mps : float
        NaN where nothing measured it.
    """

    number: int
    start_s: float
    length_s: float
    airborne_s: float
    fastest_mps: float

    @property
    def text(self) -> str:
        """The line in words."""
        speed = "" if np.isnan(self.fastest_mps) else f", up to {self.fastest_mps:.1f} m/s"
        return (
            f"flight {self.number}: from {self.start_s:.1f} s, {self.length_s:.0f} s long,"
            f" {self.airborne_s:.0f} s in the air{speed}"
        )


@dataclass(frozen=True, slots=True)
class AutopilotFlight:
    """One log.

    Attributes
    ----------
    log : AutopilotLog
    channels : Channels
    flown : Airborne
    judgement : Judgement
    number : int
        Number of the flight in its file, from 1.
    listed : tuple of FlightLine
        All flights of the file, where there are several.
    """

    log: AutopilotLog
    channels: Channels
    flown: Airborne
    judgement: Judgement
    number: int = 1
    listed: tuple[FlightLine, ...] = ()

    @property
    def shares(self) -> tuple[str, ...]:
        """Surfaces whose column is a share of full travel, not an angle."""
        return tuple(s for s in SURFACES if s in self.channels.signals)

    @property
    def imu_lag_s(self) -> float:
        """Delay of rates and specific force by the autopilot's own low-pass, nominally."""
        names = ("p_radps", "q_radps", "r_radps", "ax_mps2", "ay_mps2", "az_mps2")
        every = [s.late_s for n in names if (s := self.channels.signals.get(n)) is not None]
        return float(np.mean(every)) if every else 0.0

    def undersampled(self) -> dict[str, float]:
        """Return the rates (Hz) of surfaces whose output changes between two records."""
        pulses_hz = 1.0 / self.channels.output_period_s
        rates = {s: self.channels.signals[s].rate_hz for s in self.shares}
        return {s: rate for s, rate in rates.items() if rate < 0.75 * pulses_hz}

    def refuse(self) -> None:
        """Raise NothingToIdentifyError with one sentence if nothing can be identified."""
        if self.judgement.refusal:
            raise NothingToIdentifyError(self.judgement.refusal)

    def columns(self) -> dict[str, Array]:
        """Return all channels on the union of their instants, NaN where one was not sampled.

        Surfaces are ``elevator_share`` and so on, of full travel. No sensor's value is carried on;
        an output stands until the next pulse (`held_output`).
        """
        period_s = self.channels.output_period_s
        own = {
            name: held_output(signal, period_s)
            if name in (*SURFACES, "throttle")
            else (signal.t_s, signal.values)
            for name, signal in self.channels.signals.items()
        }
        if not own:
            return {}
        # Channels of one message have the same instants.
        instants = {id(t): t for t, _ in own.values()}
        t_s = np.unique(np.concatenate(list(instants.values())))
        result = {"t_s": t_s}
        before, rows = None, np.zeros(0, dtype=np.intp)
        for name, (t, values) in own.items():
            if t is not before:
                before, rows = t, np.searchsorted(t_s, t)
            column = np.full(len(t_s), np.nan)
            column[rows] = values
            result[f"{name}_share" if name in SURFACES else name] = column
        return result

    @property
    def choice(self) -> str:
        """Which flight of several this is, in words; empty of a log with one."""
        if not self.listed:
            return ""
        others = ", ".join(one.text for one in self.listed if one.number != self.number)
        return (
            f"{self.listed[self.number - 1].text}: used, of {len(self.listed)} in this log"
            f" ({others}); --flight takes another"
        )

    def notes(self) -> list[str]:
        """Return lines on chosen sensors, on outputs that became surfaces, and on damage."""
        log = self.log
        said = [self.choice] if self.listed else []
        said += [f"damaged: {one}" for one in log.damage]
        said.append("; ".join(self.judgement.lines[:1]))
        said += self.channels.notes
        said += [f"the autopilot's own test: {test.line}" for test in flown_tests(log)]
        late = sorted({s.late_s for s in self.channels.signals.values() if s.late_s > 0.0})
        if late:
            said.append(
                f"the autopilot's own filters make its IMU {1e3 * late[-1]:.1f} ms late at most;"
                " not taken out, a delay is estimated where nothing gives it"
            )
        return said


def is_autopilot_log(path: Path) -> bool:
    """Return whether a file begins like a log of an autopilot."""
    return path.is_file() and format_of_file(path) is not None


def read_autopilot(
    path: Path, sensors: Mapping[str, int | str] | None = None, flight: int | None = None
) -> AutopilotFlight:
    """Read a log of an autopilot.

    Parameters
    ----------
    path : Path
    sensors : mapping of str to int or str, optional
        Instance to use of a message, in place of the one with most messages; surface that an output
        moves, as ``{"output 2": "elevator"}``.
    flight : int, optional
        Which flight of it, from 1; that with the longest time in the air without.

    Raises
    ------
    NotAutopilotLogError
        If it is none, or holds nothing.
    SensorChoiceError, OutputChoiceError, FlightChoiceError
        If it has no such instance, output, or flight.
    UsageError
        If an extra is missing.
    """
    chosen, outputs = _apart(sensors or {})
    read = read_messages(regular_file(path))
    logs = [with_outputs(replace(log, path=given_path(path)), outputs) for log in read]
    if flight is not None and not 1 <= flight <= len(logs):
        raise FlightChoiceError(f"{path}: no flight {flight}; it has 1 to {len(logs)}")
    if len(logs) == 1:
        return _flight(logs[0], chosen)
    every = [_flight(log, {}) for log in logs]
    best = max(range(len(every)), key=lambda k: every[k].flown.time_s)
    number = best if flight is None else flight - 1
    found = _flight(logs[number], chosen) if chosen else every[number]
    listed = tuple(_line(k, one) for k, one in enumerate(every, start=1))
    return replace(found, number=number + 1, listed=listed)


def _flight(log: AutopilotLog, sensors: Mapping[str, int]) -> AutopilotFlight:
    channels, not_flying = _channels(log, sensors)
    changed = log.parameters.lines() if isinstance(log.parameters, Parameters) else []
    channels.notes[:0] = [*log.remarks, *changed]
    flown = airborne(channels, not_flying)
    return AutopilotFlight(log, channels, flown, judge(log, channels, flown))


def _line(number: int, one: AutopilotFlight) -> FlightLine:
    ends = [s.t_s[k] for s in one.channels.signals.values() for k in (0, -1)]
    first, last = (float(min(ends)), float(max(ends))) if ends else (0.0, 0.0)
    return FlightLine(number, first, last - first, one.flown.time_s, one.flown.fastest_mps)


def _channels(log: AutopilotLog, sensors: Mapping[str, int]) -> tuple[Channels, list[Signal]]:
    """Return the channels, and where the autopilot says that it does not fly on its wing."""
    if log.format == "ulog":
        return px4_channels(log, sensors), not_flying_signals(log)
    if log.format == "tlog":
        return mavlink_channels(log, sensors), []
    return ardupilot_channels(log, sensors), []


def log_choices(sensors: Iterable[str], outputs: Iterable[str] = ()) -> dict[str, int | str]:
    """Return what is chosen of a log from words such as ``IMU=1``, and ``2=elevator`` of outputs.

    Raises
    ------
    SensorChoiceError
        If one is something else.
    """
    found: dict[str, int | str] = {}
    for word in sensors:
        name, _, number = word.partition("=")
        if not name or not number.isdigit():
            raise SensorChoiceError(f"--sensor {word}: expected MESSAGE=N, such as IMU=1")
        found[name] = int(number)
    for word in outputs:
        number, _, surface = word.partition("=")
        found[f"{OUTPUT}{int(number)}"] = surface
    return found


def _apart(choices: Mapping[str, int | str]) -> tuple[dict[str, int], dict[int, str]]:
    """Return the choices among sensors by message, and the surfaces by output."""
    outputs = {
        int(name.removeprefix(OUTPUT)): str(what)
        for name, what in choices.items()
        if name.startswith(OUTPUT)
    }
    return {k: int(v) for k, v in choices.items() if not k.startswith(OUTPUT)}, outputs
