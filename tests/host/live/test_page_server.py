"""Who may look at the page and who may act: everything a stranger on the network can try."""

import asyncio
import json
import socket
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import aiohttp
import pytest
from aiohttp import web
from host.live.ground_capture import GroundCapture
from host.live.live_session import LiveSession
from host.live.live_stream import LiveStream
from host.live.map_tiles import MapTiles, open_tiles
from host.live.page_guard import PageGuard
from host.live.page_server import MOST_VIEWERS, PageServer
from host.live.replay import ReplaySource
from host.log import read_log
from host.log.capture_head import CaptureHead, notes_path
from host.physical.calibration import load_calibration

from tests.host.live.radio import joined, sent
from tests.host.live.test_map_tiles import folder, picture

STREAM = joined(sent(6.0))


class Visit:
    """A served session, and a stranger's or a friend's requests of it."""

    def __init__(self, base: str, guard: PageGuard, session: LiveSession, capture: Path) -> None:
        self.base, self.guard, self.session, self.capture = base, guard, session, capture
        # Without cookies: every request brings what it is to be judged by.
        self.client = aiohttp.ClientSession(cookie_jar=aiohttp.DummyCookieJar())

    def url(self, path: str = "/", token: str | None = None) -> str:
        return f"{self.base}{path}?token={self.guard.pilot_token if token is None else token}"

    async def status(self, url: str, **headers: str) -> int:
        async with self.client.get(url, headers=headers) as answer:
            await answer.read()
            return answer.status

    async def socket(self, token: str | None = None, **headers: str) -> Any:
        return await self.client.ws_connect(self.url("/ws", token), headers=headers)


def visited(
    tmp_path: Path,
    do: Callable[[Visit], Awaitable[None]],
    *,
    lan: bool = False,
    tiles: MapTiles | None = None,
) -> None:
    """Serve a session to `do`, and prove that the capture has every byte afterwards."""
    recording, capture = tmp_path / "in.radio", tmp_path / "out.radio"
    recording.write_bytes(STREAM)

    async def main() -> None:
        source = ReplaySource(recording, speed=float("inf"))
        with GroundCapture(capture, CaptureHead(source=source.name)) as written:
            session = LiveSession(source, LiveStream(load_calibration()), written, lambda _: None)
            listener = socket.create_server(("127.0.0.1", 0))
            port = listener.getsockname()[1]
            guard = PageGuard(port, ("192.0.2.7",) if lan else ())
            runner = web.AppRunner(PageServer(session, guard, tiles).application())
            await runner.setup()
            await web.SockSite(runner, listener).start()
            session.start()
            visit = Visit(f"http://127.0.0.1:{port}", guard, session, capture)
            try:
                await do(visit)
                await asyncio.to_thread(session.ended.wait, 60)
            finally:
                await visit.client.close()
                session.stop()
                await runner.cleanup()
        assert session.recorder.error is None
        assert session.stream.rows == len([one for one in sent(6.0) if one.is_ident])

    asyncio.run(main())
    assert len(read_log(capture).frames["ident"]) == len([one for one in sent(6.0) if one.is_ident])


def test_the_page_comes_with_its_token_and_only_with_it(tmp_path: Path) -> None:
    async def do(visit: Visit) -> None:
        assert await visit.status(visit.url()) == 200
        assert await visit.status(visit.base + "/") == 403
        for token in ("", "x", visit.guard.pilot_token[:-1], "é", "x" * 5000):
            assert await visit.status(visit.url(token=token)) == 403
        for path in ("/main.js", "/ws", "/live.kml", "/track.kml", "/uplot.js"):
            assert await visit.status(visit.base + path) == 403
        cookie = f"{visit.guard.cookie}={visit.guard.viewer_token}"
        assert await visit.status(visit.base + "/main.js", Cookie=cookie) == 200

    visited(tmp_path, do)


