"""Whoever reaches the port without a token must not fill the pilot's terminal."""

from __future__ import annotations

import asyncio
import logging
import socket

import pytest
from aiohttp import web
from host.live.page_guard import PageGuard
from host.live.request_noise import RequestNoise, quieten

REQUESTS = (
    b"GET / HTTP/1.1\r\nHost: " + b"x" * 8000 + b"\r\n\r\n",
    b"\x16\x03\x01" + b"\xff" * 3000,
    b"GET /" + b"a" * 9000 + b" HTTP/1.1\r\n\r\n",
    b"POST / HTTP/1.1\r\nContent-Length: x\r\n\r\n",
    b"GET / HTTP/1.1\r\n\x1b[2J: 1\r\n\r\n",
)


def test_strangers_get_a_line_a_minute(capfd: pytest.CaptureFixture[str]) -> None:
    told: list[str] = []

    async def fails(request: web.Request) -> web.Response:
        raise LookupError(f"planted {request.path}")

    async def main() -> None:
        quieten(told.append)
        listener = socket.create_server(("127.0.0.1", 0))
        guard = PageGuard(listener.getsockname()[1])
        app = web.Application()
        app.router.add_get("/{name}", fails)
        runner = web.AppRunner(app, access_log=None)
        await runner.setup()
        await web.SockSite(runner, listener).start()
        for request in (*REQUESTS, b"GET /x HTTP/1.1\r\nHost: x\r\n\r\n") * 20:
            reader, writer = await asyncio.open_connection("127.0.0.1", guard.port)
            writer.write(request)
            await reader.read(500)
            writer.close()
        await runner.cleanup()

    asyncio.run(main())
    out, err = capfd.readouterr()
    assert (out, err) == ("", "")
    assert len(told) == 1
    assert len(told[0]) < 200
    assert "xxx" not in told[0]


def test_what_was_left_out_is_counted() -> None:
    told: list[str] = []
    now_s = 0.0
    noise = RequestNoise(told.append, lambda: now_s)
    record = logging.LogRecord("aiohttp.server", logging.ERROR, "", 0, "x" * 9000, None, None)
    for second in range(125):
        now_s = float(second)
        noise.emit(record)
    assert len(told) == 3
    assert told[1].endswith("and 59 more since the last such line")
