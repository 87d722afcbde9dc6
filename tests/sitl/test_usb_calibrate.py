"""`host calibrate` over USB against the recorder's own program: the bench in simulated time."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from host.bench_calibration import bench_session, usb_port
from host.cli import main
from host.link.serial import DeviceError
from host.physical.calibration import load_calibration
from host.twin.recorder.sitl_library import Port, Sitl
from host.verbs import calibrate as verb

from tests.sitl import script as scripted

STEP_S = 0.05
SLOTS = 11
ALPHA_A = 0
DEG_PER_COUNT, ZERO = 0.351, 498.5  # a vane on the bench


class UsbOfSitl:
    """The recorder's USB port as `SerialLink` shows it; each look is 50 ms of its time."""

    def __init__(self, device: str = "sitl") -> None:
        self.device = device
        self.lost = threading.Event()
        self._turn = threading.Lock()
        self._sitl = Sitl()
        self._seen = 0
        self._random = np.random.default_rng(7300)
        self.volts_in_counts(ALPHA_A, ZERO)
        self._sitl.power_on()

    def __enter__(self) -> UsbOfSitl:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def volts_in_counts(self, slot: int, counts: float) -> None:
        """Hold a channel there from now on, with a converter's noise; the others in the middle."""
        with self._turn:
            rows = 512.0 + self._random.normal(0.0, 0.4, (4000, SLOTS))
            rows[:, slot] += counts - 512.0
            self._sitl.set_analog(self._sitl.now(), scripted.GRID_TICKS, rows)

    def data(self) -> bytes:
        """Return what was sent meanwhile."""
        if self.lost.is_set():
            raise DeviceError(f"{self.device}: went away; is the cable still in?")
        with self._turn:
            self._sitl.run_for(STEP_S)
            sent = self._sitl.sent(Port.USB)
        found, self._seen = sent[self._seen :], len(sent)
        return found


@pytest.fixture
def usb(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[UsbOfSitl]:
    """Return the port that `usb` is, in an empty folder."""
    link = UsbOfSitl()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(usb_port, "open_port", lambda *_: link)
    monkeypatch.setattr(bench_session, "open_port", lambda *_: link)
    monkeypatch.setattr(bench_session, "draw_picture", lambda *_: None)
    yield link


def test_a_vane_is_calibrated_position_by_position(
    usb: UsbOfSitl, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def pilot(question: str) -> str:
        """Set what is asked for, and press Enter."""
        asked.append(question)
        position = float(question.split(": set ")[1].split()[0])
        usb.volts_in_counts(ALPHA_A, ZERO + position / DEG_PER_COUNT)
        return "\n"

    monkeypatch.setattr(verb, "_ask", pilot)
    words = ["calibrate", "alpha_a", "usb", "--positions=-40,-20,0,20,40,20,0,-20,-40"]
    assert main([*words, "--into", "own.toml", "--date", "2026-11-23"]) == 0
    assert len(asked) == 27
    line = load_calibration("own.toml").lines["channel.alpha_a"]
    # The converter cuts off: half a count lower in the mean.
    assert abs(line.zero[0] - (ZERO - 0.5)) <= 1.96 * line.zero_sigma
    assert np.degrees(line.slope[0]) == pytest.approx(DEG_PER_COUNT, rel=2e-3)


def test_what_moves_is_asked_again_and_what_goes_away_is_one_line(
    usb: UsbOfSitl, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    answers: list[str] = []

    def pilot(question: str) -> str:
        answers.append(question)
        if len(answers) == 1:
            threading.Timer(0.0, usb.volts_in_counts, (ALPHA_A, ZERO + 60.0)).start()
        if len(answers) == 3:
            usb.lost.set()
        return "\n"

    monkeypatch.setattr(verb, "_ask", pilot)
    assert main(["calibrate", "alpha_a", "usb", "--positions=0,20", "--into", "own.toml"]) == 5
    err = capsys.readouterr().err
    assert "sitl: went away" in err
    assert not Path("own.toml").exists()


def test_faces_are_recorded_until_enter(
    usb: UsbOfSitl, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without an IMU: the capture is read as any is, and what is missing in it is said."""
    monkeypatch.setattr(verb, "_ask", lambda _: "\n")
    assert main(["calibrate", "accelerometers", "usb"]) == 2
    err = capsys.readouterr().err
    assert Path("bench-accelerometers-1.radio").stat().st_size > 200
    assert "no face held still" in err