def test_another_origin_and_another_name_are_refused(tmp_path: Path) -> None:
    async def do(visit: Visit) -> None:
        port = visit.guard.port
        for origin in ("http://evil.example", "null", "https://127.0.0.1", f"http://evil:{port}"):
            assert await visit.status(visit.url(), Origin=origin) == 403
            with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
                await visit.socket(Origin=origin)
            assert refused.value.status == 403
        # DNS rebinding: the browser believes that evil.example is this computer.
        for host in ("evil.example", f"evil.example:{port}", f"127.0.0.1:{port + 1}", "192.0.2.7"):
            assert await visit.status(visit.url(), Host=host) == 403
        assert await visit.status(visit.url(), Origin=visit.base) == 200
        assert await visit.status(visit.url(), Host=f"localhost:{port}") == 200

    visited(tmp_path, do)


def test_no_path_leads_to_a_file(tmp_path: Path) -> None:
    async def do(visit: Visit) -> None:
        secret = tmp_path / "secret.txt"
        secret.write_text("secret")
        for path in (
            f"/..%2f..%2f..%2f..%2f..{secret}", f"/%2e%2e{secret}", f"//{secret}", str(secret),
            "/..%5c..%5cwindows", "/index.html%00.js", "/page_guard.py", "/../live_session.py",
            "/%c0%ae%c0%ae/etc/passwd", "/" + "a" * 4000,
        ):  # fmt: skip
            reader, writer = await asyncio.open_connection("127.0.0.1", visit.guard.port)
            head = f"GET {path}?token={visit.guard.pilot_token} HTTP/1.1\r\n"
            writer.write(f"{head}Host: 127.0.0.1:{visit.guard.port}\r\n\r\n".encode())
            answer = await reader.read(4096)
            assert answer.split()[1] in (b"404", b"400"), path
            assert b"secret" not in answer.partition(b"\r\n\r\n")[2]
            writer.close()

    visited(tmp_path, do)


def test_a_tile_comes_by_numbers_to_whoever_may_look(tmp_path: Path) -> None:
    async def do(visit: Visit) -> None:
        async with visit.client.get(visit.url("/tiles/3/5/2", visit.guard.viewer_token)) as answer:
            assert (answer.status, answer.content_type) == (200, "image/png")
            assert await answer.read() == picture(80)
            assert "img-src 'self'" in answer.headers["Content-Security-Policy"]
        assert await visit.status(visit.base + "/tiles/3/5/2") == 403
        for hole in ("/tiles/3/5/7", "/tiles/0/9/9", "/tiles/99/1/1"):
            assert await visit.status(visit.url(hole)) == 204
        for strange in ("/tiles/3/5/-2", "/tiles/3/..%2f5/2", "/tiles/3/5/2.png", "/tiles/3/5/٢",
                        "/tiles/3/5/" + "9" * 5000):  # fmt: skip
            assert await visit.status(visit.url(strange)) == 404

    visited(tmp_path, do, tiles=open_tiles(folder(tmp_path, picture(80))))


def test_the_page_may_load_its_own_files_only(tmp_path: Path) -> None:
    async def do(visit: Visit) -> None:
        for path in ("/", "/main.js", "/nothing"):
            async with visit.client.get(visit.url(path)) as answer:
                policy = answer.headers["Content-Security-Policy"]
                text = await answer.text()
            assert "script-src 'self';" in policy
            assert "unsafe" not in policy
            assert "default-src 'none'" in policy
            assert "<script>" not in text
            assert "http://" not in text.replace("http://www.w3.org/2000/svg", "")

    visited(tmp_path, do)


def test_oversized_and_strange_messages_do_nothing(tmp_path: Path) -> None:
    async def do(visit: Visit) -> None:
        for text in ("x" * 5000, '{"type":"mark"}' * 100):
            viewer = await visit.socket()
            await viewer.send_str(text)
            async for _ in viewer:
                pass
            assert viewer.close_code == 1009
        viewer = await visit.socket()
        for text in (
            "",
            "[",
            "[[[[",
            "null",
            '{"type":"stop"}',
            '{"type":"mark","x":1}',
            "9" * 200,
        ):
            await viewer.send_str(text)
        await viewer.send_bytes(b"\0" * 200)
        assert (await viewer.receive(timeout=60)).type == aiohttp.WSMsgType.TEXT  # hello
        await viewer.close()
        assert '"mark"' not in notes_path(visit.capture).read_text()

    visited(tmp_path, do)


