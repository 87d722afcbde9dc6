"""Whether tilt and stick proved, on the ground, the way in which a card's gains move surfaces."""

from __future__ import annotations

from host.preflight.check import AskedCheck
from host.preflight.sample import SlowReading
from host.wire.flight_card import HELD, CardFile, held_axes
from host.wire.schema_text import packed_schema

_WAYS = ("lowers", "raises")  # what a longer pulse does to the angle
_AGAIN = "the logger is off and on again before the next try"


def held_surfaces(card: CardFile) -> tuple[str, ...]:
    """Return the surfaces that any row of a card holds, in their order."""
    held = {axis for row in card.rows for axis in held_axes(row)}
    return tuple(surface for surface in HELD if surface in held)


class HoldCheck(AskedCheck):
    """The logger's events say which surface was proven, which way and when.

    It hears them whenever they come; a logger that was reset has forgotten them.

    Parameters
    ----------
    card : CardFile
        One with gains.
    by_wire : bool
        The source is the USB line, which tells no events.
    """

    hears_always = True

    def __init__(self, card: CardFile, *, by_wire: bool) -> None:
        self._held, self._by_wire, self._hash = held_surfaces(card), by_wire, card.hash
        gains = {} if card.hold is None else dict(zip(HELD, card.hold["angle_gain"], strict=True))
        self._raises = {surface: int(gain) > 0 for surface, gain in gains.items()}
        super().__init__("hold", "hold proven by tilt and stick", "")
        tilt, shown = f"{self.limit['tilt_deg']:.0f} deg", f"{self.limit['shown_s']:.0f} s"
        ways = {
            "aileron": f"right wing down by {tilt}, full aileron against it for {shown}",
            "elevator": f"nose up by {tilt}, full elevator against it for {shown}",
        }
        self._ways = {surface: ways[surface] for surface in self._held}
        self.step = f"card enabled; then {'; then '.join(self._ways.values())}"
        self._uptime_s = -1
        self._forget()

    def begin(self) -> None:
        """Keep what the logger proved: it need not be shown again."""
        super().begin()
        if self._by_wire:
            self.fail_check("not looked at: USB tells no events; run it on the radio's port")
        else:
            self._judge()

    def take_reading(self, reading: SlowReading) -> None:
        """Take an event; a time since power-on that went back is a reset."""
        said = reading.said
        if reading.name == "system" and said["uptime_s"] is not None:  # a status line has none
            uptime_s = said["uptime_s"]
            if uptime_s < self._uptime_s:
                self._forget()
                self._judge()
            self._uptime_s = uptime_s
        elif reading.name == "event":
            self._hear(said["code"], said["arg"], reading.t_s)
            self._judge()

    def missing(self) -> str:
        """Return what is still to be shown."""
        if self.reason:
            return self.reason
        left = [way for surface, way in self._ways.items() if surface not in self._proven]
        return "; then ".join(([] if self._enabled else ["no card was enabled"]) + left)

    def _forget(self) -> None:
        self._proven: dict[str, tuple[bool, float]] = {}
        self._enabled = False
        self._refused = ""

    def _hear(self, code: str, arg: int, t_s: float) -> None:
        if code == "reset":
            self._forget()
        elif code == "card enabled":
            self._forget()
            self._enabled = True
            if arg != self._hash:
                self._refused = f"the logger has card {arg:08x}, the file is {self._hash:08x}"
        elif code == "card refused" and arg == packed_schema().enums["card_fault"]["hold"]:
            self._refused = f"the logger refused the card: gains of another sign; {_AGAIN}"
        elif code == "hold sense" and arg & 0xFF < len(HELD):
            self._proven[HELD[arg & 0xFF]] = bool(arg >> 8 & 1), t_s

    def _judge(self) -> None:
        if self._by_wire:
            return
        self.values = {}
        for surface, (raises, t_s) in self._proven.items():
            self.values |= {f"{surface}_sense": 1.0 if raises else -1.0, f"{surface}_s": t_s}
        against = [s for s, (raises, _) in self._proven.items() if raises != self._raises[s]]
        if against:
            surface = against[0]
            self.fail_check(
                f"{surface}: shown was that a longer pulse {_WAYS[not self._raises[surface]]} the"
                f" angle, the card's gain says that it {_WAYS[self._raises[surface]]} it: wrong"
                f" calibration or gains, or the stick went the other way; {_AGAIN}"
            )
        elif self._refused:
            self.fail_check(self._refused)
        elif all(surface in self._proven for surface in self._held):
            self.pass_check()
            signs = ", ".join(
                f"{s} {'+' if raises else '-'} at {t_s:.0f} s"
                for s, (raises, t_s) in self._proven.items()
            )
            self.title = f"hold proven: {signs}"
        else:
            self.title = "hold proven by tilt and stick"
            self.keep_waiting("")
