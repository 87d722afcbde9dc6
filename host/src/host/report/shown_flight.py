"""A flight to show: columns in SI, maneuvers, events, losses and its summary."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from host.arrays import Array
from host.sysid.maneuvers import DetectedManeuver, Grade

GOOD, FAIR = 0.6, 0.3  # grades from these on
_NO_BOARDS = ("sitl",)  # names of the recorder's own program without an aircraft about it
GAP_STEPS = 1.5  # of the usual interval: beyond it a sample is missing


@dataclass(frozen=True, slots=True)
class Happening:
    """An event of the recorder or a lost range, with its time.

    Attributes
    ----------
    t_s : float
    text : str
    end_s : float
        End of a range; `t_s` where it is an instant.
    """

    t_s: float
    text: str
    end_s: float


@dataclass(frozen=True, slots=True)
class ServoJump:
    """A servo's pulse that leaves and returns at once while the stick stands still."""

    t_s: float
    channel: str


@dataclass(frozen=True, slots=True)
class ShownFlight:
    """One flight.

    Attributes
    ----------
    name : str
        File name without control characters and markup.
    columns : mapping of str to (rows,) array
        As `host.physical.columns.COLUMNS` names them, SI, ``t_s`` rising; where rows are missing a
        row of NaN stands, so that no line is drawn over a gap.
    units, texts : mapping of str to str
    lines : list of str
        Lines of `host decode`.
    summary : dict
        The same as data.
    maneuvers : list of (DetectedManeuver, Grade)
    events, losses : list of Happening
    jumps : list of ServoJump
    shares : tuple of str
        Surfaces that are shares of full travel, not angles.
    notes : list of str
        Lines on what could not be shown, and why.
    position : mapping of str to (fixes,) array
        ``t_s``, ``latitude_deg``, ``longitude_deg``, ``height_m`` at GPS's own instants; empty
        without a fix.
    utc_s : float or None
        Seconds since 1970 (UTC) of ``t_s`` zero, by GPS; None where no receiver said.
    calibration : mapping of str to float
        Zero and slope of every channel, by ``channel.zero``; empty where none was used.
    calibration_text : str
        The calibration's file.
    """

    name: str
    columns: Mapping[str, Array]
    units: Mapping[str, str]
    texts: Mapping[str, str]
    lines: list[str]
    summary: dict[str, Any]
    maneuvers: list[tuple[DetectedManeuver, Grade]] = field(default_factory=list)
    events: list[Happening] = field(default_factory=list)
    losses: list[Happening] = field(default_factory=list)
    jumps: list[ServoJump] = field(default_factory=list)
    shares: tuple[str, ...] = ()
    notes: list[str] = field(default_factory=list)
    position: Mapping[str, Array] = field(default_factory=dict)
    utc_s: float | None = None
    calibration: Mapping[str, float] = field(default_factory=dict)
    calibration_text: str = ""

    @property
    def t_s(self) -> Array:
        """Time of the rows, s."""
        return self.columns["t_s"]


def quality(score: float) -> str:
    """Return ``good``, ``fair`` or ``poor`` of a grade from 0 to 1."""
    return "good" if score >= GOOD else "fair" if score >= FAIR else "poor"


def is_simulated(summary: Mapping[str, Any]) -> bool:
    """Return whether the recorder of a log ran on a computer, by its identity frame."""
    return any(one.get("board") in _NO_BOARDS for one in summary.get("sessions", ()))


def with_gaps(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Return columns with a row of NaN wherever rows are missing, and without empty ones.

    Parameters
    ----------
    columns : mapping of str to (rows,) array
        ``t_s`` rising, s.

    Returns
    -------
    dict of str to (more rows,) array, float64
    """
    t_s = np.asarray(columns["t_s"], np.float64)
    steps = np.diff(t_s)
    usual = float(np.median(steps)) if len(steps) else 0.0
    at = np.flatnonzero(steps > GAP_STEPS * usual) + 1 if usual > 0.0 else np.empty(0, np.int64)
    out: dict[str, Array] = {}
    for name, values in columns.items():
        plain = np.asarray(values, np.float64)
        if name == "t_s":
            out[name] = np.insert(t_s, at, t_s[at - 1] + 0.5 * usual) if len(at) else t_s
        elif np.isfinite(plain).any():
            out[name] = np.insert(plain, at, np.nan) if len(at) else plain
    return out
