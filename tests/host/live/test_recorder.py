"""Every byte is on disk whatever shows, judges, asks or hangs next to the recorder."""

import asyncio
import contextlib
import json
import random
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from aiohttp import web
from host.cli import main
from host.live import live_program
from host.live.ground_capture import GroundCapture
from host.live.live_session import LiveSession
from host.live.live_stream import LiveStream
from host.live.page_guard import PILOT, PageGuard
from host.live.page_server import PageServer, Viewer
from host.live.recorder import Recorder
from host.live.recording_watch import RecordingWatch
from host.live.replay import ReplaySource
from host.log import read_log
from host.log.capture_head import CaptureHead
from host.physical.calibration import load_calibration

from tests.host.live.radio import joined, sent

STREAM = joined(sent(6.0))
PARTS = [STREAM[at : at + 1000] for at in range(0, len(STREAM), 1000)]


class Radio:
    """A source that is fed by the test and never ends by itself."""

    name, baud, recorded = "COM5", 57600, False

    def __init__(self) -> None:
        self.given: list[bytes] = []
        self.mistake: BaseException | None = None
        self.hangs = threading.Event()

    def portions(self, tell: Callable[[str], None]) -> Iterator[bytes]:
        del tell
        while True:
            if self.mistake is not None:
                raise self.mistake
            while self.hangs.is_set():
                time.sleep(0.01)
            yield self.given.pop(0) if self.given else b""
            time.sleep(0.002)


class Flight:
    """A session on a radio, and what its terminal showed."""

    def __init__(self, folder: Path) -> None:
        self.radio = Radio()
        self.path = folder / "out.radio"
        self.capture = GroundCapture(self.path, CaptureHead(source="COM5"))
        self.told: list[str] = []
        self.session = LiveSession(
            self.radio, LiveStream(load_calibration()), self.capture, self.told.append
        )

    def on_disk(self, data: bytes) -> bool:
        end_s = time.monotonic() + 30
        while self.path.read_bytes() != data and time.monotonic() < end_s:
            time.sleep(0.01)
        return self.path.read_bytes() == data


@pytest.fixture
def flight(tmp_path: Path) -> Iterator[Flight]:
    one = Flight(tmp_path)
    yield one
    one.radio.hangs.clear()
    one.session.stop()
    with one.capture:
        pass


class Part:
    """Stands for whatever looks, judges or draws."""

    def rows(self, message: bytes) -> None: ...
    def state(self, message: str) -> None: ...
    def take(self, data: bytes) -> None: ...
    def tick(self) -> None: ...
    def as_json(self) -> dict[str, Any]:
        return {}


BESIDE = {
    "decoder": ("stream", "_decoded"),
    "text rows": ("stream", "feed"),
    "state": ("state", "as_json"),
    "events": ("state", "say"),
    "link": ("state", "received"),
    "notes": ("capture", "note"),
    "terminal": ("", "_tell"),
    "listener's bytes": ("listener", "take"),
    "listener's clock": ("listener", "tick"),
    "estimates": ("listener", "as_json"),
    "page's rows": ("audience", "rows"),
    "page's state": ("audience", "state"),
    "answer": ("answer", ""),
    "consumer": ("consumer", ""),
}
MISTAKES = (
    KeyError("planted"),
    RecursionError(),
    MemoryError(),
    SystemExit(3),
    OSError(28, "full"),
)


