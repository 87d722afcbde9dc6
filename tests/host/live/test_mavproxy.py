"""MAVProxy, a ground station that is not ours, under `host live --mavlink`."""

import contextlib
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

LOG = Path(__file__).resolve().parents[2] / "data" / "format-1-learned.bin"
PROGRAM = Path(sys.executable).with_name("mavproxy.py")
PATIENCE_S = 60.0


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


class MavProxy:
    """The program on a UDP port, its terminal in a file."""

    def __init__(self, folder: Path, port: int) -> None:
        self.terminal = folder / "terminal.txt"
        self.port = port
        with self.terminal.open("wb") as out:
            self.process = subprocess.Popen(
                [
                    sys.executable, str(PROGRAM), f"--master=udpin:127.0.0.1:{port}",
                    f"--state-basedir={folder}", "--default-modules=param,mode,arm,wp,misc",
                ],
                cwd=folder, env=os.environ | {"HOME": str(folder)},
                stdin=subprocess.PIPE, stdout=out, stderr=subprocess.STDOUT,
            )  # fmt: skip

    def type(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(line.encode() + b"\n")
        self.process.stdin.flush()

    def shows(self, text: str) -> str:
        """Wait until the terminal shows a text; return all that it shows."""
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            shown = self.terminal.read_text(errors="replace")
            if text in shown:
                return shown
            time.sleep(0.05)
        raise AssertionError(f"{text!r} is not on the terminal:\n{shown}")


@pytest.fixture
def station(tmp_path: Path) -> Iterator[MavProxy]:
    one = MavProxy(tmp_path, free_port())
    try:
        one.shows("Waiting for heartbeat")
        yield one
    finally:
        one.process.kill()
        one.process.communicate()


@contextlib.contextmanager
def host_live(folder: Path, port: int) -> Iterator[subprocess.Popen[bytes]]:
    """`host live` playing a log of the recorder in real time."""
    words = ["live", str(LOG), "--no-page", "--mavlink", f"udpout:127.0.0.1:{port}"]
    with subprocess.Popen(
        [sys.executable, "-m", "host", *words], cwd=folder, stdout=subprocess.DEVNULL
    ) as running:
        try:
            yield running
        finally:
            running.kill()


def test_another_ground_station_sees_the_aircraft_and_commands_nothing(
    station: MavProxy, tmp_path: Path
) -> None:
    with host_live(tmp_path, station.port):
        station.shows("online system 1")
        station.shows("Mode MANUAL")
        station.shows("parameters")  # the calibration
        station.type("arm throttle")
        station.shows("COMPONENT_ARM_DISARM: UNSUPPORTED")
        station.type("mode FBWA")
        station.shows("DO_SET_MODE: UNSUPPORTED")
        station.type("param show ALPHA_A_SLOPE")
        station.shows("ALPHA_A_SLOPE    0.0061359")
        station.type("status AOA_SSA")
        shown = station.shows("AOA_SSA {")
    assert "Traceback" not in shown
