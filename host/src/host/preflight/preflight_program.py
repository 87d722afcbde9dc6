"""`host preflight`: `host live` with the list of checks, its sheet, and the pilot's keys."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

from host.export.toml import dumps
from host.link.serial import BAUD
from host.live.live_program import LiveSummary, run_live
from host.live.live_request import LiveRequest
from host.live.live_session import LiveSession
from host.physical.calibration import Calibration
from host.preflight.check import Check, State
from host.preflight.check_list import CheckListInputs, checked_aircraft, good_card, left_out
from host.preflight.guided_list import Preflight
from host.preflight.preflight_screen import PreflightScreen
from host.preflight.preflight_sheet import SUFFIX, sheet_document, write_sheet
from host.terminal import command_line

SIMULATED = "sim:"
PRACTISED = "ultrastick25e"  # aircraft of a virtual walk if none is named


@dataclass(slots=True)
class PreflightRequest:
    """Arguments of the command line.

    Attributes
    ----------
    live : LiveRequest
    aircraft : str
        Name or file.
    by : str
    without : dict of str to str
        Items or parts left out, and why.
    sheet : Path or None
        Next to the capture, or in the working folder, without it.
    as_json : bool
    flight_card : Path or None
        The logger's card: its hold is looked at.
    """

    live: LiveRequest
    aircraft: str
    by: str = ""
    without: dict[str, str] = field(default_factory=dict)
    sheet: Path | None = None
    as_json: bool = False
    flight_card: Path | None = None


@dataclass(slots=True)
class PreflightSummary:
    """Result of a preflight, with the files written."""

    go: bool
    sheet: Path
    live: LiveSummary

    def lines(self, *, page: bool) -> list[str]:
        """Return lines on files and the next step; with a page the capture may hold a flight."""
        lines = self.live.lines()
        if page or not self.go:
            return lines if page else lines[:1]
        return [lines[0], f"next: {command_line('host', 'live', '--preflight', self.sheet)}"]


def run_preflight(
    request: PreflightRequest, screen: PreflightScreen, keys: Callable[[], str] | None
) -> PreflightSummary:
    """Walk round the aircraft until every item is decided (without a page) or Ctrl-C.

    Parameters
    ----------
    request : PreflightRequest
    screen : PreflightScreen
    keys : callable or None
        Waits for a line that the pilot types; None where nobody can.

    Raises
    ------
    HostError
        In one line.
    """
    left_out(request.without)
    aircraft = checked_aircraft(request.aircraft)
    card = good_card(request.flight_card)
    live = request.live
    if live.source is not None and live.source.startswith(SIMULATED):
        from host.preflight.walk_source import walk_source

        live.opened = walk_source(live.source, aircraft, live.seed, request.flight_card)
    done: list[_Walk] = []

    def join(session: LiveSession, calibration: Calibration) -> Callable[[], None]:
        by_wire = session.source.baud == BAUD
        wanted = CheckListInputs(
            aircraft, calibration, without=request.without, by_wire=by_wire, flight_card=card
        )
        walk = _Walk(request, session, wanted, screen)
        done.append(walk)
        if keys is not None:
            threading.Thread(target=walk.listen, args=(keys,), daemon=True).start()
        return walk.close

    live.joins.append(join)
    summary = run_live(live, screen.show_line, lambda line: None)
    walk = done[0]
    return PreflightSummary(walk.preflight.go, walk.sheet, summary)


class _Walk:
    """One preflight in a session: notes, sheet, keys."""

    def __init__(
        self,
        request: PreflightRequest,
        session: LiveSession,
        wanted: CheckListInputs,
        screen: PreflightScreen,
    ) -> None:
        self.preflight = Preflight(wanted, session.stream, self._changed)
        self.sheet = request.sheet or _sheet_path(session)
        self._request, self._session, self._screen = request, session, screen
        self._written = False
        session.state.preflight = self._as_json
        session.asked["preflight"] = self._asked
        session.audiences.append(screen)
        session.note("preflight_begin", aircraft=wanted.aircraft.name, by=request.by)

    def listen(self, keys: Callable[[], str]) -> None:
        """Turn typed lines into the same requests as a page sends."""
        while line := keys():
            words = line.split()
            if not words:
                self._session.ask({"type": "preflight", "do": "next"})
            elif words[0] in ("q", "end"):
                self._session.ask({"type": "preflight", "do": "end"})
            else:
                self._session.ask({"type": "preflight", "do": "again", "item": words[-1]})

    def close(self) -> None:
        """Judge what is left, before the capture is closed."""
        if not self.preflight.ended:
            self.preflight.end()
        if not self._written:
            self._write()
        self._screen.take(self.preflight.as_json())

    def _as_json(self) -> dict[str, Any]:
        """Return the list; behind its last item write the sheet."""
        if self.preflight.ended and not self._written:
            self._write()
        return self.preflight.as_json() | {"sheet": self.sheet.name if self._written else ""}

    def _asked(self, asked: dict[str, Any]) -> None:
        do = asked.get("do")
        if do == "next":
            self.preflight.pass_on()
        elif do == "end":
            self.preflight.end()
        elif self.preflight.again(str(asked.get("item", ""))):
            self._written = False

    def _changed(self, check: Check) -> None:
        """Note a change in the capture, and among the page's events."""
        values = {name: round(value, 4) for name, value in check.values.items()}
        self._session.note(
            "preflight", item=check.key, state=check.state.value, reason=check.reason, values=values
        )
        if check.state == State.FAILED:
            self._session.state.say("preflight", f"{check.title}: {check.reason}")

    def _write(self) -> None:
        self._written = True
        document = sheet_document(self.preflight, self._request.by, self._session.source.name)
        write_sheet(self.sheet, document)
        self._session.note("preflight_sheet", go=self.preflight.go, sheet=dumps(document))
        word = "GO" if self.preflight.go else "NO-GO"
        self._session.state.say("preflight", f"{word}: {self.sheet.name}")
        self._screen.show_line(f"{word}; the sheet is {self.sheet}")
        if not self._request.live.page:
            self._session.enough.set()


def _sheet_path(session: LiveSession) -> Path:
    """Return the sheet's place: next to the capture, else in the working folder."""
    if session.capture is not None:
        return session.capture.path.with_suffix(SUFFIX)
    return Path(datetime.now().strftime("PREFLIGHT-%Y%m%d-%H%M%S.toml"))


def typed_line() -> str:
    """Wait for a line of the terminal; empty when there is no more."""
    return sys.stdin.readline()