@pytest.mark.parametrize("beside", BESIDE)
def test_whatever_raises_beside_it_the_recorder_goes_on(
    beside: str, flight: Flight, monkeypatch: pytest.MonkeyPatch
) -> None:
    raised = 0

    def mistaken(*_: object, **__: object) -> Any:
        nonlocal raised
        raised += 1
        raise MISTAKES[raised % len(MISTAKES)]

    session, part = flight.session, Part()
    session.audiences.append(part)
    session.listeners["part"] = part
    session.asked["preflight"] = lambda asked: None
    owner, name = BESIDE[beside]
    owners = {
        "stream": session.stream, "state": session.state, "capture": flight.capture,
        "listener": part, "audience": part, "": session,
    }  # fmt: skip
    if owner == "answer":
        session.asked["preflight"] = mistaken
    elif owner == "consumer":
        session.stream.subscribe(mistaken)
    else:
        monkeypatch.setattr(owners[owner], name, mistaken, raising=False)
    session.start()
    for number, data in enumerate(PARTS):
        session.ask({"type": "preflight", "do": "next"})
        session.mark("pilot")
        session._safely(session.judged, {"point": number, "text": "good 93"})
        flight.radio.given.append(data)
    assert flight.on_disk(STREAM)
    end_s = time.monotonic() + 10
    while not raised and beside != "terminal" and time.monotonic() < end_s:
        time.sleep(0.01)
    assert raised or beside == "terminal"
    flight.radio.given.append(b"and on it goes")
    assert flight.on_disk(STREAM + b"and on it goes")
    assert session.recorder.trouble() == ""
    if beside not in ("terminal", "notes", "events"):
        assert 0 < len([one for one in flight.told if "the recording goes on" in one]) < 20


def test_a_consumer_that_raises_costs_the_others_nothing(flight: Flight) -> None:
    rows: list[int] = []
    flight.session.stream.subscribe(lambda update: [][1])
    flight.session.stream.subscribe(lambda update: rows.append(len(update)))
    flight.session.start()
    flight.radio.given += PARTS
    assert flight.on_disk(STREAM)
    flight.session.stop()
    assert sum(rows) == len([one for one in sent(6.0) if one.is_ident])


def test_whatever_hangs_beside_it_the_recorder_goes_on(flight: Flight) -> None:
    release = threading.Event()
    part = Part()
    part.take = lambda data: bool(release.wait(30))  # type: ignore[method-assign, assignment]
    flight.session.listeners["part"] = part
    told: list[str] = []
    beats: list[dict[str, Any]] = []
    watch = RecordingWatch(flight.session, told.append)
    watch.say = lambda message: beats.append(json.loads(message))
    flight.session.start()
    flight.radio.given += PARTS
    assert flight.on_disk(STREAM)
    end_s = time.monotonic() + 10
    while not told and time.monotonic() < end_s:
        watch.look()
        time.sleep(0.05)
    release.set()
    assert "has stood still for 3 s; the recording goes on" in told[0]
    assert beats[-1]["bytes"] == len(STREAM)
    assert beats[-1]["trouble"] == told[0]


def test_a_recorder_that_ends_or_hangs_says_so_at_once(flight: Flight) -> None:
    told: list[str] = []
    beats: list[dict[str, Any]] = []
    watch = RecordingWatch(flight.session, told.append)
    watch.say = lambda message: beats.append(json.loads(message))
    flight.session.start()
    flight.radio.given += PARTS
    assert flight.on_disk(STREAM)
    watch.look()
    assert (told, beats[-1]["trouble"], beats[-1]["bytes"]) == ([], "", len(STREAM))
    flight.radio.hangs.set()
    end_s = time.monotonic() + 10
    while not told and time.monotonic() < end_s:
        watch.look()
        time.sleep(0.05)
    assert "has not answered for 3 s: NOT RECORDED meanwhile" in told[0]
    flight.radio.hangs.clear()
    flight.radio.mistake = SystemExit(0)
    assert flight.session.recorder.ended.wait(10)
    watch.look()
    said = "internal error: RuntimeError: SystemExit: 0: NOT RECORDED from here on"
    assert (told[-1], beats[-1]["trouble"]) == (said, said)


