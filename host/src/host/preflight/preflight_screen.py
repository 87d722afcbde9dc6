"""The list on a terminal: drawn over the last one; elsewhere a line for each change."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from typing import Any

from host.live.live_session import Audience
from host.terminal import bare

_MARKS = {"seen": "ok", "failed": "NO", "waiting": ".."}


def list_lines(said: dict[str, Any], width: int = 100) -> list[str]:
    """Return a preflight's list in words.

    Parameters
    ----------
    said : dict
        As `Preflight.as_json` gives it.
    width : int
        Characters of a line.
    """
    lines = []
    for item in said["items"]:
        mark = ">>" if item["asked"] and item["state"] == "waiting" else _MARKS[item["state"]]
        reason = f"  {item['reason']}" if item["reason"] and item["state"] == "failed" else ""
        lines.append(f"{mark} {item['title']}{reason}"[:width])
    asked = next((item for item in said["items"] if item["asked"]), None)
    if said["ended"]:
        lines.append("GO" if said["go"] else "NO-GO")
    elif asked is not None:
        lines.append(f"now: {asked['title']}: {asked['step']}"[:width])
        if asked["reason"]:
            lines.append(f"     {asked['reason']}"[:width])
    else:
        lines += _watched(said, width)
    return lines


def _watched(said: dict[str, Any], width: int) -> list[str]:
    """Say what is waited for while nothing is asked to move."""
    waits = [item for item in said["items"] if item["state"] == "waiting" and item["reason"]]
    lines = [f"     {item['title']}: {item['reason']}"[:width] for item in waits[:3]]
    return ["now: aircraft still and level, hands off, transmitter on, pitots covered"[:width],
            *lines]  # fmt: skip


class PreflightScreen(Audience):
    """Shows the list as the session's state comes.

    Parameters
    ----------
    as_json : bool
        One object per change, on stdout, in place of the list.
    show : callable
        Takes lines of the answer.
    """

    def __init__(self, *, as_json: bool, show: Callable[[str], None]) -> None:
        self._as_json, self._show = as_json, show
        self._redraw = sys.stdout.isatty() and not as_json
        self._rows = 0
        self._last: list[str] = []
        self._states: dict[str, str] = {}
        self._told = False

    def rows(self, message: bytes) -> None:
        """Not shown."""

    def state(self, message: str) -> None:
        """Show what changed."""
        said = json.loads(message)["preflight"]
        if said is not None and said["items"]:
            self.take(said)

    def take(self, said: dict[str, Any]) -> None:
        """Show a list."""
        if self._redraw:
            self._draw(list_lines(said, shutil.get_terminal_size().columns - 1))
            return
        for item in said["items"]:
            now = f"{item['state']}{item['asked']}"
            if self._states.get(item["key"]) == now:
                continue
            before = self._states.get(item["key"])
            self._states[item["key"]] = now
            if self._as_json:
                self._show(json.dumps({"type": "item"} | item))
            elif item["asked"] and item["state"] == "waiting":
                self._show(f">> {item['title']}: {item['step']}")
            elif before is not None or item["state"] != "waiting":
                self._changed(item)
        if said["ended"] and not self._as_json and not self._told:
            self._told = True
            self._show("GO" if said["go"] else "NO-GO")

    def _changed(self, item: dict[str, Any]) -> None:
        if item["state"] != "waiting":
            reason = f": {item['reason']}" if item["reason"] else ""
            self._show(f"{_MARKS[item['state']]} {item['title']}{reason}")

    def told(self, text: str) -> None:
        """Leave the list as it is: another line comes below it."""
        self._rows = 0
        self._last = []
        print(f"host: {text}", file=sys.stderr, flush=True)

    def _draw(self, lines: list[str]) -> None:
        if lines == self._last:
            return
        if self._rows:
            bare(sys.stdout).write(f"\033[{self._rows}A\033[J")
        sys.stdout.write("\n".join(lines) + "\n")
        sys.stdout.flush()
        self._rows, self._last = len(lines), lines
