"""The bridge against pymavlink as a ground station: what it gets, and what it cannot do."""

import socket
import time
from collections.abc import Iterator
from typing import Any

import pytest
from host.errors import UsageError
from host.live.live_session import LiveSession
from host.live.live_stream import LiveStream
from host.live.mavlink_bridge import MavlinkBridge
from host.live.mavlink_parameters import LONGEST_NAME, calibration_parameters
from host.live.udp_place import udp_place
from host.physical.calibration import load_calibration
from pymavlink.dialects.v20 import ardupilotmega as dialect

from tests.host.live.radio import sent


class Nothing:
    """A source that is never asked."""

    name, baud, recorded = "nothing", 0, True

    def portions(self, tell: object) -> Iterator[bytes]:
        return iter(())


class Station:
    """A ground station on a UDP port of this computer."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)
        self.link = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
        self.session = LiveSession(Nothing(), LiveStream(load_calibration()), None, print)
        self.bridge = MavlinkBridge(
            self.session, f"udpout:127.0.0.1:{self.socket.getsockname()[1]}"
        )
        self.session.audiences.append(self.bridge)
        self.back: Any = None

    def fly(self) -> None:
        for part in sent(4.0):
            self.session.state.received(len(part.data), self.session.stream.feed(part.data, 0.0))
        self.bridge.state("")

    def heard(self) -> list[Any]:
        found: list[Any] = []
        while True:
            try:
                data, self.back = self.socket.recvfrom(4096)
            except BlockingIOError:
                return found
            found += self.link.parse_buffer(data) or []

    def ask(self, name: str, *values: object) -> list[Any]:
        message = getattr(self.link, f"{name}_encode")(*values)
        self.socket.sendto(message.pack(self.link), self.back)
        time.sleep(0.01)
        self.bridge._hear()
        return self.heard()


@pytest.fixture
def station() -> Iterator[Station]:
    one = Station()
    one.fly()
    yield one
    one.bridge.close()
    one.socket.close()


def test_it_looks_like_an_aircraft(station: Station) -> None:
    said = {message.get_type(): message for message in station.heard()}
    wanted = {
        *("HEARTBEAT", "SYS_STATUS", "ATTITUDE", "AOA_SSA", "RC_CHANNELS", "SERVO_OUTPUT_RAW"),
        *("VFR_HUD", "GPS_RAW_INT", "GLOBAL_POSITION_INT", "NAMED_VALUE_FLOAT"),
    }
    assert wanted <= set(said)
    beat = said["HEARTBEAT"]
    assert (beat.get_srcSystem(), beat.get_srcComponent()) == (1, dialect.MAV_COMP_ID_AUTOPILOT1)
    assert (beat.type, beat.autopilot) == (
        dialect.MAV_TYPE_FIXED_WING,
        dialect.MAV_AUTOPILOT_GENERIC,
    )
    assert not beat.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED
    status = said["SYS_STATUS"]
    prearm = dialect.MAV_SYS_STATUS_PREARM_CHECK
    assert status.onboard_control_sensors_present & prearm
    assert not status.onboard_control_sensors_health & prearm  # no preflight said GO
    stick = said["RC_CHANNELS"].chan2_raw
    assert 900 < stick < 2100


@pytest.mark.parametrize("go", [True, False, None])
def test_the_pre_arm_check_is_the_preflights_go(station: Station, go: bool | None) -> None:
    station.heard()
    station.session.state.preflight = lambda: {"go": go, "items": []}
    later = time.monotonic() + 2.0
    while time.monotonic() < later and not (found := _health(station)):
        time.sleep(0.05)
    assert bool(found[-1] & dialect.MAV_SYS_STATUS_PREARM_CHECK) is (go is True)


def _health(station: Station) -> list[int]:
    station.fly()
    said = [one for one in station.heard() if one.get_type() == "SYS_STATUS"]
    return [one.onboard_control_sensors_health for one in said]


def test_silence_makes_nothing_healthy(station: Station, monkeypatch: pytest.MonkeyPatch) -> None:
    station.heard()
    late = time.monotonic() + 5.0
    monkeypatch.setattr(time, "monotonic", lambda: late)
    station.bridge.state("")
    (status,) = [one for one in station.heard() if one.get_type() == "SYS_STATUS"]
    fence = dialect.MAV_SYS_STATUS_GEOFENCE  # not there, and so never breached
    assert status.onboard_control_sensors_health == fence
    assert not status.onboard_control_sensors_present & fence


def test_calibration_is_read_by_number_and_by_name(station: Station) -> None:
    station.heard()
    every = station.ask("param_request_list", 1, 1)
    wanted = calibration_parameters(load_calibration())
    assert [(one.param_id, one.param_index) for one in every] == [
        (name, at) for at, (name, _) in enumerate(wanted)
    ]
    name, value = wanted[3]
    (by_name,) = station.ask("param_request_read", 1, 1, name.encode(), -1)
    (by_number,) = station.ask("param_request_read", 1, 1, b"", 3)
    (set_,) = station.ask("param_set", 1, 1, name.encode(), 5.0, 9)
    for one in (by_name, by_number, set_):
        assert (one.param_id, one.param_value) == (name, pytest.approx(value))


def test_names_of_parameters_fit_and_differ() -> None:
    names = [name for name, _ in calibration_parameters(load_calibration())]
    assert len(set(names)) == len(names)
    assert max(map(len, names)) <= LONGEST_NAME


def test_nothing_can_be_commanded(station: Station) -> None:
    station.heard()
    for command in (dialect.MAV_CMD_COMPONENT_ARM_DISARM, dialect.MAV_CMD_DO_SET_SERVO, 9999):
        (answer,) = station.ask("command_long", 1, 1, command, 0, 1, 0, 0, 0, 0, 0, 0)
        assert (answer.command, answer.result) == (command, dialect.MAV_RESULT_UNSUPPORTED)
    ack, version = station.ask("command_long", 1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0)
    assert ack.result == dialect.MAV_RESULT_ACCEPTED
    assert version.get_type() == "AUTOPILOT_VERSION"
    (mission,) = station.ask("mission_request_list", 1, 1, 0)
    assert mission.count == 0
    (files,) = station.ask("file_transfer_protocol", 0, 1, 1, [7, 0, 0, 4] + [0] * 247)
    assert (files.payload[3], files.payload[12], files.payload[0]) == (129, 10, 8)
    station.socket.sendto(b"\xfd" + bytes(60), station.back)
    station.bridge._hear()


@pytest.mark.parametrize("place", ["", "udpin:127.0.0.1:14550", "udpout:14550", "udpout:h:0"])
def test_a_wrong_place_is_refused(place: str) -> None:
    with pytest.raises(UsageError, match="udpout:HOST:PORT"):
        udp_place("--mavlink", place)
