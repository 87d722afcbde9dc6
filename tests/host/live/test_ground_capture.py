"""What a ground station received from the radio is a log: the same values, every loss named."""

import json
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.cli import main
from host.errors import LogError
from host.log import FlightLog, read_log
from host.log.capture_head import CaptureHead, notes_path
from host.resources import resource
from host.wire.stream import read_stream

from tests.host.live.radio import Sent, joined, sent
from tests.host.logs import flight, written
from tests.protocol.log_writer import envelope, rows, schema_text

SENT = sent()


def received(folder: Path, data: bytes) -> FlightLog:
    path = folder / "flight.radio"
    path.write_bytes(data)
    return read_log(path)


def read_stream_of(folder: Path, data: bytes) -> None:
    path = folder / "stream.radio"
    path.write_bytes(data)
    read_stream(path)


def idents(parts: list[Sent]) -> list[int]:
    return [at for at, part in enumerate(parts) if part.is_ident]


def test_rows_are_those_of_the_card(tmp_path: Path) -> None:
    card_path = tmp_path / "flight.bin"
    card_path.write_bytes(written(*flight(12.0)))
    card, radio = read_log(card_path).table(aligned=False), received(tmp_path, joined(SENT))
    table = radio.table(aligned=False)
    assert len(table) == len(card) / 5
    names = ["alpha_a_rad", "q_radps", "az_mps2", "servo_elevator_us", "phi_rad"]
    for name in names:
        np.testing.assert_allclose(table[name], card[name].to_numpy()[::5], rtol=1e-12)
    assert np.isfinite(radio.table()["alpha_a_rad"].to_numpy()[1:-1]).all()
    assert radio.sessions[0].rate_hz == pytest.approx(20.0, rel=1e-3)
    assert radio.sessions[0].number == 7


def test_decimation_is_no_loss(tmp_path: Path) -> None:
    log = received(tmp_path, joined(SENT))
    assert log.loss.losses == ()
    assert log.complete == "truncated"
    assert "the card has all" in str(log.loss.ending)


def test_lost_frames_are_counted(tmp_path: Path) -> None:
    lost = idents(SENT)[100:103]
    log = received(tmp_path, joined([part for at, part in enumerate(SENT) if at not in lost]))
    (loss,) = log.loss.losses
    assert (loss.cause, loss.frames) == ("radio_lost", 3)
    assert loss.seconds == pytest.approx(0.15, abs=1e-3)
    assert log.complete == "damaged"


def test_damaged_frame_is_lost_and_its_bytes_are_named(tmp_path: Path) -> None:
    at = idents(SENT)[50]
    parts = list(SENT)
    wrong = bytearray(parts[at].data)
    wrong[20] ^= 4
    parts[at] = replace(parts[at], data=bytes(wrong))
    (loss,) = received(tmp_path, joined(parts)).loss.losses
    place = len(joined(parts[:at]))
    assert (loss.cause, loss.offset, loss.length) == ("radio_damaged", place, len(wrong))
    assert loss.frames == 1


def test_repeated_frames_are_used_once(tmp_path: Path) -> None:
    at = idents(SENT)[50]
    log = received(tmp_path, joined([*SENT[: at + 1], *SENT[at - 2 : at + 1], *SENT[at + 1 :]]))
    (loss,) = log.loss.losses
    assert (loss.cause, loss.ranges, loss.frames) == ("radio_repeated", 3, 0)
    assert len(log.frames["ident"]) == len(idents(SENT))
    assert log.complete == "truncated"


def test_noise_around_and_half_frames_at_the_ends_are_no_loss(tmp_path: Path) -> None:
    log = received(tmp_path, joined(SENT)[30:-20])
    assert log.loss.losses == ()


def test_reset_begins_a_session_with_a_clock_of_its_own(tmp_path: Path) -> None:
    log = received(tmp_path, joined(SENT) + joined(sent(8.0, session=9)))
    assert [session.number for session in log.sessions] == [7, 9]
    assert np.all(np.diff(log.table()["t_s"]) > 0.0)


