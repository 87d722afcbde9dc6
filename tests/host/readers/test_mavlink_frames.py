"""Frames of a telemetry log against pymavlink, value for value: whole, damaged, in any portions."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from host.readers import tlog_messages
from host.readers.autopilot_log import AutopilotLog
from host.readers.mavlink_frames import frames_of
from host.readers.mavlink_layout import WANTED, layouts
from host.readers.tlog_messages import read_tlog
from pymavlink.dialects.v20 import ardupilotmega as dialect

EPOCH_US = 1_700_000_000_000_000
EXTRAS = {number: layout.extra for number, layout in layouts().items()}


def _frames(seed: int, *, v1: bool = False, signed: bool = False) -> list[bytes]:
    """Return frames of a plane with random values, each behind its time."""
    rng = np.random.default_rng(seed)
    link = dialect.MAVLink(None, srcSystem=7, srcComponent=1)
    if signed:
        link.signing.sign_outgoing, link.signing.secret_key = True, bytes(32)
    messages: list[dialect.MAVLink_message] = [dialect.MAVLink_heartbeat_message(1, 3, 0, 0, 4, 3)]
    for k in range(60):
        ms = 1000 + 20 * k
        small = rng.integers(-900, 900, 9).tolist()
        messages += [
            dialect.MAVLink_attitude_message(ms, *rng.normal(0.0, 0.3, 6).tolist()),
            dialect.MAVLink_raw_imu_message(1000 * ms, *small),
            dialect.MAVLink_servo_output_raw_message(1000 * ms, 0, *(1500 + k,) * 3, *(0,) * 5),
            dialect.MAVLink_servo_output_raw_message(1000 * ms, 1, *(1100 + k,) * 8),
            dialect.MAVLink_vfr_hud_message(17.0 + 0.01 * k, 17.0, 0, 0, 50.0, 0.0),
            dialect.MAVLink_system_time_message(EPOCH_US, ms),  # a kind that is not read
        ]
    found = []
    for k, message in enumerate(messages):
        link.seq = k % 256
        stamp = struct.pack(">Q", EPOCH_US + 4000 * k)
        found.append(stamp + bytes(message.pack(link, force_mavlink1=v1)))
    return found


def _read(path: Path, data: bytes) -> AutopilotLog:
    path.write_bytes(data)
    return read_tlog(path)[0]


def _same(one: AutopilotLog, other: AutopilotLog) -> None:
    assert one.damage == other.damage
    assert one.messages.keys() == other.messages.keys()
    for name, every in one.messages.items():
        for port, messages in every.items():
            np.testing.assert_array_equal(messages.t_s, other.messages[name][port].t_s)
            for field, values in messages.fields.items():
                np.testing.assert_array_equal(values, other.messages[name][port].fields[field])


@pytest.mark.parametrize("form", ["v1", "v2", "signed"])
def test_every_value_is_what_pymavlink_decodes(form: str, tmp_path: Path) -> None:
    frames = _frames(1, v1=form == "v1", signed=form == "signed")
    log = _read(tmp_path / "a.tlog", b"".join(frames))
    assert not log.damage
    link = dialect.MAVLink(None)
    theirs: dict[tuple[str, int], list[dialect.MAVLink_message]] = {}
    for frame in frames:
        message = link.decode(bytearray(frame[8:]))
        theirs.setdefault((message.get_type(), getattr(message, "port", 0)), []).append(message)
    for (name, port), messages in theirs.items():
        if name not in WANTED or name == "HEARTBEAT":
            continue
        ours = log.messages[name][port]
        assert len(ours) == len(messages)
        for field, values in ours.fields.items():
            np.testing.assert_array_equal(values, [getattr(m, field) for m in messages])


def test_outputs_of_a_second_port_are_not_those_of_the_first(tmp_path: Path) -> None:
    ports = _read(tmp_path / "a.tlog", b"".join(_frames(2))).messages["SERVO_OUTPUT_RAW"]
    assert ports[0].fields["servo1_raw"].tolist() == list(range(1500, 1560))
    assert ports[1].fields["servo1_raw"].tolist() == list(range(1100, 1160))
    assert "servo4_raw" not in ports[0].fields  # without a pulse


@pytest.mark.parametrize("portion", [700, 4096])
def test_portions_do_not_matter(
    portion: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A log read in pieces is the log read at once, damaged or not."""
    rng = np.random.default_rng(3)
    whole = np.frombuffer(b"".join(_frames(3)), dtype=np.uint8)
    for flips in (0, 12):
        data = whole.copy()
        at = rng.integers(0, len(data), flips)
        data[at] ^= (1 << rng.integers(0, 8, flips)).astype(np.uint8)
        monkeypatch.undo()
        once = _read(tmp_path / "a.tlog", data.tobytes())
        assert bool(once.damage) == (flips > 0)
        monkeypatch.setattr(tlog_messages, "PORTION_BYTES", portion)
        _same(once, _read(tmp_path / "a.tlog", data.tobytes()))


def test_a_changed_bit_costs_its_frame() -> None:
    """Behind a wrong length, too, the search meets the next, once a later one."""
    frames = _frames(4)
    starts = np.cumsum([0, *map(len, frames)])
    places = np.random.default_rng(5)
    wanted = [k for k in range(10, 200) if int.from_bytes(frames[k][15:18], "little") in EXTRAS]
    more = []
    for turn, k in enumerate(wanted[::9]):
        hurt = bytearray(frames[k])
        hurt[9 if turn % 2 else int(places.integers(20, len(hurt)))] ^= 0x10  # the length, or any
        found = frames_of(b"".join([*frames[:k], bytes(hurt), *frames[k + 1 :]]), EXTRAS)
        lost = sorted(set(starts[:-1].tolist()) - set(found.starts.tolist()))
        assert int(starts[k]) in lost
        assert found.wrong_crc >= 1
        more.append(len(lost) - 1)
    assert max(more) <= 2
    assert np.median(more) == 0
