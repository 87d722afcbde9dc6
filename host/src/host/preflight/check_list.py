"""The checks for an aircraft and its settings, in the order of the walk round it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from host.aircraft.file import Aircraft, load_measured, read_document
from host.aircraft.linear_aircraft import load
from host.constants import DEG_PER_RAD
from host.errors import UsageError
from host.near_names import like
from host.physical.calibration import Calibration
from host.preflight.check import Check
from host.preflight.failsafe_check import FailsafeCheck
from host.preflight.hold_check import HoldCheck, held_surfaces
from host.preflight.load_checks import RadioCheck, SupplyCheck
from host.preflight.logger_checks import CardCheck, LoggerCheck, ReceiverCheck
from host.preflight.outside_checks import BaroCheck, GpsCheck
from host.preflight.pilot_settings import PilotSettings
from host.preflight.pitot_check import PitotCheck
from host.preflight.relay_check import RelayCheck
from host.preflight.still_checks import GyroZeroCheck, ImuCheck, RestPressureCheck
from host.preflight.surface_check import SURFACES, SurfaceCheck
from host.preflight.turn_check import TurnCheck
from host.preflight.vane_check import VANES, VaneCheck
from host.wire.flight_card import CardFile, card_faults, card_file, read_card

ITEMS = (
    *("logger", "receiver", "imu", "gyros", "airspeed_rest", "baro", "gps", "card"),
    *("imu_turned", *VANES, "dp_a", "dp_b", *SURFACES, "supply", "relay", "failsafe"),
    *("radio", "hold"),
)
PARTS = {
    "vanes": tuple(VANES),
    "pitots": ("dp_a", "dp_b", "airspeed_rest"),
    "pots": (),  # surfaces are looked at by their channels then
}


@dataclass(frozen=True, slots=True)
class CheckListInputs:
    """What the list of checks depends on.

    Attributes
    ----------
    aircraft : Aircraft
    calibration : Calibration
    settings : PilotSettings
    without : mapping of str to str
        Items or parts left out, and why; they stand on the sheet.
    by_wire : bool
        The source is the USB line, not the radio.
    flight_card : CardFile or None
        The logger's; the hold is looked at where a row holds.
    """

    aircraft: Aircraft
    calibration: Calibration
    settings: PilotSettings = field(default_factory=PilotSettings)
    without: Mapping[str, str] = field(default_factory=dict)
    by_wire: bool = False
    flight_card: CardFile | None = None


def checked_aircraft(source: str) -> Aircraft:
    """Load the aircraft to walk round: a measured one will do.

    Without a section ``surfaces`` its travel is zero, and the way of each surface alone is judged.

    Raises
    ------
    AircraftError
        A number is missing or wrong.
    """
    measured = read_document(source).get("kind") == "measured"
    return load_measured(source) if measured else load(source)


def good_card(path: Path | None) -> CardFile | None:
    """Read the logger's flight card; None without one.

    Raises
    ------
    UsageError
        No such file, or no good card.
    """
    if path is None:
        return None
    data = card_file(path)
    for wrong in card_faults(data):
        raise UsageError(f"{path}: {wrong}")
    return read_card(data)


def check_list(wanted: CheckListInputs) -> list[Check]:
    """Return the checks in their order.

    Parameters
    ----------
    wanted : CheckListInputs
    """
    out = left_out(wanted.without)
    vanes = tuple(name for name in VANES if name not in out)
    sides = tuple(side for side in "ab" if f"dp_{side}" not in out)
    settings = wanted.settings
    checks: list[Check] = [
        LoggerCheck(wanted.aircraft.name), ReceiverCheck(), ImuCheck(), GyroZeroCheck(),
        RestPressureCheck(sides), BaroCheck(), GpsCheck(settings, pitots=bool(sides)), CardCheck(),
        TurnCheck(),
        *(VaneCheck(name, tuple(one for one in vanes if one != name)) for name in vanes),
        *(PitotCheck(side, "".join(one for one in sides if one != side)) for side in sides),
        *(surface_check(wanted, surface) for surface in SURFACES),
        SupplyCheck(), RelayCheck(settings),
        FailsafeCheck(settings), RadioCheck(by_wire=wanted.by_wire), *hold_checks(wanted),
    ]  # fmt: skip
    kept = [check for check in checks if check.key not in out]
    for check in kept:
        check.begin()
    return kept


def hold_checks(wanted: CheckListInputs) -> list[HoldCheck]:
    """Return the check of the hold, none where no row of the card holds."""
    card = wanted.flight_card
    if card is None or not held_surfaces(card):
        return []
    return [HoldCheck(card, by_wire=wanted.by_wire)]


def surface_check(wanted: CheckListInputs, surface: str) -> SurfaceCheck:
    """Return the check of one surface."""
    limit_rad = wanted.aircraft.scalars.get(f"surfaces.{surface}_limit_rad") or None
    slope = wanted.calibration.lines[f"pulse.{surface}"].slope[0]
    limit_deg = None if limit_rad is None else limit_rad * DEG_PER_RAD
    return SurfaceCheck(surface, limit_deg, slope, pots="pots" not in wanted.without)


def left_out(words: Collection[str]) -> set[str]:
    """Return the items that words (items or parts) leave out.

    Raises
    ------
    UsageError
        A word is unknown.
    """
    found: set[str] = set()
    for word in words:
        if word not in ITEMS and word not in PARTS:
            known = (*PARTS, *ITEMS)
            raise UsageError(
                f"--without {word}: no such item{like(word, known)}; known: {', '.join(known)}"
            )
        found |= set(PARTS.get(word, (word,)))
    return found
