"""The flight in MAVLink: for QGroundControl, Mission Planner, MAVProxy.

Listens only towards the aircraft. Whatever a ground station asks is answered from here: version,
parameters (the calibration, read only), no mission, no files; every command is refused.
"""

from __future__ import annotations

import contextlib
import math
import socket
import time
from typing import Any

from host.constants import RAD_PER_DEG
from host.errors import UsageError
from host.extras import install_hint
from host.live.gps_fix import GpsFix
from host.live.live_sample import LiveUpdate
from host.live.live_session import LiveSession
from host.live.mavlink_parameters import calibration_parameters
from host.live.udp_place import udp_address

_SYSTEM = 1  # of the aircraft; 0 would be everybody
_FAST_S = 0.045  # 20 rows a second come from the radio
_SLOW_S = 1.0
_UNKNOWN_U16 = 65535
_MISSING_FILE = 10
_NAK = 129
_REQUEST_MESSAGE = 512
_FIXES = {"none": 1, "dead_reckoning": 1, "fix_2d": 2, "fix_3d": 3}
_RC = ("rc_aileron_us", "rc_elevator_us", "rc_throttle_us", "rc_rudder_us", "rc_switch_us")
_SERVOS = ("servo_aileron_us", "servo_elevator_us", "servo_throttle_us", "servo_rudder_us")
# Named values hold ten characters.
_NAMED = {
    "alpha_a_deg": "ALPHA_L", "alpha_b_deg": "ALPHA_R", "beta_a_deg": "BETA_L",
    "beta_b_deg": "BETA_R", "airspeed_a_mps": "IAS_L", "airspeed_b_mps": "IAS_R",
    "elevator_pot_deg": "POT_ELE", "aileron_left_deg": "POT_AIL_L",
    "aileron_right_deg": "POT_AIL_R", "rudder_pot_deg": "POT_RUD",
}  # fmt: skip


