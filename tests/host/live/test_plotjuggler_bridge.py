"""What a PlotJuggler on this computer gets: each row once, as JSON that it can read."""

import contextlib
import json
import math
import socket

import numpy as np
import pytest
from host.errors import UsageError
from host.live.live_sample import LiveUpdate
from host.live.live_session import LiveSession
from host.live.live_stream import LiveStream
from host.live.plotjuggler_bridge import PlotJugglerBridge
from host.physical.calibration import load_calibration

from tests.host.live.radio import sent
from tests.host.live.test_mavlink_bridge import Nothing


def test_each_row_is_an_object_without_what_is_not_known() -> None:
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    listener.bind(("127.0.0.1", 0))
    listener.setblocking(False)
    stream = LiveStream(load_calibration())
    kept: list[LiveUpdate] = []
    stream.subscribe(kept.append)
    session = LiveSession(Nothing(), stream, None, print)
    bridge = PlotJugglerBridge(session, f"udpout:127.0.0.1:{listener.getsockname()[1]}")
    rows = []
    for part in sent(4.0):
        stream.feed(part.data, 0.0)
        with contextlib.suppress(BlockingIOError):
            while True:
                rows.append(json.loads(listener.recv(65536), parse_constant=pytest.fail))
    bridge.close()
    for part in sent(4.0):  # closed in mid-flight: no error reaches the stream
        stream.feed(part.data, 0.0)
    listener.close()
    seen = [one for one in kept if len(one)][: len(rows)]
    t_s = np.concatenate([one.rows["t_s"] for one in seen])[: len(rows)]
    assert len(rows) == 80  # four seconds at 20 Hz
    assert [row["timestamp"] for row in rows] == pytest.approx(list(t_s), abs=1e-5)
    for name in ("airspeed_a_mps", "q_degps", "phi_deg"):
        own = np.concatenate([one.rows[name] for one in seen])[: len(rows)]
        assert [row.get(name, math.nan) for row in rows] == pytest.approx(list(own), nan_ok=True)
    assert not any(math.isnan(value) for row in rows for value in row.values())


def test_a_wrong_place_is_refused() -> None:
    session = LiveSession(Nothing(), LiveStream(load_calibration()), None, print)
    with pytest.raises(UsageError, match="--plotjuggler udpin:h:1: expected udpout:HOST:PORT"):
        PlotJugglerBridge(session, "udpin:h:1")
