"""The synchronous table: all channels in SI at the instants of the identification frames."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.physical import airdata
from host.physical.channels import TURN_RAD, ChannelMaker, Rows
from host.physical.columns import COLUMNS
from host.physical.sampling import Interpolator, usual_interval_us
from host.physical.session import Session
from host.wire.frames import FrameSet, join

Array = NDArray[np.float64]
Columns = dict[str, NDArray[Any]]

# Rows of the neighbouring piece kept on either side, so that interpolation and slow IMUs see
# beyond the edge: 1.5 samples of a 5 Hz IMU at 200 rows per second are 60 rows.
HALO_ROWS = 256
ROWS_AT_ONCE = 8_192
_NONE = np.empty(0, np.int32)
_GPS = {
    "latitude": "latitude_deg",
    "longitude": "longitude_deg",
    "height": "gps_height_m",
    "v_north": "v_north_mps",
    "v_east": "v_east_mps",
    "v_down": "v_down_mps",
    "ground_speed": "ground_speed_mps",
}
# Range of the BMP085 (its datasheet, table 1); a value outside comes from a fault.
_STATIC_PA = (30_000.0, 110_000.0)
_TEMPERATURE_K = (233.15, 358.15)
# surface -> (its pot column, its pulse channel); aileron is made of two pots
_SURFACES = {
    "elevator": ("elevator_pot_rad",),
    "aileron": ("aileron_left_rad", "aileron_right_rad"),
    "rudder": ("rudder_pot_rad",),
}
ANGLES = ("phi_rad", "theta_rad", "psi_rad")  # unwrapped


@dataclass(frozen=True, slots=True)
class SlowGroup:
    """Samples of a slower frame, ready to be brought to rows."""

    t_us: Array
    values: dict[str, Array]
    interval_us: float

    def at(self, rows_us: Array) -> dict[str, Array]:
        """Return the values at the rows, NaN where there is none."""
        if not len(rows_us):
            return {name: np.empty(0) for name in self.values}
        low, high = np.searchsorted(self.t_us, (rows_us[0], rows_us[-1]))
        near = slice(max(0, int(low) - 1), int(high) + 1)
        bring = Interpolator(self.t_us[near], rows_us, self.interval_us)
        return {name: bring(value[near]) for name, value in self.values.items()}


class SessionTable:
    """Makes the rows of one session, piece by piece.

    Parameters
    ----------
    session : Session
    aligned : bool
        See `ChannelMaker`.
    """

    def __init__(self, session: Session, *, aligned: bool = True) -> None:
        self._session = session
        self._calibration = session.calibration
        self._maker = ChannelMaker(
            session.store.schema,
            session.calibration,
            dlpf=session.dlpf,
            interval_us=session.interval_us,
            aligned=aligned,
        )
        self._baro = _baro(session)
        self._gps = _gps(session)
        self._mega_drives = session.store.schema.bit("valid", "mega_drives")
        self._last_angle: dict[str, float] = {}

    def pieces(self) -> Iterator[Columns]:
        """Yield the columns of `COLUMNS`, some ten thousand rows at a time."""
        for data, t_us, first, last in self._windows():
            yield self._rows(data, t_us, first, last)

    def channels(self, into: Mapping[str, Array]) -> None:
        """Fill ``t_s`` and the channels of the session, as they were sampled, into `into`."""
        at = 0
        for data, t_us, first, last in self._windows():
            end = at + last - first
            part = {name: value[at:end] for name, value in into.items()}
            rows = Rows(data[first:last], t_us[first:last])
            made = self._maker.columns(rows, part)
            for name in ANGLES:  # made anew where they jump by a turn
                whole = self._continued(name, made[name])
                if whole is not part[name]:
                    np.copyto(part[name], whole)
            part["t_s"][:] = self._session.seconds(rows.t_us)
            at = end

    def _windows(self) -> Iterator[tuple[NDArray[Any], Array, int, int]]:
        """Yield frames, their times and which of them are the rows: the rest is halo."""
        held = FrameSet(np.empty(0, self._session.store.schema.by_name["ident"].dtype), _NONE)
        skip = 0
        for part in self._session.store.fast_pieces(self._session.span):
            parts = [held, part] if len(held.data) else [part]  # one set is not copied
            held = join(self._session.store.schema, "ident", parts)
            t_us = self._session.since_start_us(held)
            at = skip
            while len(held.data) - at > ROWS_AT_ONCE + HALO_ROWS:
                low, high = max(0, at - HALO_ROWS), at + ROWS_AT_ONCE + HALO_ROWS
                yield held.data[low:high], t_us[low:high], at - low, at - low + ROWS_AT_ONCE
                at += ROWS_AT_ONCE
            keep = max(0, at - HALO_ROWS)
            held = FrameSet(held.data[keep:], held.block[keep:])
            skip = at - keep
        if len(held.data) > skip:
            yield held.data, self._session.since_start_us(held), skip, len(held.data)

    def _rows(self, data: NDArray[Any], t_us: Array, first: int, last: int) -> Columns:
        channels = self._maker.columns(Rows(data, t_us))
        out: Columns = {name: value[first:last] for name, value in channels.items()}
        rows_us = t_us[first:last]
        out["t_s"] = self._session.seconds(rows_us)
        for name in ANGLES:
            out[name] = self._continued(name, out[name])
        out |= self._baro.at(rows_us)
        out |= self._gps.at(rows_us)
        _air(out)
        self._inputs(out, data["valid"][first:last])
        out["session"] = np.full(len(rows_us), self._session.number, np.int64)
        return {column.name: out[column.name] for column in COLUMNS}

    def _inputs(self, out: Columns, valid: NDArray[Any]) -> None:
        drives = (valid & self._mega_drives) != 0
        out["mega_drives"] = drives.astype(np.int8)
        for surface, pots in _SURFACES.items():
            if self._session.inputs[surface] == "measured":
                left = out[pots[0]]
                out[f"{surface}_rad"] = left if len(pots) == 1 else 0.5 * (left - out[pots[1]])
            else:
                out[f"{surface}_rad"] = self._commanded(surface, out, drives)
        out["throttle"] = self._commanded("throttle", out, drives)

    def _commanded(self, name: str, out: Columns, drives: NDArray[np.bool_]) -> Array:
        line = self._calibration.lines[f"pulse.{name}"]
        pulse = np.where(drives, out[f"servo_{name}_us"], out[f"rc_{name}_us"])
        pulse -= line.zero[0]
        pulse *= line.slope[0]
        line.bend(pulse)
        return np.asarray(pulse)

    def _continued(self, name: str, angle: Array) -> Array:
        known = angle[np.isfinite(angle)]
        if not len(known):
            return angle
        if name in self._last_angle:
            turns = round((self._last_angle[name] - float(known[0])) / TURN_RAD)
        else:
            turns = -round(float(known[0]) / TURN_RAD)
        if turns:
            angle = angle + turns * TURN_RAD
        self._last_angle[name] = float(known[-1]) + turns * TURN_RAD
        return angle


def _air(out: Columns) -> None:
    impact = _mean_of_valid(out["differential_a_pa"], out["differential_b_pa"])
    static, temperature = out["static_pa"], out["temperature_k"]
    out["density_kgpm3"] = airdata.density_kgpm3(static, temperature)
    out["altitude_m"] = airdata.pressure_altitude_m(static)
    out["cas_mps"] = airdata.calibrated_airspeed_mps(impact)
    out["airspeed_mps"] = airdata.true_airspeed_mps(impact, static, temperature)
    out["qbar_pa"] = airdata.dynamic_pressure_pa(out["airspeed_mps"], out["density_kgpm3"])
    out["alpha_rad"] = _mean_of_valid(out["alpha_a_rad"], out["alpha_b_rad"])
    out["beta_rad"] = _mean_of_valid(out["beta_a_rad"], out["beta_b_rad"])


def _mean_of_valid(a: Array, b: Array) -> Array:
    mean = a + b
    mean *= 0.5
    lost = np.isnan(mean)
    if lost.any():
        mean[lost] = np.where(np.isnan(a[lost]), b[lost], a[lost])
    return mean


def _baro(session: Session) -> SlowGroup:
    data, t_us = session.slow("baro")
    frame = session.store.schema.by_name["baro"]
    values: dict[str, Array] = {}
    for name, column, offset, (lowest, highest) in (
        ("static_pressure", "static_pa", 0.0, _STATIC_PA),
        ("temperature", "temperature_k", airdata.KELVIN, _TEMPERATURE_K),
    ):
        field = frame.field(name)
        value = data[name].astype(np.float64)
        lost = value == field.invalid
        value *= field.scale
        value += offset
        lost |= (value < lowest) | (value > highest)
        value[lost] = np.nan
        values[column] = value
    return SlowGroup(t_us, values, usual_interval_us(t_us))


def _gps(session: Session) -> SlowGroup:
    data, t_us = session.slow("gps")
    schema = session.store.schema
    frame = schema.by_name["gps"]
    fixes = (schema.number("gps_fix", "fix_2d"), schema.number("gps_fix", "fix_3d"))
    good = np.isin(data["fix"], fixes)
    values: dict[str, Array] = {}
    for name, column in _GPS.items():
        field = frame.field(name)
        value = data[name].astype(np.float64)
        lost = (value == field.invalid) | ~good
        value *= field.scale
        value[lost] = np.nan
        values[column] = value
    return SlowGroup(t_us, values, usual_interval_us(t_us))
