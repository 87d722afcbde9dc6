"""A log with test points, a loss, a servo's jump and hostile names, for what is shown of it."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.host.logs import START_US, even, flight
from tests.protocol.log_writer import LogWriter, Timed

PLANTED = "</script><b>\x01\x1b"  # 15 of the 16 bytes of an aircraft's name
NAME = "<img src=x onerror=alert(1)>\x01\x0b\"'&.bin"
DOUBLETS_S = (8.0, 20.0, 33.0)
JUMP_S = 15.0
LOST_S = (27.0, 28.0)
_COUNTS = 140  # of the elevator's potentiometer, about 10 deg


def planted_flight(seconds: float = 40.0, *, rate_hz: int = 100) -> bytes:
    """Return a log: elevator doublets, one jump of its servo, a second lost, a hostile aircraft."""
    streams = flight(seconds, rate_hz=rate_hz)
    ident = streams[0]
    even(ident, rate_hz=rate_hz)
    t_s = np.arange(len(ident.rows)) / rate_hz
    move = np.sum([_doublet(t_s - at) for at in DOUBLETS_S], axis=0)
    rows = ident.rows
    rows["valid"] |= 1 << 15  # the Mega drives
    rows["pot_elevator"] = 2048 + _COUNTS * move
    for name in ("pot_aileron_left", "pot_aileron_right", "pot_rudder"):
        rows[name] = 2048
    rows["q"] = -2000 * np.convolve(move, np.exp(-t_s[:rate_hz] / 0.3))[: len(t_s)] / 30
    rows["dp_a"] = rows["dp_b"] = 2300
    rows["rc_elevator"] = rows["servo_elevator"] = 3000 + 100 * move
    rows["servo_elevator"][round(JUMP_S * rate_hz) : round((JUMP_S + 0.06) * rate_hz)] += 120
    for name in (
        "rc_aileron",
        "servo_aileron",
        "rc_rudder",
        "servo_rudder",
        "rc_throttle",
        "servo_throttle",
    ):
        rows[name] = 3000
    writer = LogWriter()
    writer.begin(rate_hz=rate_hz, t_us=0)
    writer.put("config", t_us=1, rate_hz=rate_hz, aircraft=PLANTED.encode())
    writer.extend([_part(one, 0.0, LOST_S[0]) for one in streams])
    writer.skip(20)
    writer.extend([_part(one, LOST_S[1], 1e9) for one in streams])
    writer.put("event", t_us=START_US + 12_000_000, code=24, arg=7)
    writer.end()
    return writer.data()


def written_flight(folder: Path, data: bytes | None = None) -> Path:
    """Write the log under its hostile name."""
    path = folder / NAME
    path.write_bytes(planted_flight() if data is None else data)
    return path


def _doublet(t_s: NDArray[np.float64]) -> NDArray[np.float64]:
    return 1.0 * ((t_s >= 0.0) & (t_s < 0.4)) - 1.0 * ((t_s >= 0.4) & (t_s < 0.8))


def _part(stream: Timed, from_s: float, to_s: float) -> Timed:
    t_s = (stream.finished_us - START_US) * 1e-6
    keep = (t_s >= from_s) & (t_s < to_s)
    return Timed(stream.rows[keep], stream.finished_us[keep])