class MavlinkBridge:
    """Sends what the stream holds and answers what is asked.

    Parameters
    ----------
    session : LiveSession
        Subscribed to; the bridge works in its thread.
    place : str
        ``udpout:HOST:PORT``.

    Raises
    ------
    UsageError
        If the place is none, or pymavlink is missing.
    """

    def __init__(self, session: LiveSession, place: str) -> None:
        self._place = udp_address("--mavlink", place)
        try:
            from pymavlink.dialects.v20 import ardupilotmega
        except ModuleNotFoundError:
            raise UsageError(f"--mavlink needs pymavlink: {install_hint('pymavlink')}") from None
        self._dialect: Any = ardupilotmega
        self._link = ardupilotmega.MAVLink(None, srcSystem=_SYSTEM, srcComponent=1)
        self._link.robust_parsing = True
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._session = session
        self._parameters = calibration_parameters(session.stream.calibration)
        self._began_s = time.monotonic()
        self._fast_s = self._slow_s = -math.inf
        self._row: dict[str, float] = {}
        self._sent_events = 0
        session.stream.subscribe(self._take)

    def close(self) -> None:
        """Say no more."""
        self._socket.close()

    def rows(self, message: bytes) -> None:
        """Rows come from the stream itself."""

    def state(self, message: str) -> None:
        """Answer and say what is slow, in silence too."""
        del message
        self._hear()
        now_s = time.monotonic()
        if now_s - self._slow_s >= _SLOW_S:
            self._slow_s = now_s
            self._say_health()

    def _take(self, update: LiveUpdate) -> None:
        now_s = time.monotonic()
        if len(update):
            self._row = {name: float(column[-1]) for name, column in update.rows.items()}
            if now_s - self._fast_s >= _FAST_S:
                self._fast_s = now_s
                self._say_row()
        for fix in update.fixes:
            self._say_gps(fix)

    def _send(self, name: str, *values: Any) -> None:
        message = getattr(self._link, f"{name}_encode")(*values)
        packed = message.pack(self._link)
        self._link.seq = (self._link.seq + 1) % 256
        with contextlib.suppress(OSError):  # nobody listens there yet, or its queue is full
            self._socket.sendto(packed, self._place)

    def _boot_ms(self) -> int:
        return int((time.monotonic() - self._began_s) * 1e3) & 0xFFFFFFFF

    def _say_row(self) -> None:
        row, boot_ms = self._row, self._boot_ms()
        angles = [_or_zero(row[f"{name}_deg"]) * RAD_PER_DEG for name in ("phi", "theta", "psi")]
        angles[2] = math.remainder(angles[2], 2.0 * math.pi)
        rates = [_or_zero(row[f"{name}_degps"]) * RAD_PER_DEG for name in "pqr"]
        self._send("attitude", boot_ms, *angles, *rates)
        alpha, beta = (_mean(row, f"{name}_a_deg", f"{name}_b_deg") for name in ("alpha", "beta"))
        if math.isfinite(alpha) and math.isfinite(beta):
            self._send("aoa_ssa", boot_ms * 1000, alpha, beta)
        sticks = [_pulse(row[name]) for name in _RC]
        self._send("rc_channels", boot_ms, len(sticks), *sticks, *[_UNKNOWN_U16] * 13, 255)
        servos = [_pulse(row[name], 0) for name in _SERVOS]
        self._send("servo_output_raw", (boot_ms * 1000) & 0xFFFFFFFF, 0, *servos, *[0] * 4)
        speed = _or_zero(_mean(row, "airspeed_a_mps", "airspeed_b_mps"))
        heading = round(row["psi_deg"]) % 360 if math.isfinite(row["psi_deg"]) else 0
        throttle = max(0, min(100, round((_or_zero(row["rc_throttle_us"]) - 1100.0) / 8.0)))
        ground = self._session.state.as_json()["gps"].get("speed_mps", 0.0)
        height = _or_zero(row["altitude_m"])
        self._send("vfr_hud", speed, ground, heading, throttle, height, 0.0)

    def _say_gps(self, fix: GpsFix) -> None:
        place = fix.place or (0.0, 0.0, 0.0)
        latitude, longitude = round(place[0] * 1e7), round(place[1] * 1e7)
        height_mm = round(place[2] * 1e3)
        boot_ms = self._boot_ms()
        over_ground = _hundredths(fix.ground_speed_mps), _hundredths(fix.course_deg)
        self._send(
            "gps_raw_int", boot_ms * 1000, _FIXES.get(fix.word, 0), latitude, longitude, height_mm,
            _UNKNOWN_U16, _UNKNOWN_U16, *over_ground, fix.satellites,
        )  # fmt: skip
        if fix.place is None:
            return
        track = self._session.state.track.points
        relative_mm = round(track[-1][2] * 1e3) if track else 0
        velocity = [max(-32768, min(32767, round(one * 100.0))) for one in fix.velocity_mps]
        psi = self._row.get("psi_deg", math.nan)
        heading = round(psi * 100.0) % 36000 if math.isfinite(psi) else _UNKNOWN_U16
        self._send("global_position_int", boot_ms, latitude, longitude, height_mm, relative_mm,
                   *velocity, heading)  # fmt: skip

    def _say_health(self) -> None:
        dialect, state = self._dialect, self._session.state.as_json()
        standing = dialect.MAV_STATE_STANDBY if state["silent"] else dialect.MAV_STATE_ACTIVE
        self._send("heartbeat", dialect.MAV_TYPE_FIXED_WING, dialect.MAV_AUTOPILOT_GENERIC,
                   dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, 0, standing, 3)  # fmt: skip
        present, healthy = self._sensors(state)
        rail_v, lost = state["system"].get("rail_v"), state["link"]["lost_percent"]
        # No battery is measured: the voltage is that of the servos' rail, and the rest is unknown.
        rail_mv = _UNKNOWN_U16 if rail_v is None else round(rail_v * 1e3)
        self._send("sys_status", present, present, healthy, 0, rail_mv, -1, -1,
                   round(lost * 100.0), 0, 0, 0, 0, 0)  # fmt: skip
        boot_ms = self._boot_ms()
        for column, name in _NAMED.items():
            if math.isfinite(self._row.get(column, math.nan)):
                self._send("named_value_float", boot_ms, name.encode(), self._row[column])
        for event in state["events"]:
            if event["number"] > self._sent_events:
                self._sent_events = event["number"]
                text = event["text"].encode("ascii", "replace")[:50]
                self._send("statustext", dialect.MAV_SEVERITY_NOTICE, text)

    def _sensors(self, state: dict[str, Any]) -> tuple[int, int]:
        """Return the bits of what there is and of what is well, as the aircraft last said."""
        dialect = self._dialect
        bits = {
            "imu": dialect.MAV_SYS_STATUS_SENSOR_3D_GYRO | dialect.MAV_SYS_STATUS_SENSOR_3D_ACCEL,
            "baro": dialect.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE,
            "gps": dialect.MAV_SYS_STATUS_SENSOR_GPS,
            "receiver": dialect.MAV_SYS_STATUS_SENSOR_RC_RECEIVER,
        }
        pitot = dialect.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE
        present = sum(bits.values()) | pitot
        present |= dialect.MAV_SYS_STATUS_LOGGING | dialect.MAV_SYS_STATUS_PREARM_CHECK
        # There is no fence; without its bit MAVProxy says that it was breached.
        healthy = int(dialect.MAV_SYS_STATUS_GEOFENCE)
        if state["silent"]:
            return present, healthy
        healthy |= sum(bits[name] for name in state["system"].get("sensors", ()) if name in bits)
        if math.isfinite(_mean(self._row, "airspeed_a_mps", "airspeed_b_mps")):
            healthy |= pitot
        if state["rec"]["state"] == "recording":
            healthy |= dialect.MAV_SYS_STATUS_LOGGING
        if state["go"]:  # said by a preflight, by nothing else
            healthy |= dialect.MAV_SYS_STATUS_PREARM_CHECK
        return present, healthy

    def _hear(self) -> None:
        """Answer what has come in, at most a few dozen messages at a time."""
        for _ in range(32):
            try:
                data, who = self._socket.recvfrom(2048)
            except OSError:
                return
            if who[0] != self._place[0]:
                continue
            try:
                messages = self._link.parse_buffer(data) or ()
            except self._dialect.MAVError:
                continue
            for message in messages:
                self._answer(message)

    def _answer(self, message: Any) -> None:
        kind, dialect = message.get_type(), self._dialect
        system, component = message.get_srcSystem(), message.get_srcComponent()
        if kind == "PARAM_REQUEST_LIST":
            for number in range(len(self._parameters)):
                self._say_parameter(number)
        elif kind in ("PARAM_REQUEST_READ", "PARAM_SET"):
            self._say_parameter(self._parameter(message))
        elif kind in ("COMMAND_LONG", "COMMAND_INT"):
            version = dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION
            if message.command == _REQUEST_MESSAGE and int(message.param1) == version:
                self._send("command_ack", message.command, 0, 0, 0, system, component)
                self._send("autopilot_version", dialect.MAV_PROTOCOL_CAPABILITY_MAVLINK2,
                           0, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0)  # fmt: skip
            else:
                refused = dialect.MAV_RESULT_UNSUPPORTED
                self._send("command_ack", message.command, refused, 0, 0, system, component)
        elif kind == "MISSION_REQUEST_LIST":
            self._send("mission_count", system, component, 0, message.mission_type)
        elif kind == "FILE_TRANSFER_PROTOCOL":
            asked = list(message.payload)
            number = (asked[0] + 256 * asked[1] + 1) & 0xFFFF
            answer = [number & 255, number >> 8, asked[2], _NAK, 1, asked[3], 0, 0, 0, 0, 0, 0]
            answer.append(_MISSING_FILE)
            self._send("file_transfer_protocol", 0, system, component,
                       answer + [0] * (251 - len(answer)))  # fmt: skip

    def _parameter(self, message: Any) -> int:
        """Return the number of the parameter asked for, by number or by name; -1 for none."""
        at = getattr(message, "param_index", -1)
        if at >= 0:
            return int(at)
        name = message.param_id
        names = [one for one, _ in self._parameters]
        return names.index(name) if name in names else -1

    def _say_parameter(self, number: int) -> None:
        if 0 <= number < len(self._parameters):
            name, value = self._parameters[number]
            kind = self._dialect.MAV_PARAM_TYPE_REAL32
            self._send("param_value", name.encode(), value, kind, len(self._parameters), number)


def _mean(row: dict[str, float], *names: str) -> float:
    known = [row[name] for name in names if math.isfinite(row.get(name, math.nan))]
    return sum(known) / len(known) if known else math.nan


def _hundredths(value: float) -> int:
    return max(0, min(_UNKNOWN_U16, round(value * 100.0)))


def _or_zero(value: float) -> float:
    return value if math.isfinite(value) else 0.0


def _pulse(value: float, missing: int = _UNKNOWN_U16) -> int:
    return round(value) if math.isfinite(value) else missing
