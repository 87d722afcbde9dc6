"""A preflight walk run through the recorder's own program: its pins and its radio.

The pins get the voltages, pulses, packets and messages that `ground_instrument` put into frames,
50 times finer. So a fault of sensors or hands reaches the pins too. Events, counters and marks of
validity come from the recorder itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.aircraft.airframe import Array
from host.twin.faults import RECEIVER
from host.twin.flight.fly import RC_PERIOD_S
from host.twin.flight.stick_commands import GAP_US
from host.twin.ground.ground_instrument import START_US, GroundFrames
from host.twin.ground.ground_walk import GroundWalk
from host.twin.recorder import sitl
from host.twin.recorder.flight_card_line import eeprom_with_card
from host.twin.recorder.recorder_build import recorder_library
from host.twin.recorder.sitl_library import Port, Sitl
from host.twin.recorder.stimuli import GPS_BYTE_S, OVERSAMPLING
from host.twin.sensors import bmp085, ubx
from host.twin.sensors.analog import CHANNELS
from host.twin.sensors.imu_stream import AGE_S, BYTE_S, RATE_HZ, RAW
from host.twin.sensors.mega_clock import TICKS_PER_S
from host.wire.packets import packet
from host.wire.schema_text import packed_schema

GRID_S = 0.01
CONVERSIONS = 4  # summed in a logged count
OFF = -32768  # an IMU value that means none, so that no packet is sent
SPREAD_COUNT = 0.4  # rms, as in flight; a sum of four lies finer than a count
_LOG_RATE_HZ = 100
_FILE_BLOCKS = 20_000
_STEP_S = 0.05

Prepare = Callable[[Sitl], None]


def recorded_walk(
    walk: GroundWalk,
    frames: GroundFrames,
    prepare: Prepare = lambda _: None,
    *,
    flight_card: bytes = b"",
) -> Iterator[tuple[float, bytes]]:
    """Yield times (us since power-on) and the bytes that the recorder's radio sent up to each.

    Parameters
    ----------
    walk : GroundWalk
    frames : GroundFrames
        As `ground_frames` or `broken_walk` gives them.
    prepare : callable
        Alters the simulated hardware before power-on, for example cuts the relay.
    flight_card : bytes
        In its EEPROM; empty for none.

    Raises
    ------
    UsageError
        No recorder library and no compiler for one.
    """
    image = sitl.card_image((), _FILE_BLOCKS)
    instrument = Sitl(recorder_library())
    instrument.set_file_blocks(_FILE_BLOCKS)
    try:
        sitl.configure(instrument, _LOG_RATE_HZ, walk.aircraft.name)
        if flight_card:
            instrument.set_eeprom(eeprom_with_card(instrument.eeprom(), flight_card))
        instrument.insert_card(image, sitl.CARD_ID)
        _give(instrument, frames)
        prepare(instrument)
        instrument.power_on()
        sent, end_s = 0, START_US * 1e-6 + float(walk.t_s[-1])
        for at_s in np.arange(_STEP_S, end_s, _STEP_S):
            instrument.run_until(round(at_s * TICKS_PER_S))
            data = instrument.sent(Port.TELEMETRY)
            yield at_s * 1e6, data[sent:]
            sent = len(data)
    finally:
        instrument.close()


def _give(instrument: Sitl, frames: GroundFrames) -> None:
    """Give the instrument every signal at its pins from power-on to the walk's end."""
    ident, slow = frames.ident, frames.slow
    offset = int(ident["t_us"][0]) - START_US
    t_s = ((ident["t_us"].astype(np.int64) - offset) % (1 << 32)) * 1e-6
    grid_s = np.arange(0.0, float(t_s[-1]), GRID_S)
    step = round(GRID_S * TICKS_PER_S)
    instrument.set_analog(0, step, _analog(ident, slow["system"], t_s, grid_s, offset))
    instrument.add_edges(*_edges(ident, t_s))
    instrument.add_packets(*_packets(ident, t_s), byte_us=BYTE_S * 1e6)
    instrument.add_gps(*_gps(slow["gps"], offset))
    if len(slow["baro"]):
        instrument.set_pressure(bmp085.EXAMPLE, 0, step, _pressure(slow["baro"], grid_s, offset))


def _times_s(rows: Any, offset: int) -> Array:
    return np.asarray(((rows["t_us"].astype(np.int64) - offset) % (1 << 32)) * 1e-6)


