"""The plan of `bench.toml`: subjects, their tools, positions and limits."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from host.constants import GRAVITY_MPS2, RAD_PER_DEG
from host.errors import UsageError
from host.near_names import like

TABLE = Path(__file__).with_name("bench.toml")
WATER_KGPM3 = 998.2  # at 20 deg C; 15 and 25 deg C differ by 0.2 %: in the column's scale
AIR_KGPM3 = 1.225  # sea level, 15 deg C; for a speed run the user gives the density


@dataclass(frozen=True, slots=True)
class Tool:
    """A tool that sets positions; errors are one standard deviation in the unit of its setting.

    Attributes
    ----------
    setting : str
        Unit: deg, mm (of water), m/s, m/s2, deg/s, share.
    own, placing, reading : float
        The same in all repeats; new in every repeat; new at every position.
    scale : float
        Share of the setting.
    """

    name: str
    setting: str
    own: float
    placing: float
    reading: float
    scale: float

    def value(self, setting: float, density_kgpm3: float = AIR_KGPM3) -> float:
        """Return the SI value of a setting: rad, Pa, m/s2, rad/s, share."""
        if self.setting in ("deg", "deg/s"):
            return setting * RAD_PER_DEG
        if self.setting == "mm":
            return setting * 1e-3 * WATER_KGPM3 * GRAVITY_MPS2
        if self.setting == "m/s":
            return 0.5 * density_kgpm3 * setting * abs(setting)
        return setting

    def per_setting(self, setting: float, density_kgpm3: float = AIR_KGPM3) -> float:
        """Return SI per unit of setting there; of a speed at least that of 5 m/s."""
        if self.setting == "m/s":
            return density_kgpm3 * max(abs(setting), 5.0)
        return self.value(1.0)


@dataclass(frozen=True, slots=True)
class Subject:
    """A family of channels that is calibrated in the same way.

    Attributes
    ----------
    table : str
        Section of the calibration file: channel, pulse, imu; empty if the result is stored
        elsewhere.
    positions : tuple
        Positions of one repeat, in the tool's setting; words for the IMU.
    limits : mapping of str to (float or (float, float))
        In raw units.
    signed : bool
        Whether the slope must be positive.
    """

    name: str
    table: str
    channels: tuple[str, ...]
    tool: Tool | None
    turntable: Tool | None
    repeats: int
    positions: tuple[Any, ...]
    signed: bool
    limits: Mapping[str, Any]
    steps: tuple[str, ...]
    source: str

    def steps_for(self, channel: str = "") -> list[str]:
        """Return what to do, in words, for one channel or for the family."""
        words = {
            "channel": channel or " / ".join(self.channels),
            "positions": ", ".join(str(p) for p in self.positions),
            "repeats": self.repeats,
        }
        return [step.format(**words) for step in self.steps]


@cache
def _document() -> dict[str, Any]:
    return tomllib.loads(TABLE.read_text(encoding="utf-8"))


def tools() -> dict[str, Tool]:
    """Return all tools by name."""
    keys = ("setting", "own", "placing", "reading", "scale")
    return {n: Tool(n, *(t[k] for k in keys)) for n, t in _document()["tool"].items()}


def hand_worth() -> float:
    """Return the degrees of freedom with which a tool's stated scatter counts."""
    return float(_document()["hand"]["worth"])


@cache
def subjects() -> dict[str, Subject]:
    """Return all subjects by name, in the order of a calibration."""
    known = tools()
    return {
        name: Subject(
            name=name,
            table=t["table"],
            channels=tuple(t["channels"]),
            tool=known.get(t["tool"]),
            turntable=known.get(t.get("turntable", "")),
            repeats=t["repeats"],
            positions=tuple(t["positions"]),
            signed=t.get("signed", False),
            limits=t["limit"],
            steps=tuple(t["steps"]),
            source=t["source"],
        )
        for name, t in _document()["subject"].items()
    }


def meter_share() -> float:
    """Return one standard deviation of the voltmeter, as a share."""
    return float(_document()["subject"]["supply"]["meter_share"])


def find_subject(word: str) -> tuple[Subject, str]:
    """Return a subject and the channel that is meant; empty: all of the family's.

    Raises
    ------
    UsageError
        If it is neither a subject nor a channel.
    """
    known = subjects()
    if word in known:
        subject = known[word]
        return subject, subject.channels[0] if len(subject.channels) == 1 else ""
    for subject in known.values():
        if word in subject.channels:
            return subject, word
    names = [*known, *(c for s in known.values() for c in s.channels)]
    raise UsageError(
        f"nothing to calibrate is called {word!r}{like(word, names)}; known are {', '.join(known)},"
        " and their channels"
    )


def local_gravity_mps2(latitude_deg: float | None, height_m: float = 0.0) -> float:
    """Return free fall at a latitude (normal gravity, 1967), the standard one without it."""
    if latitude_deg is None:
        return GRAVITY_MPS2
    return 9.7803 * (1.0 + 0.0053024 * math.sin(latitude_deg * RAD_PER_DEG) ** 2) - 3.1e-6 * (
        height_m
    )
