"""The preflight: one stream feeds all checks, one motion at a time is asked for, then GO or not."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from host.live.live_sample import LiveUpdate
from host.live.live_stream import LiveStream
from host.preflight.check import Check, State
from host.preflight.check_list import CheckListInputs, check_list
from host.preflight.load_checks import RadioCheck
from host.preflight.sample import Sample, SlowReading, in_order

_HINT_S = 8.0  # time without success after which the pilot sees the progress so far
_REST_S = 1.0  # pause after a motion that failed early, before the next one is looked for
STILL = ("imu", "gyros", "airspeed_rest")  # before anything is asked to move


class Preflight:
    """The list in use.

    Parameters
    ----------
    wanted : CheckListInputs
    stream : LiveStream
        Subscribed to.
    changed : callable, optional
        Called with a check whenever its state changes.

    Attributes
    ----------
    checks : list of Check
    asked : Check or None
        The motion that is wanted now.
    ended : bool
        Nothing is asked for any more: `go` is the answer.
    """

    def __init__(
        self,
        wanted: CheckListInputs,
        stream: LiveStream,
        changed: Callable[[Check], None] | None = None,
    ) -> None:
        self.wanted = wanted
        self.checks = check_list(wanted)
        self._watching = [check for check in self.checks if not check.asked]
        self._hearing = [c for c in self.checks if c.hears_always or not c.asked]
        self.asked: Check | None = None
        self.ended = False
        self.logger: dict[str, Any] = {}
        self._asked_s = self._now_s = 0.0
        self._stream = stream
        self._changed = changed or (lambda check: None)
        self._passed: set[str] = set()  # the pilot went on
        self._from_s = -math.inf  # rows before it belong to the motion before
        stream.subscribe(self.take)

    @property
    def go(self) -> bool:
        """Whether every item is green."""
        return all(check.state == State.SEEN for check in self.checks)

    def take(self, update: LiveUpdate) -> None:
        """Take a portion of the stream."""
        if self.ended:
            return
        before = [check.state for check in self.checks]
        if update.lost and isinstance(self.asked, RadioCheck):
            self.asked.lost(update.lost)
        for one in in_order(update, self._stream.schema):
            if isinstance(one, SlowReading):
                self._hear(one)
            else:
                self._look(one)
        for check, state in zip(self.checks, before, strict=True):
            if check.state != state:
                self._changed(check)

    def _hear(self, reading: SlowReading) -> None:
        """Hand a slower frame to all that hear it, and to the motion asked for."""
        self.wanted.settings.take_reading(reading)
        if reading.name in ("identity", "status"):
            self.logger = reading.said
        for check in self._hearing:
            check.take_reading(reading)
        if self.asked is not None:
            if not self.asked.hears_always:
                self.asked.take_reading(reading)
            self._decided(reading.t_s)

    def _look(self, sample: Sample) -> None:
        """Hand a row to all that watch, and to the motion asked for."""
        self._now_s = sample.t_s
        for check in self._watching:
            if not check.latched or check.state is not State.SEEN:
                check.take(sample)
        if self.asked is None:
            self._go_on()
        elif sample.t_s >= self._from_s:
            self.asked.take(sample)
            self._decided(sample.t_s)

    def _decided(self, t_s: float) -> None:
        """Ask for the next motion when this one is decided."""
        if self.asked is None or self.asked.state is State.WAITING:
            return
        if self.asked.state is State.FAILED:
            self._from_s = t_s + _REST_S
        self._go_on()

    def pass_on(self) -> None:
        """Skip the motion that is asked for: it stays red, with its progress so far."""
        if self.asked is not None and self.asked.state == State.WAITING:
            self.asked.fail_check(self.asked.missing())
            self._changed(self.asked)
        elif self.asked is None:  # what is watched does not turn green: the pilot goes on
            self._passed |= set(STILL)
            if not any(check.asked and check.state == State.WAITING for check in self.checks):
                self.end()
        self._go_on()

    def again(self, key: str) -> bool:
        """Ask for a motion again, or watch an item anew; False if there is no such item."""
        for check in self.checks:
            if check.key == key:
                check.begin()
                if check.asked:
                    self.asked = check
                    self._asked_s = self._now_s
                self.ended = False
                self._changed(check)
                return True
        return False

    def end(self) -> None:
        """End the list now: items not passed so far count as not passed."""
        for check in self.checks:
            if check.state == State.WAITING:
                check.fail_check(check.missing() if check is self.asked or not check.asked
                             else "not looked at")  # fmt: skip
                self._changed(check)
        self.asked = None
        self.ended = True

    def _go_on(self) -> None:
        """Ask for the next motion when the one before is decided; end behind the last."""
        if self.asked is not None and self.asked.state == State.WAITING:
            return
        waiting = [check for check in self.checks if check.state == State.WAITING]
        still = [c for c in waiting if c.key in STILL and c.key not in self._passed]
        motions = [check for check in waiting if check.asked]
        self.asked = None
        if still:
            return
        self._passed |= set(STILL)  # moved from here on
        if motions:
            self.asked = motions[0]
            self._asked_s = self._now_s
            self.asked.begin()
            if self.asked.state != State.WAITING:
                self._changed(self.asked)
                self._go_on()
        elif not waiting:
            self.ended = True

    def as_json(self) -> dict[str, Any]:
        """Return the list for a page: plain data."""
        seen = sum(check.state == State.SEEN for check in self.checks)
        return {
            "items": [
                {
                    "key": check.key, "title": check.title, "state": check.state.value,
                    "step": check.step, "reason": self._reason(check),
                    "asked": check is self.asked,
                }
                for check in self.checks
            ],
            "seen": seen,
            "ended": self.ended,
            "go": self.go if self.ended else None,
            "without": dict(self.wanted.without),
        }  # fmt: skip

    def _reason(self, check: Check) -> str:
        """Return why it is red, or how far it is."""
        if check.state is not State.WAITING:
            return check.reason
        if not check.asked:
            return check.missing()
        late = check is self.asked and self._now_s - self._asked_s > _HINT_S
        return check.missing() if late else check.reason
