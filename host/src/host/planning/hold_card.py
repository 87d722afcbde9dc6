"""The gains of the logger's hold as its flight card has them: whole numbers of ticks and counts.

`host tune --for mega` writes angles of the surface per angle and rate. The servo's calibration
turns them into pulses, and with them the sign: a longer pulse may raise the angle or lower it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

from host.errors import UsageError
from host.files import toml_reader
from host.files.user_text import read_toml
from host.physical.calibration import Calibration
from host.wire.flight_card import HELD
from host.wire.schema_text import packed_schema

ANGLES = {"aileron": ("roll", "p"), "elevator": ("pitch", "q")}
SAMPLE_S = 0.005  # of the IMU
TICKS_PER_US = 2
GAIN_STEPS, INTEGRAL_STEPS = 1 << 14, 1 << 20  # of a tick (core/attitude_hold.cpp)
MOST = 32_767
NAME_BYTES = 16


class HoldError(UsageError):
    """Gains that no card can carry: what was found, what was expected."""


@dataclass(frozen=True, slots=True)
class HoldGains:
    """Gains of `host tune --for mega`.

    Attributes
    ----------
    model, day : str
        Aircraft of the model behind them; the day of its covariance.
    angle, integral_per_s, rate_s : dict of str to float
        By surface, its angle per angle of the aircraft; positive turns it back.
    sense : dict of str to float
        1 or -1: which way a positive angle of the surface turns the aircraft.
    """

    model: str
    day: date
    angle: Mapping[str, float]
    integral_per_s: Mapping[str, float]
    rate_s: Mapping[str, float]
    sense: Mapping[str, float]


def read_gains(path: Path) -> HoldGains:
    """Return the gains of a file.

    Raises
    ------
    HoldError
        A key is missing or no number, or a gain is not positive.
    """
    found = read_toml(path, HoldError)

    def value(name: str) -> float:
        if name not in found:
            raise HoldError(f"{path}: no {name}, expected the file that host tune --for mega saves")
        return toml_reader.number(f"{path}: {name}", found[name], HoldError)

    def gains(what: str, least: float) -> dict[str, float]:
        each = {a: value(f"{ANGLES[a][0]}_{what}_gain") for a in HELD}
        for surface, gain in each.items():
            if gain < least or (what == "angle" and gain == 0.0):
                raise HoldError(
                    f"{path}: {what} gain of the {surface} is {gain:g}, expected above 0"
                )
        return each

    try:
        day = date.fromisoformat(str(found.get("covariance_date")))
    except ValueError:
        raise HoldError(
            f"{path}: covariance_date is {found.get('covariance_date')!r}, expected a day"
        ) from None
    sense = {surface: value(f"{surface}_sense") for surface in HELD}
    if any(abs(one) != 1.0 for one in sense.values()):
        raise HoldError(f"{path}: aileron_sense, elevator_sense are 1 or -1")
    return HoldGains(
        str(found.get("aircraft", "")), day,
        gains("angle", 0.0), gains("integral", 0.0), gains("rate", 0.0), sense,
    )  # fmt: skip


def hold_part(
    gains: HoldGains, calibration: Calibration, authority_us: Sequence[int]
) -> dict[str, Any]:
    """Return `card_hold` of the flight card's file (wire/flight_card.py).

    Parameters
    ----------
    gains : HoldGains
    calibration : Calibration
        Calibration of the servos that fly it.
    authority_us : sequence of int
        Largest deflection of aileron and elevator.

    Raises
    ------
    HoldError
        A gain has no whole number of 16 bits.
    """
    ident = packed_schema().by_name["ident"]
    part: dict[str, Any] = {
        "model": gains.model.encode("ascii", "replace")[:NAME_BYTES],
        "model_date": int(gains.day.strftime("%Y%m%d")),
        "authority_us": [int(us) for us in authority_us],
        "angle_gain": [], "integral_gain": [], "rate_gain": [],
    }  # fmt: skip
    for surface in HELD:
        ticks_per_rad = TICKS_PER_US * gains.sense[surface]
        ticks_per_rad /= calibration.lines[f"pulse.{surface}"].slope[0]
        angle = ident.field("phi").scale * ticks_per_rad
        rate = ident.field(ANGLES[surface][1]).scale * ticks_per_rad
        exact = {
            "angle_gain": gains.angle[surface] * angle * GAIN_STEPS,
            "integral_gain": gains.integral_per_s[surface] * SAMPLE_S * angle * INTEGRAL_STEPS,
            "rate_gain": gains.rate_s[surface] * rate * GAIN_STEPS,
        }
        for name, number in exact.items():
            if abs(number) > MOST or (name == "angle_gain" and round(number) == 0):
                raise HoldError(
                    f"{name} of the {surface} is {number:.0f} in the card's steps, expected 1 to"
                    f" {MOST}"
                )
            part[name].append(round(number))
    return part