def test_who_shows_may_be_far_behind_and_memory_is_bounded() -> None:
    class Flood(Radio):
        def portions(self, tell: Callable[[str], None]) -> Iterator[bytes]:
            del tell
            for _ in range(300):
                yield bytes(1 << 17)

    recorder = Recorder(Flood(), None)
    recorder.start()
    assert recorder.ended.wait(30)
    held = 0
    while (portion := recorder.take(0.0)) is not None:
        held += len(portion.data)
    assert held + recorder.not_shown_bytes == 300 << 17
    assert held < 20e6


def test_a_source_that_breaks_is_said_and_is_the_exit_code(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(self: ReplaySource, tell: Callable[[str], None]) -> Iterator[bytes]:
        del self, tell
        yield STREAM
        raise LookupError("planted")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(ReplaySource, "portions", broken)
    Path("flight.radio").write_bytes(STREAM)
    assert main(["live", "flight.radio@max", "-o", "out.radio", "--port", "18061"]) == 1
    assert "LookupError: planted" in capsys.readouterr().err
    assert Path("out.radio").read_bytes() == STREAM


def test_a_page_that_breaks_is_said_and_the_recording_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    async def broken(session: LiveSession, *_: object, **__: object) -> None:
        while not session.recorder.listening:
            await asyncio.sleep(0.001)
        raise LookupError("planted")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(live_program, "_until_ended", broken)
    Path("flight.radio").write_bytes(STREAM)
    assert main(["live", "flight.radio@4x", "-o", "out.radio", "--port", "18062"]) == 1
    err = capsys.readouterr().err
    assert "LookupError: planted; the page has ended, the recording goes on" in err
    rows = len([one for one in sent(6.0) if one.is_ident])
    assert len(read_log(Path("out.radio")).frames["ident"]) == rows


# ------------------------------------------------------------------------- words of a page


TYPES = ("preflight", "mark", "state", "hello", "recording", "stop", "", "__class__", None, 3)
DOS: tuple[Any, ...] = ("next", "again", "end", "go", "", None, [], {}, 1e400, "\ud800", "x" * 60)
FIELDS = ("type", "do", "item", "who", "number", "t_s", "__proto__", "", "x")


def message(draw: random.Random) -> str:
    """Return what a page may send, by type and field; three in ten are no object."""
    if draw.random() < 0.3:
        return draw.choice(("", "[", "null", "[[[[", "9" * 200, "{}", '"mark"', "[1]", "\x00", "{"))
    said = {"type": draw.choice(TYPES), "do": draw.choice(DOS), "item": draw.choice(DOS)}
    for field in draw.sample(FIELDS, draw.randrange(3)):
        said[field] = draw.choice(DOS)
    for field in draw.sample(sorted(said), draw.randrange(2)):
        del said[field]
    return json.dumps(said)[:256]


def test_no_word_of_a_page_ends_the_recording(flight: Flight) -> None:
    """Nor one that passes the page's own sieve without a preflight that it could be meant for."""

    async def asked() -> None:
        server = PageServer(flight.session, PageGuard(8050))
        viewer = Viewer(web.WebSocketResponse(), PILOT)
        viewer.may_mark = lambda now_s: True  # type: ignore[method-assign]
        draw = random.Random(46)
        for number in range(3000):
            text = message(draw)
            server._asked(viewer, text)
            with contextlib.suppress(ValueError):
                said = json.loads(text)
                if isinstance(said, dict):  # as if a sieve let it through
                    flight.session.ask(said)
            if number % 30 == 0:
                flight.radio.given.append(PARTS[number // 30 % len(PARTS)])

    flight.session.start()
    asyncio.run(asked())
    flight.session.ask({"type": "preflight", "do": "next"})
    flight.radio.given.append(b"a thousand bytes behind it")
    want = b"".join(PARTS[n % len(PARTS)] for n in range(100)) + b"a thousand bytes behind it"
    assert flight.on_disk(want)
    flight.session.mark("pilot")
    end_s = time.monotonic() + 10
    while flight.session._asked.qsize() and time.monotonic() < end_s:
        time.sleep(0.01)
    assert flight.session.recorder.listening
    assert flight.session._thread.is_alive()
