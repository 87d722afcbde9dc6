"""Content for synthetic logs: every frame at its rate, every channel different from the others.

Nothing here flies: channels are sines of their own frequency with seeded noise, in counts.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.protocol.log_writer import BLOCK, LogWriter, Timed, rows

IDENT_FINISHED_US = 4_600  # the analogue channels are converted by then
SCHEMA_RETURN_S = 60
INERTIAL = ("p", "q", "r", "ax", "ay", "az", "phi", "theta", "psi")
VANES = ("alpha_a", "alpha_b", "beta_a", "beta_b", "dp_a", "dp_b")
POTS = ("pot_elevator", "pot_aileron_left", "pot_aileron_right", "pot_rudder")
ANALOGUE = (*VANES, *POTS)
SERVOS = ("servo_aileron", "servo_elevator", "servo_rudder", "servo_throttle")
RECEIVER = ("rc_aileron", "rc_elevator", "rc_rudder", "rc_throttle", "rc_switch")
PULSES = (*SERVOS, *RECEIVER)
ALL_VALID = 0x3FFF


def ident(
    start_us: int,
    count: int,
    *,
    rate_hz: int = 100,
    first_count: int = 0,
    rng: np.random.Generator,
) -> Timed:
    """Make `count` identification frames from `start_us` (unwrapped) on."""
    number = np.arange(first_count, first_count + count, dtype=np.int64)
    period_us = 1_000_000 // rate_hz
    t_us = start_us + np.arange(count, dtype=np.int64) * period_us
    t_us += rng.integers(0, 9, count)
    made = rows("ident", count, t_us=wrapped(t_us), count=(number & 0xFFFF).astype(np.uint16))
    made["imu_age"] = rng.integers(55, 75, count)
    made["imu_seq"] = (number & 0xFF).astype(np.uint8)
    made["valid"] = ALL_VALID
    time_s = t_us * 1e-6
    for index, name in enumerate(INERTIAL):
        made[name] = _sine(time_s, 0.31 + 0.17 * index, 3000 + 500 * index, 0, rng, 12)
    for index, name in enumerate(ANALOGUE):
        made[name] = _sine(time_s, 0.23 + 0.13 * index, 300 + 60 * index, 2048, rng, 3)
    for index, name in enumerate(PULSES):
        made[name] = _sine(time_s, 0.11 + 0.07 * index, 500 + 40 * index, 3000, rng, 1)
    return Timed(made, t_us + IDENT_FINISHED_US)


def slow(start_us: int, duration_s: float, *, rng: np.random.Generator) -> list[Timed]:
    """Make the slower frames (mag, attitude, baro, gps, system) of a stretch of flight."""
    made = []
    for name, rate_hz in (("mag", 15), ("attitude", 10), ("baro", 25), ("gps", 5), ("system", 1)):
        count = round(duration_s * rate_hz)
        t_us = start_us + np.arange(count, dtype=np.int64) * (1_000_000 // rate_hz) + 137
        frame = rows(name, count, t_us=wrapped(t_us))
        time_s = t_us * 1e-6
        if name == "mag":
            for index, column in enumerate(("mx", "my", "mz")):
                frame[column] = _sine(time_s, 0.05 + 0.03 * index, 200, 0, rng, 2)
        elif name == "attitude":
            frame["imu_t_us"] = wrapped(t_us + 987_654)
            frame["imu_seq"] = np.arange(count) & 0xFF
            frame["imu_flags"] = 0x1C
            for index, column in enumerate(("bias_p", "bias_q", "bias_r")):
                frame[column] = _sine(time_s, 0.01, 5, 10 * (index + 1), rng, 1)
            frame["temperature"] = 3125
            frame["product_id"] = 0x58
            frame["dlpf"] = 3
        elif name == "baro":
            frame["raw_pressure"] = 23_843
            frame["raw_temperature"] = 27_898
            frame["static_pressure"] = _sine(time_s, 0.02, 8_000, 1_600_000, rng, 10)
            frame["temperature"] = 2215
            frame["sensor"] = 1
        elif name == "gps":
            frame["itow_ms"] = (t_us // 1000 + 345_600_000) & 0xFFFFFFFF
            frame["week"] = 2400
            frame["latitude"] = 302_850_000 + np.arange(count) * 3
            frame["longitude"] = -977_300_000 - np.arange(count) * 5
            frame["height"] = _sine(time_s, 0.02, 40_000, 250_000, rng, 50)
            frame["v_north"] = _sine(time_s, 0.03, 1500, 0, rng, 5)
            frame["v_east"] = _sine(time_s, 0.04, 1500, 0, rng, 5)
            frame["ground_speed"] = 1600
            frame["course"] = 9000
            frame["h_accuracy"] = 180
            frame["v_accuracy"] = 260
            frame["s_accuracy"] = 30
            frame["fix"] = 3
            frame["satellites"] = 11
            frame["source"] = 1
        else:
            frame["uptime_s"] = np.maximum(t_us // 1_000_000, 0)
            frame["loop_max_us"] = 812
            frame["cpu_load"] = 431
            frame["card_busy_max_ms"] = 7
            frame["ring_free_min"] = 4100
            frame["imu_packets"] = (np.arange(count) * 100) & 0xFFFF
            frame["rc_frame_us"] = 22_000
            frame["avcc_mv"] = 5021
            frame["rail"] = 2900
            frame["stack_free_min"] = 812
            frame["sensors"] = 0x7D
            frame["drive"] = 5
        made.append(Timed(frame, t_us + 300))
    return made


def write_flight(
    writer: LogWriter,
    duration_s: float,
    *,
    rate_hz: int = 100,
    start_us: int = 2_000_000,
    first_count: int = 0,
    seed: int = 1,
) -> int:
    """Write a stretch of flight, the schema returning every minute; return its end in us.

    Works minute by minute, so that a flight of days needs no more memory than one of a minute.
    """
    rng = np.random.default_rng(seed)
    written_s = 0.0
    count = first_count
    while written_s < duration_s:
        stretch_s = min(SCHEMA_RETURN_S, duration_s - written_s)
        now_us = start_us + round(written_s * 1e6)
        if written_s > 0:
            _return(writer, now_us, rate_hz)
        frames = round(stretch_s * rate_hz)
        fast = ident(now_us, frames, rate_hz=rate_hz, first_count=count, rng=rng)
        writer.extend([fast, *slow(now_us, stretch_s, rng=rng)])
        count += frames
        written_s += stretch_s
    return start_us + round(duration_s * 1e6)


def simple_log(
    duration_s: float = 3.0,
    *,
    rate_hz: int = 100,
    seed: int = 1,
    start_us: int = 2_000_000,
    session: int = 1,
    preallocated: int = 64 << 20,
) -> LogWriter:
    """Return the writer of a complete log: one session, properly ended."""
    writer = LogWriter(session=session, preallocated=preallocated)
    writer.begin(rate_hz=rate_hz, t_us=wrapped_int(start_us - 1000))
    _coefficients(writer, start_us)
    end_us = write_flight(writer, duration_s, rate_hz=rate_hz, seed=seed, start_us=start_us)
    writer.end(t_us=wrapped_int(end_us + 10_000))
    return writer


def large_log(path: Path, size: int, *, rate_hz: int = 100) -> None:
    """Write a log of about `size` bytes to `path`: one long session, minute by minute."""
    with path.open("wb") as sink:
        writer = LogWriter(sink, keep_truth=False)
        writer.begin(rate_hz=rate_hz)
        minute, now_us = 0, 2_000_000
        while writer.sequence * BLOCK < size:
            if minute:
                _return(writer, now_us, rate_hz)
            now_us = write_flight(
                writer,
                SCHEMA_RETURN_S,
                rate_hz=rate_hz,
                start_us=now_us,
                first_count=minute * SCHEMA_RETURN_S * rate_hz,
                seed=minute,
            )
            minute += 1
        writer.end(t_us=wrapped_int(now_us))


def wrapped(t_us: NDArray[np.int64]) -> NDArray[np.uint32]:
    """Return the 32 bits of the Mega's clock for unwrapped times."""
    return (t_us & 0xFFFFFFFF).astype(np.uint32)