def _analog(ident: Any, system: Any, t_s: Array, grid_s: Array, offset: int) -> Array:
    rng = np.random.default_rng(int(ident["t_us"][0]))
    counts = [np.interp(grid_s, t_s, ident[name] / CONVERSIONS) for name in CHANNELS]
    out = np.column_stack(counts) + 0.5  # the converter truncates
    # At a stop of the converter's range nothing scatters.
    free = (out > 1.0) & (out < 1022.0)
    out += np.where(free, rng.normal(0.0, SPREAD_COUNT, out.shape), 0.0)
    rail = np.interp(grid_s, _times_s(system, offset), system["rail"] / CONVERSIONS)
    return np.asarray(np.clip(np.column_stack([out, rail]), 0.0, 1023.999))


def _edges(ident: Any, t_s: Array) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Return the five lines' edges: pulses one after the other; a width of zero is no pulse."""
    at, levels = [], []
    for start_s in np.arange(0.1, float(t_s[-1]), RC_PERIOD_S):
        row = ident[min(int(np.searchsorted(t_s, start_s)), len(ident) - 1)]
        tick = round(start_s * TICKS_PER_S)
        for line, name in enumerate(RECEIVER):
            width = int(row[f"rc_{name}"])  # ticks
            if width:
                at += [tick, tick + width]
                levels += [1 << line, 0]
                tick += width + round(GAP_US * 2.0)
    return np.array(at, np.int64), np.array(levels, np.uint8)


def _packets(ident: Any, t_s: Array) -> tuple[list[int], int, list[bytes]]:
    schema, kind = packed_schema(), packet("imu")
    at_s = np.arange(0.05, float(t_s[-1]), 1.0 / RATE_HZ)
    rows = kind.rows(len(at_s))
    count = np.arange(len(at_s))
    rows["seq"], rows["t_us"] = count & 0xFF, np.round(at_s * 1e6).astype(np.int64)
    # Before the walk it rests as at its beginning, noise and all.
    of_s = t_s[0] + np.abs(at_s - t_s[0])
    for name in RAW:
        rows[name] = np.round(np.interp(of_s, t_s, ident[name]))
    full = np.max([np.abs(rows[name].astype(np.int64)) for name in RAW[:6]], axis=0) >= 32767
    valid = ("attitude_valid", "mag_valid", "offsets_valid")
    rows["flags"] = sum(schema.bit("imu_flags", name) for name in valid)
    rows["flags"] |= np.where(full, schema.bit("imu_flags", "gyro_saturated"), 0).astype(np.uint8)
    rows["aux_kind"] = schema.number("imu_aux", "magnetometer")
    rows["age"] = round(AGE_S / (kind.scale("age") * 1e-6))
    nearest = np.minimum(np.searchsorted(t_s, of_s), len(ident) - 1)
    sent = (ident["p"][nearest] != OFF) & (ident["p"][np.maximum(nearest - 1, 0)] != OFF)
    starts = np.round((at_s + AGE_S) * TICKS_PER_S).astype(np.int64)
    sealed = kind.sealed(rows)
    chosen = np.flatnonzero(sent).tolist()
    return starts[sent].tolist(), kind.address, [sealed[k] for k in chosen]


def _gps(gps: Any, offset: int) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Return the receiver's bytes and when each comes."""
    at: list[Array] = []
    data = b""
    for row, t_s in zip(gps, _times_s(gps, offset), strict=True):
        message = _messages(row)
        at.append(t_s + np.arange(len(message)) * GPS_BYTE_S)
        data += message
    ticks = np.round(np.concatenate([*at, np.zeros(0)]) * TICKS_PER_S).astype(np.int64)
    return ticks, np.frombuffer(data, np.uint8)


def _messages(row: Any) -> bytes:
    height_mm, speed = int(row["height"]), int(row["ground_speed"])
    return ubx.solution(
        int(row["itow_ms"]),
        (int(row["longitude"]), int(row["latitude"])),
        (height_mm, height_mm),
        (speed, 0, 0, speed, speed),
        accuracy_mm=10 * int(row["h_accuracy"]),
        fixed=int(row["fix"]) == packed_schema().number("gps_fix", "fix_3d"),
        satellites=int(row["satellites"]),
    )


def _pressure(baro: Any, grid_s: Array, offset: int) -> Array:
    field = packed_schema().by_name["baro"].field("static_pressure")
    pressure = np.interp(grid_s, _times_s(baro, offset), baro["static_pressure"] * field.scale)
    ut = bmp085.raw_temperature(np.full(len(grid_s), float(baro["temperature"][0]) * 0.01))
    up = bmp085.raw_pressure(pressure, ut, OVERSAMPLING)
    return np.column_stack([ut, up])
