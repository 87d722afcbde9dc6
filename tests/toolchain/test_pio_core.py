"""Deciding between PlatformIO's registry and the packages of this clone."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pio_core
import pytest


@pytest.mark.parametrize(
    ("scons", "expected"),
    [("4.11.1", "4.41101.0"), ("4.8.1", "4.40801.0"), ("4.40.3", "4.44003.0")],
)
def test_scons_version_as_the_registry_writes_it(scons: str, expected: str) -> None:
    assert pio_core.pio_version(scons) == expected


class Answer(BaseHTTPRequestHandler):
    """Answer every request with the class's body."""

    body = b""

    def do_GET(self) -> None:
        """Send the body."""
        self.send_response(200)
        self.end_headers()
        self.wfile.write(self.body)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing."""


@pytest.fixture
def server() -> Iterator[HTTPServer]:
    """Serve Answer on a free port."""
    with HTTPServer(("127.0.0.1", 0), Answer) as running:
        thread = threading.Thread(target=running.serve_forever, args=(0.01,))
        thread.start()
        yield running
        running.shutdown()
        thread.join()


@pytest.mark.parametrize(
    ("body", "code"),
    [
        (b'{"name": "native", "type": "platform"}', 0),
        (b"<html>please log in to this network</html>", 1),
        (b'{"message": "no such package"}', 1),
        (b"[]", 1),
    ],
    ids=["registry", "captive portal", "another answer", "not an object"],
)
def test_only_the_registry_counts_as_one(
    server: HTTPServer, monkeypatch: pytest.MonkeyPatch, body: bytes, code: int
) -> None:
    monkeypatch.setattr(Answer, "body", body)
    monkeypatch.setattr(pio_core, "REGISTRY", f"http://127.0.0.1:{server.server_port}/")
    assert pio_core.ask_registry() == code


def test_a_closed_port_and_a_silent_one_are_no_registry(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pio_core, "REGISTRY_TIMEOUT_S", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        monkeypatch.setattr(pio_core, "REGISTRY", f"http://127.0.0.1:{port}/")
        assert pio_core.ask_registry() == 1
    assert pio_core.ask_registry() == 1


def test_the_core_folder_names_its_owner(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without an owner PlatformIO asks its registry, and waits 61 s for it."""
    monkeypatch.setattr(pio_core, "CORE", tmp_path)
    pio_core.fill_core()
    pio_core.fill_core()  # may be run again
    notes = {p.parent.name: json.loads(p.read_text()) for p in tmp_path.rglob(".piopm")}
    assert set(notes) == {"native", "atmelavr", "tool-scons"}
    assert {note["spec"]["owner"] for note in notes.values()} == {"platformio"}
    package = json.loads((tmp_path / "packages/tool-scons/package.json").read_text())
    assert package["version"] == notes["tool-scons"]["version"]
    state = json.loads((tmp_path / "appstate.json").read_text())
    assert state["settings"]["check_platformio_interval"] > 7


def test_another_scons_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pio_core, "CORE", tmp_path)
    monkeypatch.setattr(pio_core, "version", lambda name: "4.8.1" if name == "scons" else "6.2.0")
    with pytest.raises(SystemExit, match=r"wants tool-scons .*, found SCons 4\.8\.1"):
        pio_core.fill_core()