def wrapped_int(t_us: int) -> int:
    """Return the 32 bits of the Mega's clock for an unwrapped time."""
    return t_us & 0xFFFFFFFF


def _return(writer: LogWriter, t_us: int, rate_hz: int) -> None:
    writer.schema()
    writer.head(rate_hz=rate_hz, t_us=wrapped_int(t_us))
    _coefficients(writer, t_us)


def _coefficients(writer: LogWriter, t_us: int) -> None:
    # AC1..AC6 B1 B2 MB MC MD of the BMP085 datasheet's example, page 15
    words = np.array([408, -72, -14383, 32741, 32757, 23153, 6190, 4, -32768, -8711, 2868, 0])
    writer.put(
        "baro_coefficients",
        t_us=wrapped_int(t_us),
        sensor=1,
        oversampling=0,
        words=(words & 0xFFFF).astype(np.uint16),
    )


def _sine(
    time_s: NDArray[np.floating],
    frequency_hz: float,
    amplitude: float,
    middle: float,
    rng: np.random.Generator,
    noise: float,
) -> NDArray[np.int64]:
    clean = middle + amplitude * np.sin(2 * np.pi * frequency_hz * time_s)
    noisy = clean + noise * rng.standard_normal(len(time_s))
    return np.asarray(np.rint(noisy), np.int64)
