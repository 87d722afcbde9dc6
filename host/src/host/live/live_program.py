"""What `host live` does from its first byte to Ctrl-C: session, page, lines on the terminal."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

from host.errors import HostError, UsageError
from host.live.estimates.live_estimates import LiveEstimates, live_estimates
from host.live.ground_capture import GroundCapture, new_capture_path, utc_now
from host.live.json_lines import JsonLines
from host.live.listening_socket import listening_socket, own_addresses
from host.live.live_request import LiveRequest, check_request, open_source
from host.live.live_session import LiveSession
from host.live.live_sources import (
    Source,
)
from host.live.live_stream import LiveStream
from host.live.logger_learning import LoggerLearning
from host.live.map_tiles import open_tiles
from host.live.mavlink_bridge import MavlinkBridge
from host.live.plotjuggler_bridge import PlotJugglerBridge
from host.live.recording_watch import RecordingWatch
from host.live.replay import ReplaySource
from host.log.capture_head import SUFFIX, CaptureHead
from host.physical.calibration import Calibration, calibration_of_text, load_calibration
from host.planning.flight_envelope import Envelope
from host.wire.flight_card import card_file, read_card
from host.wire.schema_text import packed_schema

if TYPE_CHECKING:
    from aiohttp import web

    from host.live.test_point.point_watch import PointWatch

_POLL_S = 0.1
_LAST_S = 60.0  # for the last estimates, where nothing else is waited for
_STATE_S = 0.2  # between two states
_SILENT_S = 8.0  # the logger sends 20 rows a second and a hash every 5 s


@dataclass(slots=True)
class LiveSummary:
    """What came of it."""

    capture: Path | None
    size_bytes: int
    rows: int
    lost: int
    extra: dict[str, int] = field(default_factory=dict)

    def lines(self) -> list[str]:
        """Return it in words."""
        said = f"{self.rows} rows, {self.lost} did not arrive"
        if self.capture is None:
            return [said]
        return [
            f"{self.capture}: {self.size_bytes} bytes, {said}",
            f"next: host decode {self.capture}",
        ]


def run_live(
    request: LiveRequest, tell: Callable[[str], None], show: Callable[[str], None]
) -> LiveSummary:
    """Receive until the source ends (without a page) or Ctrl-C.

    Parameters
    ----------
    request : LiveRequest
    tell : callable
        Takes what happens, one line each.
    show : callable
        Takes lines of the answer: the state once a second with ``--json``.

    Raises
    ------
    HostError
        In one line: no device, a busy port, a wrong file, a missing extra.
    """
    check_request(request)
    tell = _unfailing(tell)
    calibration = load_calibration(request.calibration)
    source = request.opened or open_source(request, tell)
    own = getattr(source, "calibration_text", "")  # of a virtual instrument
    if own and request.calibration is None:
        calibration = calibration_of_text(own, Path(source.name))
    texts = [packed_schema().text]
    row_rate_hz = source.row_rate_hz if isinstance(source, ReplaySource) else None
    capture = _capture(request, source, calibration)
    with capture if capture is not None else contextlib.nullcontext():
        session = LiveSession(source, LiveStream(calibration, texts, row_rate_hz), capture, tell)
        session.state.limit_m = _limit_m(request)
        if capture is not None:
            tell(f"every byte goes to {capture.path}")
        leave = [join(session, calibration) for join in request.joins]
        if request.plotjuggler is not None:
            leave.append(PlotJugglerBridge(session, request.plotjuggler).close)
        bridge = MavlinkBridge(session, request.mavlink) if request.mavlink else None
        if bridge is not None:
            session.audiences.append(bridge)
        if request.json:
            session.audiences.append(JsonLines(show))
        known = own or request.calibration is not None
        estimates = _estimates(request, session, calibration.text if known else "")
        watch = _test_points(request, session, calibration)
        learning = _learning(request, session, estimates, tell, show)
        closing = [one.close for one in (bridge, watch, estimates) if one is not None]
        with contextlib.ExitStack() as last:  # each is called, whatever another raises
            for close in (*closing, *reversed(leave), learning.close, session.stop):
                last.callback(close)
            with contextlib.suppress(KeyboardInterrupt):
                _receive(request, session, tell)
    _raise_error(session, capture)
    stream = session.stream
    return LiveSummary(
        capture.path if capture else None,
        capture.size_bytes if capture else 0,
        stream.rows,
        stream.lost,
    )


def _limit_m(request: LiveRequest) -> float:
    """Return the largest distance from home: as asked, as the flight card says, as usual."""
    if request.distance_m is not None:
        return request.distance_m
    usual = float(Envelope().distance_m)
    if request.flight_card is None:
        return usual
    # 0: the logger watches no distance (core/input_watch); whoever looks still does.
    return float(read_card(card_file(request.flight_card)).head["distance_max_m"]) or usual


def _unfailing(tell: Callable[[str], None]) -> Callable[[str], None]:
    """Return the same for a terminal that may have gone."""

    def reported(text: str) -> None:
        with contextlib.suppress(Exception):
            tell(text)

    return reported


def _receive(request: LiveRequest, session: LiveSession, tell: Callable[[str], None]) -> None:
    """Receive until the end; a mistake outside the recorder ends the page, never the recording."""
    watch = RecordingWatch(session, tell)
    try:
        asyncio.run(_serve(request, session, watch, tell))
    except HostError:
        raise
    except Exception as error:
        if not session.recorder.listening:
            raise
        tell(
            f"internal error: {type(error).__name__}: {error}; the page has ended, the recording"
            " goes on; Ctrl-C ends it"
        )
        with contextlib.suppress(KeyboardInterrupt):
            while not session.recorder.ended.wait(_POLL_S):
                watch.look()
        raise


def _raise_error(session: LiveSession, capture: GroundCapture | None) -> None:
    """Raise what ended the recording before its time."""
    recorder = session.recorder
    if recorder.error is not None:
        raise recorder.error
    if recorder.disk_error is not None and capture is not None:
        raise UsageError(
            f"{capture.path}: the disk took {capture.size_bytes} bytes and no more"
            f" ({recorder.disk_error.strerror}); what is there can be decoded"
        )


def _estimates(
    request: LiveRequest, session: LiveSession, calibration: str
) -> LiveEstimates | None:
    """Let the session identify while it receives, where the aircraft is known."""
    virtual = "" if request.opened else getattr(session.source, "aircraft", "")
    aircraft = request.aircraft or virtual
    if not aircraft:
        if request.wanted is not None:
            raise UsageError("--wanted needs --aircraft: nothing is estimated without its file")
        return None
    capture = session.capture.path if session.capture else None
    found = live_estimates(aircraft, request.wanted, capture, calibration)
    session.listeners["estimates"] = found
    return found


def _learning(
    request: LiveRequest,
    session: LiveSession,
    estimates: LiveEstimates | None,
    tell: Callable[[str], None],
    show: Callable[[str], None],
) -> LoggerLearning:
    """Let the session tell what the logger learns by itself."""
    found = LoggerLearning(session.stream, tell)
    if estimates is not None:
        found.ground = estimates.value
    if request.json:
        found.show = lambda row: show(json.dumps({"type": "learned"} | row))
    session.listeners["logger"] = found
    return found


def _test_points(
    request: LiveRequest, session: LiveSession, calibration: Calibration
) -> PointWatch | None:
    """Let the points of the card be judged that is named, or that a virtual flight flies."""
    name, source = request.card, "" if request.opened else request.source or ""
    if name is None and source.startswith("sim:"):
        name = source.removeprefix("sim:")
    if name is None:
        return None
    from host.live.test_point.point_watch import PointWatch
    from host.live.test_point.point_worker import PointWorker
    from host.twin.testcard import cards

    card = cards.load(name)
    watch = PointWatch(card, session.judged, PointWorker(card, calibration.text))
    session.stream.subscribe(watch.hear)
    session.listeners["test_point"] = watch
    return watch


def _capture(
    request: LiveRequest, source: Source, calibration: Calibration
) -> GroundCapture | None:
    """Return where the bytes go; a recording played again is written only with -o."""
    if source.recorded and request.output is None:
        return None
    path = request.output or Path()
    if path.is_dir():
        path = new_capture_path(path)
    head = CaptureHead(
        source=source.name,
        baud=source.baud,
        started_utc=utc_now(),
        schema=packed_schema().text.decode("ascii"),
        calibration=calibration.text,
        calibration_name=calibration.name,
        host=metadata.version("flight-test-host"),
    )
    return GroundCapture(path if path.suffix else path.with_suffix(SUFFIX), head)


async def _serve(
    request: LiveRequest,
    session: LiveSession,
    watch: RecordingWatch,
    tell: Callable[[str], None],
) -> None:
    """Show the page, or only receive, until the end."""
    runner = None
    try:
        if request.page:
            runner = await _page(request, session, watch, tell)
        session.start()
        await _until_ended(session, watch, tell, forever=request.page)
        await _until_estimated(session)
    finally:
        if runner is not None:
            await runner.cleanup()


async def _until_ended(
    session: LiveSession, watch: RecordingWatch, tell: Callable[[str], None], *, forever: bool
) -> None:
    """Wait; say once when nothing understood has come for a while."""
    loop = asyncio.get_running_loop()
    began_s, said = loop.time(), False
    while session.recorder.error is None and (forever or not session.ended.is_set()):
        if session.enough.is_set():
            break
        watch.look()
        await asyncio.sleep(_POLL_S)
        received = session.stream.rows or session.stream.frames
        if (
            not said
            and not received
            and loop.time() - began_s > _SILENT_S
            and not session.source.recorded
        ):
            said = True
            tell(_silence(session))
    watch.look()


async def _until_estimated(session: LiveSession) -> None:
    """Wait for the last estimates of a source that has ended: a recording played fast."""
    loop = asyncio.get_running_loop()
    end_s = loop.time() + _LAST_S
    estimates = session.listeners.get("estimates")
    if (
        isinstance(estimates, LiveEstimates)
        and session.audiences
        and session.recorder.error is None
    ):
        while not estimates.idle and loop.time() < end_s:
            await asyncio.sleep(_POLL_S)
        await asyncio.sleep(2.0 * _STATE_S)


def _silence(session: LiveSession) -> str:
    """Say why nothing can be shown yet."""
    size = session.capture.size_bytes if session.capture else 0
    if not size:
        return (
            f"{session.source.name}: silent for {_SILENT_S:g} s; is the aircraft's power on,"
            " and the radio's pair?"
        )
    baud = f" at {session.source.baud} baud" if session.source.baud else ""
    return (
        f"{session.source.name}: {size} bytes{baud} and no whole frame in them; expected the"
        " logger's telemetry: another baud rate (--baud)? They are recorded all the same"
    )


async def _page(
    request: LiveRequest,
    session: LiveSession,
    watch: RecordingWatch,
    tell: Callable[[str], None],
) -> web.AppRunner:
    from aiohttp import web

    from host.live.page_guard import PageGuard
    from host.live.page_server import PageServer
    from host.live.request_noise import quieten

    listener = listening_socket(request.port, lan=request.lan)
    port = listener.getsockname()[1]
    guard = PageGuard(port, tuple(own_addresses()) if request.lan else ())
    tiles = None if request.tiles is None else open_tiles(request.tiles)
    server = PageServer(session, guard, tiles)
    watch.say = server.recording
    quieten(tell)
    runner = web.AppRunner(server.application(), access_log=None)
    await runner.setup()
    await web.SockSite(runner, listener, backlog=256).start()
    tell(f"page: http://127.0.0.1:{port}/?token={guard.pilot_token}")
    for address in guard.addresses:
        tell(f"viewers: http://{address}:{port}/?token={guard.viewer_token} (they only look)")
    tell(f"Google Earth: http://127.0.0.1:{port}/live.kml?token={guard.viewer_token}")
    tell("Ctrl-C ends")
    return runner
