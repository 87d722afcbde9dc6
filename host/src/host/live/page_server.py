"""The page over http: its files, and one WebSocket per viewer.

A viewer that is too slow loses rows on its screen and nothing else: each has a queue of its own
that forgets the oldest, and nothing here is waited for by the session.
"""

from __future__ import annotations

import asyncio
import json
from collections import deque
from importlib import resources
from typing import Any

from aiohttp import WSMsgType, web

from host.chart_library import chart_script, chart_style
from host.live import google_earth
from host.live.live_sample import LIVE_UNITS
from host.live.live_session import LiveSession
from host.live.map_tiles import MOST_ZOOM, MapTiles, picture_type
from host.live.page_guard import PILOT, ROLE, PageGuard

WINDOW_S = 30.0
MOST_VIEWERS = 20
_QUEUE = 128  # messages: two seconds
_KEPT = 2000  # of rows: more than 30 s at 60 messages a second
_TRACK = 3000  # points that a new viewer gets
_LONGEST_MESSAGE = 256  # bytes; {"type":"mark"} and three words to a preflight
_MARK_S = 0.2
_PING_S = 10.0
_TYPES = {
    ".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml",
}  # fmt: skip


class Viewer:
    """One WebSocket and what waits for it."""

    def __init__(self, socket: web.WebSocketResponse, role: str) -> None:
        self.socket = socket
        self.role = role
        self.skipped = 0
        self.track_sent = 0
        self._rows: deque[bytes] = deque(maxlen=_QUEUE)
        self._states: dict[str, str] = {}
        self._wake = asyncio.Event()
        self._marked_s = 0.0

    def rows(self, message: bytes) -> None:
        """Queue rows; the oldest go where there is no room."""
        self.skipped += len(self._rows) == _QUEUE
        self._rows.append(message)
        self._wake.set()

    def state(self, message: str, kind: str = "state") -> None:
        """Queue the newest of a kind: a state, or the recorder's heartbeat."""
        self._states[kind] = message
        self._wake.set()

    def may_mark(self, now_s: float) -> bool:
        """Tell whether this viewer may mark now."""
        if self.role != PILOT or now_s - self._marked_s < _MARK_S:
            return False
        self._marked_s = now_s
        return True

    async def send(self) -> None:
        """Send what is queued, for ever."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            while self._rows:
                await self.socket.send_bytes(self._rows.popleft())
            states, self._states = self._states, {}
            for state in states.values():
                await self.socket.send_str(state)


class PageServer:
    """Serves the page of a session.

    Parameters
    ----------
    session : LiveSession
    guard : PageGuard
    tiles : MapTiles, optional
        What lies below the track.
    """

    def __init__(
        self, session: LiveSession, guard: PageGuard, tiles: MapTiles | None = None
    ) -> None:
        self.guard = guard
        self._tiles = tiles
        self._session = session
        self._viewers: set[Viewer] = set()
        self._kept: deque[bytes] = deque(maxlen=_KEPT)
        self._loop = asyncio.get_running_loop()
        self._files = _page_files()
        session.audiences.append(self)

    def application(self) -> web.Application:
        """Return the routes: a fixed table, no path of a request ever names a file."""
        app = web.Application(middlewares=[self.guard.middleware], client_max_size=1024)
        app.router.add_get("/", self._page)
        app.router.add_get("/ws", self._socket)
        app.router.add_get("/live.kml", self._link)
        app.router.add_get("/track.kml", self._track)
        app.router.add_get(r"/tiles/{z:[0-9]{1,2}}/{x:[0-9]{1,8}}/{y:[0-9]{1,8}}", self._tile)
        app.router.add_get("/{name}", self._file)
        return app

    def rows(self, message: bytes) -> None:
        """Take rows from the session's thread."""
        self._call(self._rows, message)

    def state(self, message: str) -> None:
        """Take the state from the session's thread."""
        self._call(self._state, message)

    def recording(self, message: str) -> None:
        """Take the recorder's heartbeat, in the loop that serves."""
        for viewer in self._viewers:
            viewer.state(message, "recording")

    def _call(self, function: Any, message: Any) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(function, message)

    def _rows(self, message: bytes) -> None:
        self._kept.append(message)
        for viewer in self._viewers:
            viewer.rows(message)

    def _state(self, message: str) -> None:
        what = json.loads(message)
        what["viewers"] = len(self._viewers)
        points = self._session.state.track.points
        for viewer in self._viewers:
            new = min(len(points), what["track_made"] - viewer.track_sent)
            viewer.track_sent = what["track_made"]
            what["track"] = [_rounded(point) for point in points[len(points) - new :][-_TRACK:]]
            what["skipped"] = viewer.skipped
            viewer.state(json.dumps(what))

    async def _page(self, request: web.Request) -> web.Response:
        answer = self._answer("index.html")
        if "token" in request.query:
            answer.set_cookie(
                self.guard.cookie,
                request.query["token"],
                httponly=True,
                samesite="Strict",
                path="/",
            )
        return answer

    async def _file(self, request: web.Request) -> web.Response:
        return self._answer(request.match_info["name"])

    def _answer(self, name: str) -> web.Response:
        if name not in self._files:
            raise web.HTTPNotFound
        kind = _TYPES["." + name.rpartition(".")[2]]
        return web.Response(body=self._files[name], content_type=kind, charset="utf-8")

    async def _tile(self, request: web.Request) -> web.Response:
        """Send a tile, or nothing: a hole in a map is no error."""
        zoom, x, y = (int(request.match_info[one]) for one in "zxy")
        known = self._tiles is not None and zoom <= MOST_ZOOM and max(x, y) < 1 << zoom
        data = self._tiles.tile(zoom, x, y) if self._tiles is not None and known else None
        if data is None:
            return web.Response(status=204)
        return web.Response(body=data, content_type=picture_type(data))

    async def _link(self, request: web.Request) -> web.Response:
        url = f"http://{request.host}/track.kml?token={request.query.get('token', '')}"
        return _kml(google_earth.network_link(url))

    async def _track(self, request: web.Request) -> web.Response:
        del request
        return _kml(google_earth.track_document(self._session.state.track.places[-_TRACK:]))

    async def _socket(self, request: web.Request) -> web.StreamResponse:
        if len(self._viewers) >= MOST_VIEWERS:
            raise web.HTTPServiceUnavailable
        socket = web.WebSocketResponse(
            max_msg_size=_LONGEST_MESSAGE, heartbeat=_PING_S, compress=False
        )
        await socket.prepare(request)
        viewer = Viewer(socket, request[ROLE])
        await socket.send_str(json.dumps(self._hello(viewer)))
        for message in list(self._kept):
            await socket.send_bytes(message)
        self._viewers.add(viewer)
        sender = asyncio.ensure_future(viewer.send())
        try:
            async for said in socket:
                if said.type == WSMsgType.TEXT:
                    self._asked(viewer, said.data)
        finally:
            self._viewers.discard(viewer)
            sender.cancel()
        return socket

    def _hello(self, viewer: Viewer) -> dict[str, Any]:
        return {
            "type": "hello",
            "columns": list(LIVE_UNITS),
            "units": list(LIVE_UNITS.values()),
            "window_s": WINDOW_S,
            "may_mark": viewer.role == PILOT,
            "tiles": self._tiles.zooms if self._tiles is not None else None,
        }

    def _asked(self, viewer: Viewer, text: str) -> None:
        """Do what a viewer asks, if it is one of the things that can be asked and it may."""
        try:
            asked = json.loads(text)
        except (ValueError, RecursionError):
            return
        if asked == {"type": "mark"} and viewer.may_mark(self._loop.time()):
            self._session.mark(viewer.role)
        elif _is_preflight(asked) and viewer.may_mark(self._loop.time()):
            self._session.ask(asked)


def _is_preflight(asked: Any) -> bool:
    """Tell whether a viewer asks a preflight to go on, to look again, or to end."""
    return (
        isinstance(asked, dict)
        and asked.get("type") == "preflight"
        and set(asked) <= {"type", "do", "item"}
        and asked.get("do") in ("next", "again", "end")
        and isinstance(asked.get("item", ""), str)
    )


def _page_files() -> dict[str, bytes]:
    """Return every file of the page by its name."""
    folder = resources.files("host.live") / "page"
    names = [one for one in folder.iterdir() if "." + one.name.rpartition(".")[2] in _TYPES]
    files = {one.name: one.read_bytes() for one in names}
    return files | {"uplot.js": chart_script().encode(), "uplot.css": chart_style().encode()}


def _rounded(point: tuple[float, float, float]) -> list[float]:
    return [round(value, 1) for value in point]


def _kml(text: str) -> web.Response:
    return web.Response(
        body=text.encode(), content_type="application/vnd.google-earth.kml+xml", charset="utf-8"
    )
