"""What the page's bar and tables say: recorder, card, link, sensors, servos, events, track.

A consumer of the stream. Its answer is plain data; every text in it is shown as text.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from host.constants import RAD_PER_DEG
from host.live.doubtful_values import DoubtfulValues
from host.live.gps_fix import GpsFix
from host.live.home_limit import home_view
from host.live.link_budget import LinkBudget
from host.live.live_sample import LiveUpdate, SlowFrame
from host.live.live_stream import LiveStream
from host.live.live_track import LiveTrack
from host.live.servo_watch import ServoWatch
from host.live.slow_readings import slow_reading
from host.text import shown
from host.wire.schema import Schema

_EVENTS = 40
_OLD_S = 3.0  # frames `system` come every second


class FlightState:
    """The state of a flight as received.

    Parameters
    ----------
    stream : LiveStream
        Subscribed to.
    """

    def __init__(self, stream: LiveStream) -> None:
        self.link = LinkBudget()
        self.track = LiveTrack()
        self.servos = ServoWatch()
        self.doubts = DoubtfulValues()
        self.limit_m: float | None = None  # from home
        self.preflight: Callable[[], dict[str, Any]] | None = None  # what one says, where there is
        self.events: deque[dict[str, Any]] = deque(maxlen=_EVENTS)
        self._stream = stream
        self._fix: tuple[GpsFix, float] | None = None  # and when it came
        self._last: dict[str, SlowFrame] = {}
        self._heard_s: dict[str, float] = {}
        self._blocks: tuple[int, float] | None = None  # and when they last grew
        self._row: dict[str, float] = {}
        self._numbered = 0
        self._outside = False
        stream.subscribe(self._take)

    def received(self, size_bytes: int, update: LiveUpdate) -> None:
        """Count a portion of the stream for the link budget."""
        received = len(update) > 0 or bool(update.slow)
        self.link.add(time.monotonic(), size_bytes, len(update), update.lost, received)

    def say(self, kind: str, text: str) -> dict[str, Any]:
        """Add an event of the ground: a mark, a line that went away."""
        self._numbered += 1
        row = {"number": self._numbered, "kind": kind, "t_s": self._row.get("t_s", 0.0)}
        self.events.append(row | {"text": shown(text)})
        return self.events[-1]

    def as_json(self) -> dict[str, Any]:
        """Return everything but the rows themselves."""
        link = self.link.at(time.monotonic())
        preflight = None if self.preflight is None else self.preflight()
        points = self.track.points
        return {
            "t_s": self._row.get("t_s", 0.0),
            "age_s": None if math.isinf(link.age_s) else round(link.age_s, 3),
            "silent": link.silent,
            "rec": self._rec(link.silent),
            "go": None if preflight is None else preflight["go"],  # None: not ended, or none
            "preflight": preflight,
            "link": {
                "rows_per_s": round(link.rows_per_s, 1),
                "bytes_per_s": round(link.bytes_per_s),
                "lost_percent": round(link.lost_percent, 1),
                "lost": self._stream.lost,
                "rows": self._stream.rows,
                "repeated": self._stream.repeated,
                "damaged_bytes": self._stream.damaged_bytes,
            },
            "system": self._system(),
            "switch_us": self._switch_us(),
            "gps": self._gps(),
            "who": self._who(),
            "home": self._home(),
            "doubts": self.doubts.named(points[-1][2] if points else math.nan),
            "jumps": dict(self.servos.jumps),
            "wind_mps": self.track.wind_mps,
            "track_made": self.track.made,
            "events": list(self.events)[-8:],
        }

    def _take(self, update: LiveUpdate) -> None:
        for text in update.messages:
            self.say("warning", text)
        for frame in update.slow:
            self._input(frame)  # before the rows that it moves
        for surface in self.servos.add(update):
            self.say("servo", f"{surface} servo jumped, its stick did not move")
        if len(update):
            self.doubts.take(update.rows)
            self._row = {name: float(column[-1]) for name, column in update.rows.items()}
        for frame in update.slow:
            self._last[frame.name] = frame
            self._heard_s[frame.name] = time.monotonic()
            if frame.name == "event":
                self._event(frame)
            elif frame.name == "system":
                self._written(int(frame.row["blocks_written"]))
        for fix in update.fixes:
            self._fix = fix, time.monotonic()
            self.track.add(fix, *self._motion())
            self._leaves()

    def _home(self) -> dict[str, Any] | None:
        if self._fix is None or self.limit_m is None or not self.track.points:
            return None
        east, north, _ = self.track.points[-1]
        v_north, v_east, _ = self._fix[0].velocity_mps
        seen = home_view((east, north), (v_east, v_north), self.limit_m)
        return seen | {"place_deg": self.track.home[:2] if self.track.home else None}

    def _leaves(self) -> None:
        """Say once that the aircraft has left the circle it may fly in."""
        home = self._home()
        if home is None:
            return
        outside = home["distance_m"] > home["limit_m"]
        if outside and not self._outside:
            self.say("warning", home["warning"])
        self._outside = outside

    def _motion(self) -> tuple[float, float, float]:
        pair = [self._row.get(f"airspeed_{side}_mps", math.nan) for side in "ab"]
        known = [value for value in pair if math.isfinite(value)]
        angles = [self._row.get(f"{name}_deg", math.nan) * RAD_PER_DEG for name in ("theta", "psi")]
        return (sum(known) / len(known) if known else math.nan), angles[0], angles[1]

    def _event(self, frame: SlowFrame) -> None:
        schema = self._stream.schema
        if schema is not None:
            word, arg = schema.word("event", int(frame.row["code"])), int(frame.row["arg"])
            self.say("aircraft", _event_words(schema, word, arg))

    def _input(self, frame: SlowFrame) -> None:
        """Tell who counts jumps what the logger itself moves."""
        schema = self._stream.schema
        if schema is None or frame.name != "event":
            return
        word = schema.word("event", int(frame.row["code"]))
        if word == "input_start":
            self.servos.input_starts(frame.t_s)
        elif word == "input_end":
            self.servos.input_ends(frame.t_s)

    def _written(self, blocks: int) -> None:
        """Note when the number of blocks on the card last grew."""
        before = self._blocks
        if before is None or blocks < before[0]:
            self._blocks = (blocks, -math.inf)
        elif blocks > before[0]:
            self._blocks = (blocks, time.monotonic())

    def _rec(self, silent: bool) -> dict[str, Any]:
        """Recording is proven by blocks that reach the card, by nothing else."""
        blocks, grew_s = self._blocks or (0, -math.inf)
        known = "system" in self._last and not silent
        advancing = time.monotonic() - grew_s < _OLD_S
        word = "unknown" if not known else "recording" if advancing else "not recording"
        return {"state": word, "blocks": blocks}

    def _system(self) -> dict[str, Any]:
        frame, schema = self._last.get("system"), self._stream.schema
        if frame is None or schema is None:
            return {}
        said = slow_reading(schema, frame)
        return {
            "age_s": round(time.monotonic() - self._heard_s["system"], 1),
            "rail_v": said["rail_v"],
            "supply_v": said["supply_v"],
            "frames_dropped": said["frames_dropped"],
            "card_errors": said["card_errors"],
            "not_sent": said["telemetry_dropped"],
            "sensors": said["sensors"],
            "drive": said["drive"],
            "uptime_s": said["uptime_s"],
        }

    def _switch_us(self) -> int | None:
        value = self._row.get("rc_switch_us", math.nan)
        return round(value) if math.isfinite(value) else None

    def _gps(self) -> dict[str, Any]:
        if self._fix is None:
            return {}
        fix, heard_s = self._fix
        return {
            "age_s": round(time.monotonic() - heard_s, 1),
            "fix": fix.word.replace("_", " "),
            "satellites": fix.satellites,
            "speed_mps": fix.ground_speed_mps,
        }

    def _who(self) -> dict[str, str]:
        out = {}
        if self._stream.text_variant:
            out = {"board": "original rows,", "firmware": self._stream.text_variant}
        for name, field in (
            ("identity", "board"),
            ("identity", "firmware"),
            ("config", "aircraft"),
        ):
            frame = self._last.get(name)
            if frame is not None:
                out[field] = shown(bytes(frame.row[field]).rstrip(b"\0"))
        return out


def _event_words(schema: Schema, word: str, arg: int) -> str:
    """Return an event of the aircraft as people read it; rows count from 1, as on the card."""
    row, reason = (arg & 255) + 1, schema.word("input_end", arg >> 8 & 255).replace("_", " ")
    inputs = {
        "card_enabled": f"card {arg:08x} enabled",
        "input_start": f"row {row} begins",
        "input_end": f"row {row} ends: {reason}",
        "input_refused": f"row {row} refused: {reason}",
        "hold_sense": f"hold proven: {'elevator' if arg & 1 else 'aileron'}, a longer pulse"
        f" {'raises' if arg >> 8 & 1 else 'lowers'} the angle",
    }
    return inputs.get(word, f"{word.replace('_', ' ')} ({arg})")
