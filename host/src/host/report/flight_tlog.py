"""A flight as a telemetry log of a ground station: MAVLink messages with times (.tlog)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from host.arrays import Array
from host.constants import DEG_PER_RAD, GRAVITY_MPS2
from host.export.tlog_writer import TlogWriter
from host.report.exported_rows import exported_rows, interpolated
from host.report.flight_geography import NO_DATE_S
from host.report.shown_flight import ShownFlight

RATE_HZ = 25.0  # of a fast radio
_SLOW_HZ = 5.0  # of speed, height, pressure, surfaces
_FIXED_WING, _GENERIC, _REAL32 = 1, 0, 9
_MOST = 32767
_TEXT, _NAME = 50, 16  # bytes of a STATUSTEXT, of a parameter's name
_SERVOS = ("servo_aileron_us", "servo_elevator_us", "servo_throttle_us", "servo_rudder_us")
_STICKS = ("rc_aileron_us", "rc_elevator_us", "rc_throttle_us", "rc_rudder_us")
# At most ten characters.
_CALLED = {
    "elevator_rad": "elev_deg", "aileron_rad": "ail_deg", "rudder_rad": "rud_deg",
    "elevator_share": "elev_share", "aileron_share": "ail_share", "rudder_share": "rud_share",
}  # fmt: skip


def write_flight_tlog(flight: ShownFlight, path: Path, rate_hz: float | None = None) -> None:
    """Write a flight as a telemetry log.

    Angle of attack and sideslip are AOA_SSA, surfaces NAMED_VALUE_FLOAT in degrees (shares of
    travel as they are), events STATUSTEXT, zero and slope of every channel parameters.

    Raises
    ------
    ModuleNotFoundError
        pymavlink is missing.
    OSError
        The file cannot be written.
    """
    writer = TlogWriter()
    start = NO_DATE_S if flight.utc_s is None else flight.utc_s
    rows = exported_rows(flight, rate_hz or RATE_HZ)
    slow = exported_rows(flight, min(_SLOW_HZ, rate_hz or RATE_HZ))
    first_s = min([float(rows["t_s"][0]), *(one.t_s for one in flight.events)])
    _Stream(writer, start, first_s, rows).fast()
    _Stream(writer, start, first_s, slow).slow()
    _add_fixes(writer, flight, start, first_s)
    _add_words(writer, flight, start, first_s)
    writer.write(path)


class _Stream:
    """Messages of rows; what was never measured is sent as zero, as MAVLink has it."""

    def __init__(
        self, writer: TlogWriter, start: float, first_s: float, rows: dict[str, Array]
    ) -> None:
        self._writer, self._d = writer, writer.dialect
        self._rows, self._t_s = rows, rows["t_s"]
        self._times = (self._t_s + start).tolist()
        self._ms = np.round((self._t_s - first_s) * 1e3).astype(int).tolist()

    def fast(self) -> None:
        """Add attitude, IMU, sticks, servos and flow angles."""
        d, ms = self._d, self._ms
        if "phi_rad" in self._rows:
            turned = self._table("phi_rad", "theta_rad", "psi_rad", "p_radps", "q_radps", "r_radps")
            self._add(
                [d.MAVLink_attitude_message(t, *row) for t, row in zip(ms, turned, strict=True)]
            )
        if "ax_mps2" in self._rows:
            force = np.array(self._table("ax_mps2", "ay_mps2", "az_mps2")) / GRAVITY_MPS2 * 1e3
            rates = np.array(self._table("p_radps", "q_radps", "r_radps")) * 1e3
            raw = np.clip(np.round(np.column_stack([force, rates])), -_MOST, _MOST).astype(int)
            self._add([
                d.MAVLink_scaled_imu_message(t, *row, 0, 0, 0)
                for t, row in zip(ms, raw.tolist(), strict=True)
            ])  # fmt: skip
        if "alpha_rad" in self._rows or "beta_rad" in self._rows:
            flow = np.degrees(np.array(self._table("alpha_rad", "beta_rad"))).tolist()
            self._add([
                d.MAVLink_aoa_ssa_message(1000 * t, *row) for t, row in zip(ms, flow, strict=True)
            ])  # fmt: skip
        if _SERVOS[1] in self._rows:
            sent = self._whole(*_SERVOS)
            self._add([
                d.MAVLink_servo_output_raw_message((1000 * t) & 0xFFFFFFFF, 0, *row, 0, 0, 0, 0)
                for t, row in zip(ms, sent, strict=True)
            ])  # fmt: skip
            got, none = self._whole(*_STICKS), [65535] * 14
            self._add([
                d.MAVLink_rc_channels_message(t, 4, *row, *none, 255)
                for t, row in zip(ms, got, strict=True)
            ])  # fmt: skip

    def slow(self) -> None:
        """Add speed, height, pressure and surfaces."""
        d, ms = self._d, self._ms
        seen = self._table("airspeed_mps", "ground_speed_mps", "psi_rad", "throttle", "altitude_m")
        self._add([
            d.MAVLink_vfr_hud_message(
                v, g, int(np.degrees(psi)) % 360, round(100 * min(max(thr, 0.0), 1.0)), h, 0.0
            )
            for v, g, psi, thr, h in seen
        ])  # fmt: skip
        if "static_pa" in self._rows:
            air = self._table("static_pa", "qbar_pa", "temperature_k")
            self._add([
                d.MAVLink_scaled_pressure_message(t, p / 100.0, q / 100.0, round(100 * k) - 27315)
                for t, (p, q, k) in zip(ms, air, strict=True)
            ])  # fmt: skip
        for name in (one for one in _CALLED if one in self._rows):
            scale = DEG_PER_RAD if name.endswith("_rad") else 1.0
            key = _CALLED[name].encode()
            self._add([
                d.MAVLink_named_value_float_message(t, key, scale * v)
                for t, (v,) in zip(ms, self._table(name), strict=True)
            ])  # fmt: skip

    def _table(self, *names: str) -> list[list[float]]:
        zero = np.zeros(len(self._t_s))
        columns = [
            interpolated(self._t_s, self._t_s, self._rows[name]) if name in self._rows else zero
            for name in names
        ]
        table: list[list[float]] = np.column_stack(columns).tolist()
        return table

    def _whole(self, *names: str) -> list[list[int]]:
        found = np.clip(np.round(np.array(self._table(*names))), 0, 65535).astype(int)
        table: list[list[int]] = found.tolist()
        return table

    def _add(self, messages: list[Any]) -> None:
        self._writer.add(self._times, messages)


def _add_fixes(writer: TlogWriter, flight: ShownFlight, start: float, first_s: float) -> None:
    if not flight.position:
        return
    d, own = writer.dialect, flight.position
    t_s = own["t_s"]
    columns = flight.columns
    speed = [
        np.round(100.0 * interpolated(t_s, flight.t_s, columns[name])) if name in columns
        else np.zeros(len(t_s))
        for name in ("v_north_mps", "v_east_mps", "v_down_mps")
    ]  # fmt: skip
    velocity = np.clip(np.column_stack(speed), -_MOST, _MOST).astype(int).tolist()
    heading = [65535] * len(t_s)
    height = np.nan_to_num(own["height_m"]).tolist()
    writer.add(
        (t_s + start).tolist(),
        [
            d.MAVLink_global_position_int_message(
                round(1e3 * (t - first_s)), round(1e7 * a), round(1e7 * b), round(1e3 * h),
                round(1e3 * (h - height[0])), *v, c,
            )
            for t, a, b, h, v, c in zip(t_s.tolist(), own["latitude_deg"].tolist(),
                                        own["longitude_deg"].tolist(), height, velocity, heading,
                                        strict=True)
        ],
    )  # fmt: skip


def _add_words(writer: TlogWriter, flight: ShownFlight, start: float, first_s: float) -> None:
    d, first, last = writer.dialect, first_s + start, float(flight.t_s[-1]) + start
    beats = np.arange(first, last + 1.0, 1.0).tolist()
    writer.add(beats, [d.MAVLink_heartbeat_message(_FIXED_WING, _GENERIC, 0, 0, 4, 3)] * len(beats))
    own = flight.summary.get("calibration") or {}
    words = [(first, f"{flight.name}, {flight.summary['complete']}")]
    words.append(
        (first, f"calibration {own.get('name') or 'none'} {own.get('date') or ''}".strip())
    )
    words += [(one.t_s + start, one.text) for one in flight.events]
    words += [(one.t_s + start, f"lost: {one.text}") for one in flight.losses]
    writer.add(
        [at for at, _ in words],
        [d.MAVLink_statustext_message(6, text.encode()[:_TEXT]) for _, text in words],
    )
    count = len(flight.calibration)
    writer.add(
        [first] * count,
        [
            d.MAVLink_param_value_message(_short(name).encode(), value, _REAL32, count, k)
            for k, (name, value) in enumerate(flight.calibration.items())
        ],
    )


def _short(name: str) -> str:
    """Return a name of at most 16 characters: without the table, middle cut out."""
    text = name.removeprefix("channel.").replace(".", "_").upper()
    return text if len(text) <= _NAME else f"{text[: _NAME - 6]}{text[-6:]}"
