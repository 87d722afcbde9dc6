"""Debian's Chromium without a screen, driven over its debugging protocol (CDP).

    with Chromium() as browser:
        page = browser.open("http://127.0.0.1:8050/")
        page.wait_for("document.querySelector('canvas') !== null")
        assert page.console_errors == []
        page.screenshot(Path("page.png"))

No driver, no download: Chromium's own pipe of JSON messages, through aiohttp's WebSocket.
"""

from __future__ import annotations

import asyncio
import base64
import contextlib
import itertools
import json
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Coroutine
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import aiohttp

LAPTOP = (1366, 768)
PHONE = (390, 844)
_START_S = 60.0  # a busy machine; a quiet one needs 0.5
_ANSWER_S = 60.0
_LONGEST_MESSAGE = 64 << 20  # a screenshot of a long page
_FLAGS = (
    "--headless=new",
    "--no-sandbox",  # tests may run as root, where the sandbox refuses
    "--disable-gpu",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-dev-shm-usage",
    "--autoplay-policy=user-gesture-required",
    "--remote-debugging-port=0",
)


class Chromium:
    """A running Chromium with a profile of its own; ``with`` ends it.

    Parameters
    ----------
    size : (int, int)
        Width and height of a page, CSS pixels.
    """

    def __init__(self, size: tuple[int, int] = LAPTOP) -> None:
        self._size = size
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self._pages: list[Page] = []
        self._process: subprocess.Popen[bytes] | None = None
        self._port = 0

    def __enter__(self) -> Self:
        program = shutil.which("chromium") or shutil.which("chromium-browser")
        assert program, "no chromium found; `make setup` installs Debian's"
        self._thread.start()
        self._process = subprocess.Popen(
            [program, *_FLAGS, f"--user-data-dir={self._profile.name}", "about:blank"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._port = self._debugging_port()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for page in self._pages:
            with contextlib.suppress(Exception):
                page.close()
        if self._process is not None:
            self._process.terminate()
            try:
                self._process.wait(20)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()
        self._profile.cleanup()

    @property
    def pid(self) -> int:
        """Process id of the browser; its pages are children of it."""
        assert self._process is not None
        return self._process.pid

    def open(self, url: str, size: tuple[int, int] | None = None) -> Page:
        """Open a page, and note from its first byte on what it asks for and complains of."""
        page = Page(self._loop, self._port, size or self._size)
        self._pages.append(page)
        page.go(url)
        return page

    def _debugging_port(self) -> int:
        told = Path(self._profile.name) / "DevToolsActivePort"
        end = time.monotonic() + _START_S
        while time.monotonic() < end:
            if told.is_file() and (text := told.read_text()):
                return int(text.splitlines()[0])
            assert self._process is not None
            assert self._process.poll() is None, "chromium ended at once"
            time.sleep(0.05)
        raise AssertionError("chromium did not open its debugging port")


class Page:
    """One page of a browser.

    Parameters
    ----------
    requests : list of str
        Every URL the page asked for, WebSockets too, in order.
    console_errors : list of str
        Errors and warnings of its console, exceptions nobody caught, violated policies.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, port: int, size: tuple[int, int]) -> None:
        self.requests: list[str] = []
        self.console_errors: list[str] = []
        self._loop = loop
        self._numbers = itertools.count(1)
        self._waiting: dict[int, asyncio.Future[dict[str, Any]]] = {}
        self._loaded = threading.Event()
        self._run(self._connect(port))
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")
        self.resize(size)

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command of the protocol and return its result."""
        answer = self._run(self._call(method, parameters))
        assert "error" not in answer, f"{method}: {answer['error']}"
        result: dict[str, Any] = answer["result"]
        return result

    def go(self, url: str) -> None:
        """Load a URL and wait until it is loaded."""
        self._loaded.clear()
        self.call("Page.navigate", url=url)
        assert self._loaded.wait(_ANSWER_S), f"{url} did not load"

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression in the page; a promise is awaited."""
        answer = self.call(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait_for(self, condition: str, timeout_s: float = 30.0) -> None:
        """Wait until an expression is true in the page."""
        end = time.monotonic() + timeout_s
        while not self.evaluate(f"Boolean({condition})"):
            assert time.monotonic() < end, f"never true: {condition}; {self.console_errors}"
            time.sleep(0.05)

    def press(self, key: str, code: str = "", text: str = "") -> None:
        """Press and release a key, such as ``(" ", "Space", " ")``."""
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=code, text=text)

    def click(self, selector: str) -> None:
        """Click an element as a person does."""
        self.call(
            "Runtime.evaluate",
            expression=f"document.querySelector({json.dumps(selector)}).click()",
            userGesture=True,
        )

    def resize(self, size: tuple[int, int]) -> None:
        """Give the page another size; below 600 pixels of width it is a phone's."""
        width, height = size
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=1, mobile=width < 600,
        )  # fmt: skip

    def screenshot(self, path: Path, *, whole: bool = False) -> None:
        """Write a PNG of what is seen, or of the whole page."""
        taken = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(base64.b64decode(taken["data"]))

    def close(self) -> None:
        """Close the page's connection."""
        self._run(self._disconnect())

    def _run(self, work: Coroutine[Any, Any, Any]) -> Any:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(_ANSWER_S)

    async def _connect(self, port: int) -> None:
        self._session = aiohttp.ClientSession()
        base = f"http://127.0.0.1:{port}/json/new?about:blank"
        async with self._session.put(base) as answer:
            url = (await answer.json())["webSocketDebuggerUrl"]
        self._socket = await self._session.ws_connect(url, max_msg_size=_LONGEST_MESSAGE)
        self._reader = self._loop.create_task(self._read())

    async def _disconnect(self) -> None:
        self._reader.cancel()
        await self._socket.close()
        await self._session.close()

    async def _call(self, method: str, parameters: dict[str, Any]) -> dict[str, Any]:
        number = next(self._numbers)
        answer: asyncio.Future[dict[str, Any]] = self._loop.create_future()
        self._waiting[number] = answer
        await self._socket.send_json({"id": number, "method": method, "params": parameters})
        return await answer

    async def _read(self) -> None:
        async for message in self._socket:
            told = json.loads(message.data)
            if "id" in told:
                self._waiting.pop(told["id"]).set_result(told)
            else:
                self._note(told["method"], told["params"])

    def _note(self, method: str, told: dict[str, Any]) -> None:
        if method == "Page.loadEventFired":
            self._loaded.set()
        elif method == "Network.requestWillBeSent":
            self.requests.append(told["request"]["url"])
        elif method == "Network.webSocketCreated":
            self.requests.append(told["url"])
        elif method == "Runtime.exceptionThrown":
            details = told["exceptionDetails"]
            what = details.get("exception", {}).get("description", details["text"])
            self.console_errors.append(what)
        elif method == "Runtime.consoleAPICalled" and told["type"] in ("error", "warning"):
            self.console_errors.append(
                " ".join(str(one.get("value", one.get("description"))) for one in told["args"])
            )
        elif method == "Log.entryAdded" and told["entry"]["level"] in ("error", "warning"):
            entry = told["entry"]
            self.console_errors.append(f"{entry['text']} {entry.get('url', '')}".strip())