def test_two_hundred_sockets_do_not_hold_it_up(tmp_path: Path) -> None:
    async def do(visit: Visit) -> None:
        viewers, refused = [], 0
        for _ in range(100):
            try:
                viewers.append(await visit.socket())
            except aiohttp.WSServerHandshakeError as error:
                assert error.status == 503
                refused += 1
        assert (len(viewers), refused) == (MOST_VIEWERS, 100 - MOST_VIEWERS)
        idle = [await asyncio.open_connection("127.0.0.1", visit.guard.port) for _ in range(100)]
        assert await visit.status(visit.url()) == 200
        for _, writer in idle:
            writer.close()
        for viewer in viewers:
            await viewer.close()
        assert (await visit.socket()).closed is False

    visited(tmp_path, do)


def test_the_pilot_may_ask_a_preflight_and_a_viewer_may_not(tmp_path: Path) -> None:
    asked: list[dict[str, Any]] = []

    async def do(visit: Visit) -> None:
        visit.session.asked["preflight"] = asked.append
        pilot = await visit.socket()
        viewer = await visit.socket(visit.guard.viewer_token)
        await viewer.send_str('{"type":"preflight","do":"end"}')
        await pilot.send_str('{"type":"preflight","do":"go"}')
        await pilot.send_str('{"type":"preflight","do":"again","item":"rudder"}')
        while not asked:
            await asyncio.sleep(0.01)
        await pilot.close()
        await viewer.close()

    visited(tmp_path, do, lan=True)
    assert asked == [{"type": "preflight", "do": "again", "item": "rudder"}]


def test_the_pilot_marks_and_a_viewer_does_not(tmp_path: Path) -> None:
    async def do(visit: Visit) -> None:
        pilot = await visit.socket()
        viewer = await visit.socket(visit.guard.viewer_token)
        hello = [json.loads((await one.receive(timeout=60)).data) for one in (pilot, viewer)]
        assert [one["may_mark"] for one in hello] == [True, False]
        await viewer.send_str('{"type":"mark"}')
        await pilot.send_str('{"type":"mark"}')
        await pilot.send_str('{"type":"mark"}')  # within a fifth of a second: one
        async for said in pilot:
            events = json.loads(said.data)["events"] if said.type == aiohttp.WSMsgType.TEXT else []
            if any(event["kind"] == "mark" for event in events):
                break
        await asyncio.sleep(0.3)
        notes = [json.loads(line) for line in notes_path(visit.capture).read_text().splitlines()]
        marks = [note for note in notes if note.get("kind") == "mark"]
        assert [mark["who"] for mark in marks] == ["pilot"]
        assert marks[0]["byte"] <= visit.capture.stat().st_size

    visited(tmp_path, do)


def test_the_pilots_token_from_another_computer_only_looks() -> None:
    from unittest.mock import Mock

    from aiohttp.test_utils import make_mocked_request

    guard = PageGuard(8050, ("192.0.2.7",))
    for remote, role in (("192.0.2.9", "viewer"), ("127.0.0.1", "pilot"), ("::1", "pilot")):
        transport = Mock()
        transport.get_extra_info = lambda key, default=None, r=remote: (
            (r, 5) if key == "peername" else default
        )
        request = make_mocked_request(
            "GET", f"/?token={guard.pilot_token}", {"Host": "192.0.2.7:8050"}, transport=transport
        )
        assert guard._role(request) == role


def test_google_earth_gets_a_link_and_a_track(tmp_path: Path) -> None:
    async def do(visit: Visit) -> None:
        token = visit.guard.viewer_token
        async with visit.client.get(visit.url("/live.kml", token)) as answer:
            link = await answer.text()
        assert f"{visit.base}/track.kml?token={token}" in link
        assert "<refreshInterval>1.0</refreshInterval>" in link
        await asyncio.to_thread(visit.session.ended.wait, 60)
        async with visit.client.get(visit.url("/track.kml", token)) as answer:
            track = await answer.text()
        assert answer.content_type == "application/vnd.google-earth.kml+xml"
        assert track.count(",") > 20

    visited(tmp_path, do)