def test_one_frame_with_a_clock_astray_is_not_a_reset(tmp_path: Path) -> None:
    stray = envelope(rows("baro", 1, t_us=np.array([3_000_000_000], np.uint32)).tobytes())
    at = len(SENT) // 2
    log = received(tmp_path, joined(SENT[:at]) + stray + joined(SENT[at:]))
    assert len(log.sessions) == 1
    assert [loss.cause for loss in log.loss.losses] == ["unread"]


def test_frame_of_a_wrong_length_is_not_used(tmp_path: Path) -> None:
    at = len(SENT) // 2
    odd = envelope(b"\x01" + bytes(40))
    (loss,) = received(tmp_path, joined(SENT[:at]) + odd + joined(SENT[at:])).loss.losses
    assert (loss.cause, loss.length) == ("unread", len(odd))


def test_unknown_schema_is_one_line(tmp_path: Path) -> None:
    data = joined([part for part in SENT if part.data[3] != 0])
    told = envelope(b"\0\xef\xbe\xad\xde")
    with pytest.raises(LogError, match=r"deadbeef.*install the host tool"):
        received(tmp_path, told + data)


def test_without_a_hash_the_head_beside_it_names_the_schema(tmp_path: Path) -> None:
    data = joined([part for part in SENT if part.data[3] != 0])
    with pytest.raises(LogError, match="every 5 s; record longer"):
        received(tmp_path, data)
    notes = notes_path(tmp_path / "flight.radio")
    notes.write_text(CaptureHead(schema=schema_text().decode()).line())
    assert len(received(tmp_path, data).frames["ident"]) == len(idents(SENT))


def test_calibration_of_the_head_is_used(tmp_path: Path) -> None:
    text = resource("default.toml").read_text(encoding="utf-8")
    own = text.replace('name = "', 'name = "own ', 1)
    notes_path(tmp_path / "flight.radio").write_text(CaptureHead(calibration=own).line())
    assert received(tmp_path, joined(SENT)).calibration.name.startswith("own ")


@pytest.mark.parametrize("head", ["[]", "{", '{"format": 3}', '{"schema": 5}', "[" * 5000, ""])
def test_damaged_head_is_no_head(tmp_path: Path, head: str) -> None:
    notes_path(tmp_path / "flight.radio").write_text(head + "\n")
    assert received(tmp_path, joined(SENT)).calibration.name


@pytest.mark.parametrize("size", [1, 9])
def test_a_forged_stream_takes_at_most_eight_times_its_size(
    tmp_path: Path, size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The shortest envelopes are the worst, and the shortest frames that are used."""
    monkeypatch.setattr("host.wire.stream._WINDOW_BYTES", 1 << 13)
    monkeypatch.setattr("host.wire.stream._AT_ONCE", 1 << 9)
    read_stream_of(tmp_path, joined(SENT))  # what is loaded once
    short = b"\xf0" if size == 1 else bytes(rows("image", 1).tobytes())
    assert len(short) == size
    data = joined([part for part in SENT if part.data[3] == 0]) + envelope(short) * 20_000
    tracemalloc.start()
    read_stream_of(tmp_path, data)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8 * len(data)


def test_verbs_read_it_like_any_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    lost = idents(SENT)[100:103]
    parts = [part for at, part in enumerate(SENT) if at not in lost]
    (tmp_path / "flight.radio").write_bytes(joined(parts))
    assert main(["decode", "flight.radio", "--json"]) == 3
    summary = json.loads(capsys.readouterr().out)
    assert (summary["received"], summary["losses"]["frames"]) == (True, 3)
    assert main(["info", "flight.radio"]) == 0
    assert "radio        received, first session 7" in capsys.readouterr().out
    assert main(["maneuvers", "flight.radio"]) == 0
    assert main(["decode", "flight.radio", "--file-id", "1"]) == 2
    assert "received from the radio" in capsys.readouterr().err
