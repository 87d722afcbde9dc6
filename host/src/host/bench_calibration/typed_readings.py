"""Readings that somebody types, each asked for with its position."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from host.bench_calibration.bench_plan import Subject
from host.bench_calibration.held_position import Held
from host.errors import UsageError

ENDS = ("q", "quit", "end")
_BACK = "b"


class TypedSource:
    """Held positions that somebody reads aloud at the bench.

    `asks` is what the question ends with.

    Parameters
    ----------
    subject : Subject
    channel : str
    positions : sequence of float
        Positions of one repeat.
    ask : callable
        Takes a question, returns the typed line; empty at the end of the input.
    say : callable
        Takes a line that needs no answer.
    """

    asks = "counts"

    def __init__(
        self,
        subject: Subject,
        channel: str,
        positions: Sequence[float],
        ask: Callable[[str], str],
        say: Callable[[str], None],
    ) -> None:
        self._subject, self._channel, self._positions = subject, channel, positions
        self._ask, self._say = ask, say

    def held(self) -> list[Held]:
        """Ask for every position of every repeat; `b` takes the last one back, `q` ends.

        Raises
        ------
        UsageError
            If nothing was typed.
        """
        wanted = [
            (repeat, float(p))
            for repeat in range(1, self._subject.repeats + 1)
            for p in self._positions
        ]
        found: list[Held] = []
        while len(found) < len(wanted):
            repeat, position = wanted[len(found)]
            answer = self._ask(self._question(repeat, position, found))
            line = answer.strip().lower()
            if line in ENDS or not answer:
                break
            if line == _BACK:
                found[-1:] = []
                continue
            held = self.read(line, repeat, position)
            if held is None:
                continue
            found.append(held)
        if not found:
            raise UsageError(f"{self._channel}: nothing was read; nothing is written")
        return found

    def read(self, line: str, repeat: int, position: float) -> Held | None:
        """Return the held position of a typed line; None if it must be asked again."""
        try:
            value = float(line)
        except ValueError:
            self._say(f"{line!r} is no number; type the counts, b for back, q to end")
            return None
        return Held(self._channel, repeat, position, {self._channel: value})

    def _question(self, repeat: int, position: float, found: Sequence[Held]) -> str:
        unit = self._subject.tool.setting if self._subject.tool is not None else ""
        last = found[-1] if found else None
        if last is None or last.repeat != repeat:
            side = "tool on anew" if last is not None else "tool on"
        elif last.position == position:
            side = "as before"
        else:
            side = "from below" if position > last.position else "from above"
        return (
            f"{self._channel} repeat {repeat}/{self._subject.repeats}: set {position:+g} {unit}"
            f" ({side}), hold, {self.asks}? "
        )
