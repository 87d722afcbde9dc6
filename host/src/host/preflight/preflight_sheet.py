"""Write and read the sheet of a preflight (TOML): who, when, values, GO or the reasons against."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from host.errors import UsageError
from host.export.atomic_files import atomic_write
from host.export.toml import dumps
from host.files.user_text import parse_toml, read_text, read_toml
from host.live.live_request import Join
from host.live.live_session import LiveSession
from host.physical.calibration import Calibration
from host.preflight.guided_list import Preflight
from host.text import shown

FORMAT = "flight-test-preflight"
VERSION = 1
SUFFIX = ".preflight.toml"
_DIGITS = 4


@dataclass(frozen=True, slots=True)
class Sheet:
    """The result on a sheet.

    Attributes
    ----------
    go : bool
    aircraft, by, date : str
    reasons : dict of str to str
        By item that was not green.
    """

    go: bool
    aircraft: str
    by: str
    date: str
    reasons: dict[str, str]

    def as_json(self) -> dict[str, Any]:
        """Return it as a preflight that has ended says of itself, without its items."""
        return {"items": [], "seen": 0, "ended": True, "go": self.go, "without": {},
                "asked": "", "sheet": f"{self.date} by {self.by or 'nobody named'}"}  # fmt: skip


def sheet_document(preflight: Preflight, by: str, source: str) -> dict[str, Any]:
    """Return the sheet as plain data.

    Parameters
    ----------
    preflight : Preflight
    by : str
        Who did it.
    source : str
        Where the stream came from.
    """
    calibration = preflight.wanted.calibration
    items = {}
    for check in preflight.checks:
        item: dict[str, Any] = {"state": check.state.value}
        if check.state != "seen":
            item["reason"] = check.reason or check.missing()
        numbers = {n: v for n, v in check.values.items() if math.isfinite(v)}
        items[check.key] = item | {n: float(f"{v:.{_DIGITS}g}") for n, v in numbers.items()}
    logger = {k: str(preflight.logger[k]) for k in ("board", "firmware") if k in preflight.logger}
    return {
        "format": FORMAT,
        "version": VERSION,
        "go": preflight.go,
        "aircraft": preflight.wanted.aircraft.name,
        "by": shown(by),
        "date": datetime.now().astimezone().isoformat(timespec="seconds"),
        "source": source,
        "calibration": calibration.name,
        "logger": logger,
        "without": dict(preflight.wanted.without),
        "item": items,
    }


def write_sheet(path: Path, document: dict[str, Any]) -> None:
    """Write a sheet.

    Raises
    ------
    UsageError
        If it cannot be written.
    """
    with atomic_write(path) as part:
        part.write_text(dumps(document), encoding="utf-8")


def sheet_of(log: Path) -> Path | None:
    """Return the sheet next to a log or capture, None if there is none."""
    path = log.with_suffix(SUFFIX)
    return path if log.suffix and path.is_file() else None


def sheet_lines(text: str) -> list[str]:
    """Return a sheet for people: GO or not, who and when, an item a line; empty if it is none.

    Parameters
    ----------
    text : str
        Text of a file.
    """
    try:
        document = parse_toml(text, "sheet", UsageError)
    except UsageError:
        return []
    items = document.get("item")
    if document.get("format") != FORMAT or not isinstance(items, dict):
        return []
    word = "GO" if document.get("go") is True else "NO-GO"
    by = document.get("by") or "nobody named"
    lines = [f"{word}: {document.get('aircraft')}, {document.get('date')}, by {by}"]
    for key, item in items.items():
        if isinstance(item, dict):
            numbers = [f"{n} {v:g}" for n, v in item.items() if isinstance(v, int | float)]
            said = item.get("reason") or ", ".join(numbers)
            lines.append(
                f"{'ok' if item.get('state') == 'seen' else 'NO':3s}{key:14s} {said}"[:120].rstrip()
            )
    without = document.get("without")
    left = without.items() if isinstance(without, dict) else ()
    return lines + [f"--  {key:13s} left out: {why}" for key, why in left]


def read_sheet(path: Path) -> Sheet:
    """Read a sheet.

    Raises
    ------
    UsageError
        If it is none.
    """
    document = read_toml(path, UsageError)
    items = document.get("item")
    if document.get("format") != FORMAT or not isinstance(items, dict):
        raise UsageError(f"{path}: no preflight sheet; expected what `host preflight` wrote")
    reasons = {
        str(key): str(item.get("reason", ""))
        for key, item in items.items()
        if isinstance(item, dict) and item.get("state") != "seen"
    }
    go = document.get("go") is True and not reasons
    texts = [str(document.get(name, "")) for name in ("aircraft", "by", "date")]
    return Sheet(go, texts[0], texts[1], texts[2], reasons)


def shown_sheet(path: Path) -> Join:
    """Return a function that shows a sheet's GO in a live session and notes it in the capture.

    Raises
    ------
    UsageError
        If it is none.
    """
    sheet = read_sheet(path)

    def join(session: LiveSession, calibration: Calibration) -> Callable[[], None]:
        del calibration
        session.state.preflight = sheet.as_json
        session.state.say("preflight", f"{'GO' if sheet.go else 'NO-GO'}: {path.name}")
        text = read_text(path, UsageError)
        session.note("preflight_sheet", go=sheet.go, sheet=text)
        near = session.capture.path.with_suffix(SUFFIX) if session.capture else path
        if not near.exists():  # the flight's log has its own
            near.write_text(text, encoding="utf-8")
        return lambda: None

    return join
