"""Where `host live` listens: lines that vanish, half frames, busy ports, and a Mega left alone."""

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest
from host.cli import main
from host.link.serial import DeviceError, SerialPort
from host.live import live_program, live_request, live_sources
from host.live.live_session import LiveSession
from host.live.live_sources import PortSource, UdpSource, choose_radio
from host.live.live_stream import LiveStream
from host.live.replay import ReplaySource
from host.log import read_log
from host.log.capture_head import read_capture_head
from host.physical.calibration import load_calibration

from tests.host.live.radio import as_sent, joined, sent
from tests.host.logs import flight
from tests.host.test_original_rows import APPENDIX, SECOND
from tests.host.test_ports_status import Wire, computer, one_line

STREAM = joined(sent(6.0))
ROWS = len([part for part in sent(6.0) if part.is_ident])
MEGA, CLONE, XBEE = (0x2341, 0x0042), (0x1A86, 0x7523), (0x0403, 0x6001)


@pytest.fixture
def wire() -> Iterator[Wire]:
    one = Wire()
    yield one
    one.close()


def take(portions: Iterator[bytes], size: int) -> bytes:
    found = b""
    end = time.monotonic() + 60
    while len(found) < size and time.monotonic() < end:
        found += next(portions)
    return found


# ------------------------------------------------------------------------------------ new users


