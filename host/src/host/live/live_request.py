"""What is asked of `host live`, and where its bytes come from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from host.aircraft.file import load_measured
from host.chart_library import chart_script
from host.errors import UsageError
from host.extras import install_hint
from host.live.live_session import LiveSession
from host.live.live_sources import (
    Source,
    is_file_like,
    port_source,
    udp_source,
)
from host.live.map_tiles import open_tiles
from host.live.replay import replay_source
from host.live.udp_place import udp_place
from host.physical.calibration import Calibration
from host.planning.wanted_widths import wanted_widths
from host.wire.flight_card import card_file

if TYPE_CHECKING:
    pass

MOST_PORT = 65535
MOST_BAUD = 10_000_000
# Who works on the session too, and what to do before its capture is closed.
Join = Callable[[LiveSession, Calibration], Callable[[], None]]


@dataclass(slots=True)
class LiveRequest:
    """What was asked for on the command line."""

    source: str | None = None
    output: Path | None = None
    baud: int | None = None
    calibration: Path | None = None
    rate_hz: float | None = None
    port: int | None = None
    lan: bool = False
    page: bool = True
    json: bool = False
    mavlink: str | None = None
    plotjuggler: str | None = None
    aircraft: str | None = None
    wanted: str | None = None
    card: str | None = None
    flight_card: Path | None = None
    distance_m: float | None = None  # largest from home; without it that of a flight card
    tiles: Path | None = None
    seed: int = 0
    opened: Source | None = None  # in place of what `source` names
    joins: list[Join] = field(default_factory=list)


def open_source(request: LiveRequest, tell: Callable[[str], None]) -> Source:
    """Return what the request names; raises HostError in one line."""
    text = request.source
    virtual = text is not None and text.startswith("sim:")
    if request.flight_card is not None and not virtual:
        raise UsageError("--flight-card goes with sim:CARD: a real logger has its card in itself")
    if text is not None and text.startswith("replay:"):
        return replay_source(text.removeprefix("replay:"), request.rate_hz)
    if text is not None and virtual:
        try:
            from host.live.simulated_source import SimulatedSource
        except ImportError as error:
            raise UsageError(
                f"a virtual flight needs {error.name}: {install_hint(error.name)}"
            ) from None
        own = b"" if request.flight_card is None else card_file(request.flight_card)
        return SimulatedSource(text.removeprefix("sim:"), request.seed, own).open(tell)
    if text is not None and text.startswith("udp:"):
        return udp_source(text)
    if text is not None and is_file_like(text):
        return replay_source(text, request.rate_hz)
    return port_source(text, request.baud, tell)


def _page_extras() -> None:
    """Refuse a page whose libraries are missing."""
    for library in ("aiohttp", "simplekml"):
        if find_spec(library) is None:
            raise UsageError(f"the page needs {library}: {install_hint(library)}; or --no-page")
    chart_script()


def check_request(request: LiveRequest) -> None:
    """Refuse a wrong argument or a missing extra before a device is opened and a file is made."""
    if request.page:
        _page_extras()
    for option, number, most in (
        ("--port", request.port, MOST_PORT), ("--baud", request.baud, MOST_BAUD),
    ):  # fmt: skip
        if number is not None and not 0 < number <= most:
            raise UsageError(f"{option} {number}: expected 1 to {most}")
    for option, place in (("--mavlink", request.mavlink), ("--plotjuggler", request.plotjuggler)):
        if place is not None:
            udp_place(option, place)
    if request.tiles is not None:
        open_tiles(request.tiles)
    wanted_widths(request.wanted)
    if request.aircraft:
        load_measured(request.aircraft)
    if request.card is not None:
        from host.twin.testcard import cards

        cards.load(request.card)
