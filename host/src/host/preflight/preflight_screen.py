"""The list on a terminal: drawn over the last one; elsewhere a line for each change."""

from __future__ import annotations

import json
import shutil
import sys
import textwrap
from collections.abc import Callable
from typing import Any

from host.live.live_session import Audience
from host.terminal import bare

_IN = " " * 5
_NOW_ROWS = 6
_MARKS = {"seen": "ok", "failed": "NO", "waiting": ".."}


def list_lines(said: dict[str, Any], width: int = 100, rows: int = 60) -> list[str]:
    """Return a preflight's list in words.

    Parameters
    ----------
    said : dict
        As `Preflight.as_json` gives it.
    width, rows : int
        Size of the terminal; where it is too low what is green is one line.
    """
    green = [f"ok {item['title']}"[:width] for item in said["items"] if item["state"] == "seen"]
    lines = [line for item in said["items"] for line in _item_lines(item, width)]
    if len(lines) > rows - _NOW_ROWS:
        others = [one for one in said["items"] if one["state"] == "failed"]
        lines = [f"ok {len(green)} of {len(said['items'])}"]
        lines += [line for item in others for line in _item_lines(item, width)]
        lines = lines[: max(1, rows - _NOW_ROWS)]
    asked = next((item for item in said["items"] if item["asked"]), None)
    if said["ended"]:
        return [*lines, "GO" if said["go"] else "NO-GO"]
    if asked is None:
        return lines + _watched(said, width)
    lines += textwrap.wrap(f"now: {asked['title']}: {asked['step']}", width, subsequent_indent=_IN)
    return lines + textwrap.wrap(asked["reason"], width, initial_indent=_IN, subsequent_indent=_IN)


def _item_lines(item: dict[str, Any], width: int) -> list[str]:
    """Return an item, and beneath it why it is red."""
    mark = ">>" if item["asked"] and item["state"] == "waiting" else _MARKS[item["state"]]
    lines = [f"{mark} {item['title']}"[:width]]
    if item["state"] == "failed":
        lines += textwrap.wrap(item["reason"], width, initial_indent=_IN, subsequent_indent=_IN)
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
        self._end_shown = False

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
            size = shutil.get_terminal_size()
            self._draw(list_lines(said, size.columns - 1, size.lines))
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
        if said["ended"] and not self._as_json and not self._end_shown:
            self._end_shown = True
            self._show("GO" if said["go"] else "NO-GO")

    def _changed(self, item: dict[str, Any]) -> None:
        if item["state"] != "waiting":
            reason = f": {item['reason']}" if item["reason"] else ""
            self._show(f"{_MARKS[item['state']]} {item['title']}{reason}")

    def show_line(self, text: str) -> None:
        """Say something above the list."""
        lines = self._last
        self._erase()
        print(f"host: {text}", file=sys.stderr, flush=True)
        if self._redraw and lines:
            self._draw(lines)

    def _erase(self) -> None:
        if self._rows:
            bare(sys.stdout).write(f"\033[{self._rows}A\033[J")
            sys.stdout.flush()
        self._rows, self._last = 0, []

    def _draw(self, lines: list[str]) -> None:
        if lines == self._last:
            return
        self._erase()
        sys.stdout.write("\n".join(lines) + "\n")
        sys.stdout.flush()
        self._rows, self._last = len(lines), lines