def test_no_device(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    computer(monkeypatch)
    assert main(["live"]) == 5
    assert "no radio found" in one_line(capsys)


def test_a_mega_is_never_opened_to_search(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def opened(*_: object) -> None:
        raise AssertionError("a port was opened")

    monkeypatch.setattr(live_sources, "SerialLink", opened)
    for ids in (MEGA, CLONE):
        computer(monkeypatch, ("/dev/ttyACM0", *ids))
        assert main(["live"]) == 5
        assert "opening it resets the Mega" in one_line(capsys)


def test_two_radios_are_named(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    computer(monkeypatch, ("COM4", *XBEE), ("COM7", *XBEE), ("COM3", *MEGA))
    assert main(["live"]) == 2
    assert "COM4, COM7 may each be the radio" in one_line(capsys)


def test_the_radio_is_found_beside_a_mega() -> None:
    ports = [
        SerialPort("/dev/cu.usbmodem1", "", *MEGA),
        SerialPort("/dev/cu.usbserial-A1", "", *XBEE),
        SerialPort("/dev/cu.Bluetooth", ""),
    ]
    assert choose_radio(ports).device == "/dev/cu.usbserial-A1"


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (["COM77"], 5, "no such port"),
        (["nowhere.radio"], 2, "no such file"),
        (["replay:nowhere.bin@3x"], 2, "no such file"),
        (["replay:x@0x"], 2, "more than 0"),
        (["udp:99999"], 2, "up to 65535"),
        (["udp:203.0.113.5:14600"], 5, "not this computer's"),
        (["noise.radio"], 4, "not one intact block"),
        (["sim:nothing"], 2, "nothing"),
        (["flight.radio", "--rate", "0"], 2, "between 1 and 1000"),
        (["flight.radio", "--baud", "x"], 2, "whole number"),
        (["flight.radio", "--port", "99999"], 2, "1 to 65535"),
        (["flight.radio", "-o", "new.radio", "--wanted", "foo=3"], 2, "no such derivative"),
        (["flight.radio", "-o", "new.radio", "--card", "nosuch"], 2, "no flight card"),
        (["flight.radio", "-o", "new.radio", "--aircraft", "nosuch"], 2, "no aircraft"),
        (["flight.radio", "--calibration", "noise.radio"], 2, "TOML"),
        (["flight.radio", "-o", "flight.radio"], 2, "never writes over"),
        (["flight.radio", "-o", "no/folder/x.radio"], 2, "cannot be made"),
        (["flight.radio", "--mavlink", "nonsense"], 2, "udpout:HOST:PORT"),
    ],
)
def test_what_goes_wrong_is_one_line(
    arguments: list[str],
    code: int,
    says: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("flight.radio").write_bytes(STREAM)
    Path("noise.radio").write_bytes(bytes(range(256)) * 8)
    assert main(["live", *arguments, "--no-page"]) == code
    err = capsys.readouterr().err
    assert says in err
    assert "Traceback" not in err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["flight.radio", "noise.radio"]


def test_a_missing_extra_of_the_page_is_told_before_any_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(live_request, "find_spec", lambda name: None)
    monkeypatch.setattr(live_program, "open_source", lambda *_: pytest.fail("a flight was flown"))
    assert main(["live", "sim:demo"]) == 2
    assert "the page needs aiohttp" in one_line(capsys)
    assert not list(tmp_path.iterdir())


def test_a_busy_port_is_one_line(
    wire: Wire, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    computer(monkeypatch)
    first = PortSource(wire.device).open()
    assert main(["live", wire.device, "--no-page"]) == 5
    assert "busy: another program has it open" in one_line(capsys)
    del first


# ------------------------------------------------------------------------------------ the line


def test_every_byte_is_on_disk_and_decodes(tmp_path: Path, wire: Wire) -> None:
    """From a port, with Ctrl-C at its end, in a process of its own."""
    command = [sys.executable, "-m", "host", "live", wire.device, "--no-page", "-o", "out.radio"]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as live:
        assert live.stderr is not None
        assert "every byte goes to out.radio" in live.stderr.readline()
        data = b"half a frame" + STREAM[7:]
        for at in range(0, len(data), 1000):
            os.write(wire.end, data[at : at + 1000])
        end = time.monotonic() + 60
        while (tmp_path / "out.radio").stat().st_size < len(data):
            assert time.monotonic() < end
            time.sleep(0.05)
        live.send_signal(2)
        err = live.communicate(timeout=60)[1]
    assert live.returncode == 0, err
    assert f"{ROWS} rows, 0 did not arrive" in err or f"{ROWS - 1} rows" in err
    assert (tmp_path / "out.radio").read_bytes() == data
    assert len(read_log(tmp_path / "out.radio").frames["ident"]) >= ROWS - 1
    head = read_capture_head(tmp_path / "out.radio")
    assert head is not None
    assert (head.baud, head.source, head.calibration_name) == (57600, wire.device, "default")


def test_a_line_that_goes_away_comes_back(wire: Wire, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []

    class Flaky:
        """Gives three portions, goes away, is missing twice, and is back."""

        def __init__(self, device: str, baud: int) -> None:
            opened.append(device)
            if len(opened) in (2, 3):
                raise DeviceError("no such port")
            self.left = 3

        def __enter__(self) -> "Flaky":
            return self

        def __exit__(self, *_: object) -> None:
            pass

        def data(self) -> bytes:
            if not self.left:
                raise DeviceError("went away")
            self.left -= 1
            return b"abc"

    monkeypatch.setattr(live_sources, "SerialLink", Flaky)
    monkeypatch.setattr(live_sources, "_AGAIN_S", 0.0)
    told: list[str] = []
    portions = PortSource("COM5").open().portions(told.append)
    assert take(portions, 18) == b"abc" * 6
    assert told == [
        "COM5 went away; waiting for it, what came is on disk",
        "COM5 is back",
    ]


def test_datagrams_are_received() -> None:
    source = UdpSource("127.0.0.1", 0).open()
    assert source._listener is not None
    place = source._listener.getsockname()
    portions = source.portions(lambda _: None)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for at in range(0, 3000, 300):
            sender.sendto(STREAM[at : at + 300], place)
        assert take(portions, 3000) == STREAM[:3000]


def test_a_wrong_baud_rate_is_told(tmp_path: Path) -> None:
    from host.live.live_program import _silence

    class Garbled:
        name, baud, recorded = "COM5", 9600, False

    class Capture:
        size_bytes = 4000

    session = LiveSession(Garbled(), LiveStream(load_calibration()), Capture(), print)  # type: ignore[arg-type]
    assert "4000 bytes at 9600 baud and no whole frame" in _silence(session)


def test_a_full_disk_is_told_and_the_flight_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("flight.radio").write_bytes(STREAM)
    write = os.write

    def full(file: int, data: bytes) -> int:
        if data[:1] == b"\xa5" and write(file, data[:5000]) > 4000:
            raise OSError(28, "No space left on device")
        return len(data)

    monkeypatch.setattr("host.live.ground_capture.os.write", full)
    assert main(["live", "flight.radio@max", "-o", "out.radio", "--no-page"]) == 2
    err = capsys.readouterr().err
    assert "NOT RECORDED from here on" in err
    assert "what is there can be decoded" in err


def test_a_mistake_of_ours_does_not_end_the_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def mistaken(*_: object) -> None:
        raise ZeroDivisionError("planted")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(LiveStream, "_air", mistaken)
    Path("flight.radio").write_bytes(STREAM)
    assert main(["live", "flight.radio@max", "-o", "out.radio", "--no-page"]) == 0
    assert capsys.readouterr().err.count("ZeroDivisionError: planted; the page may be wrong") == 1
    assert len(read_log(tmp_path / "out.radio").frames["ident"]) == ROWS


def test_an_unknown_schema_is_recorded_and_told_once(tmp_path: Path) -> None:
    from tests.protocol.log_writer import envelope

    told = envelope(b"\0\xef\xbe\xad\xde")
    (tmp_path / "in.radio").write_bytes(b"")
    stream = LiveStream(load_calibration())
    said = [text for _ in range(3) for text in stream.feed(told, 0.0).messages]
    assert len(said) == 1
    assert "deadbeef" in said[0]


def test_frames_before_the_first_hash_are_decoded_with_it() -> None:
    stream = LiveStream(load_calibration())
    rows = sum(len(stream.feed(part.data, 0.0)) for part in sent(6.0))
    assert rows == ROWS


def heights(portions: Iterable[bytes]) -> list[float]:
    stream = LiveStream(load_calibration())
    updates = (stream.feed(portion, 0.0) for portion in portions)
    return [one for update in updates for one in update.rows.get("altitude_m", np.empty(0))]


def by_udp(datagrams: list[bytes]) -> Iterator[bytes]:
    source = UdpSource("127.0.0.1", 0).open()
    assert source._listener is not None
    place = source._listener.getsockname()
    portions = source.portions(lambda _: None)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for datagram in datagrams:
            sender.sendto(datagram, place)
            yield next(portions)


def test_a_row_has_the_pressure_before_it_by_file_by_udp_and_in_any_portions(
    tmp_path: Path,
) -> None:
    streams = flight(6.0)
    baro = next(one for one in streams if "static_pressure" in (one.rows.dtype.names or ()))
    # 16 m of climb in 6 s, in steps of the sensor's own.
    baro.rows["static_pressure"] = np.linspace(16 * 101_000, 16 * 100_800, len(baro.rows))
    data = joined(as_sent(streams, 6.0))
    whole = heights([data])
    assert len(whole) == ROWS
    assert np.nanmax(whole) - np.nanmin(whole) == pytest.approx(16.0, abs=1.5)
    cut = {n: [data[at : at + n] for at in range(0, len(data), n)] for n in (1, 500)}
    capture = tmp_path / "flight.radio"
    capture.write_bytes(data)
    played = ReplaySource(capture, speed=np.inf).portions(lambda _: None)
    for portions in (cut[1], cut[500], by_udp(cut[500]), played):
        np.testing.assert_array_equal(heights(portions), whole)


@pytest.mark.parametrize("row", [APPENDIX, SECOND], ids=["original", "ours and the second"])
def test_rows_of_text_are_shown_and_recorded(row: str, tmp_path: Path) -> None:
    text = "".join(row.format(roll / 10) for roll in range(20)).encode()
    stream = LiveStream(load_calibration())
    shown: list[float] = []
    for at in range(0, len(text), 50):
        update = stream.feed(text[at : at + 50], 100.0 + at / 1345.0)
        shown += update.rows.get("phi_deg", np.empty(0)).tolist()
    assert shown == pytest.approx([roll / 10 for roll in range(20)], abs=1e-6)
    assert (stream.rows, stream.damaged_bytes) == (20, 0)


def test_lost_rows_are_counted_as_in_the_file() -> None:
    parts = sent(6.0)
    idents = [at for at, part in enumerate(parts) if part.is_ident]
    kept = [part for at, part in enumerate(parts) if at not in idents[60:64]]
    stream = LiveStream(load_calibration())
    for part in kept:
        stream.feed(part.data, 0.0)
    assert stream.lost == 4


def test_json_lines_say_the_state(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("flight.radio").write_bytes(STREAM)
    assert main(["live", "flight.radio@4x", "--no-page", "--json"]) == 0
    captured = capsys.readouterr()
    lines = [json.loads(line) for line in captured.out.splitlines()]
    assert {line["type"] for line in lines} == {"state"}
    assert lines[-1]["link"]["rows"] > 0
    assert f"{ROWS} rows, 0 did not arrive" in captured.err
