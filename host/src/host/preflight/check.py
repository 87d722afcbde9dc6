"""The base of all checks: each waits, has passed, or has failed with its reason."""

from __future__ import annotations

from enum import StrEnum

from host.preflight.preflight_limits import limits
from host.preflight.sample import Sample, SlowReading


class State(StrEnum):
    """State of a check."""

    WAITING = "waiting"
    SEEN = "seen"
    FAILED = "failed"


class Check:
    """One item of the list; fed in order, it decides by itself.

    Parameters
    ----------
    key : str
        Its name on the sheet.
    title : str
        In the list.
    step : str
        What the pilot does.

    Attributes
    ----------
    asked : bool
        True where a motion is asked for: one such item at a time. Others watch all the time.
    latched : bool
        True if a passed check ignores further rows.
    hears_always : bool
        True where a motion is asked for, and slower frames of any time are its answer.
    state : State
    reason : str
        Why it failed; while it waits, the progress so far.
    values : dict of str to float
        For the sheet; names end in their unit.
    """

    asked = False
    latched = False
    hears_always = False
    limits_of = ""

    def __init__(self, key: str, title: str, step: str) -> None:
        self.key, self.title, self.step = key, title, step
        self.limit = limits(self.limits_of or key)
        self.state = State.WAITING
        self.reason = ""
        self.values: dict[str, float] = {}

    def begin(self) -> None:
        """Reset the check: the pilot does the motion (again) now."""
        self.state, self.reason, self.values = State.WAITING, "", {}

    def take(self, sample: Sample) -> None:
        """Take a row."""

    def take_reading(self, reading: SlowReading) -> None:
        """Take a slower frame."""

    def missing(self) -> str:
        """Return why it is not yet passed: the reason on the sheet if the pilot goes on."""
        return self.reason or "not seen"

    def pass_check(self) -> None:
        """Turn green."""
        self.state, self.reason = State.SEEN, ""

    def fail_check(self, reason: str) -> None:
        """Turn red, and say why."""
        self.state, self.reason = State.FAILED, reason

    def keep_waiting(self, reason: str) -> None:
        """Go back to waiting, and say for what."""
        self.state, self.reason = State.WAITING, reason


class AskedCheck(Check):
    """An item whose motion is asked for."""

    asked = True
