"""Time: 32-bit microseconds that wrap in flight, both rates, and runs that repeat exactly."""

from pathlib import Path

import numpy as np
import pytest
from host.twin.recorder.sitl_library import TICKS_PER_S, Port

from tests.sitl.bench import Bench, flight, missing
from tests.sitl.compare import NAMES, compare


def fly(bench: Bench, seconds: float = 20.0) -> None:
    flight(34.0).give(bench.sitl)
    bench.power_on_and_record(seconds - 0.5)
    bench.sitl.run_until(round(20.5 * TICKS_PER_S))
    bench.stop()


def test_clock_wraps_in_flight(tmp_path: Path) -> None:
    bench = Bench()
    offset = 2**32 - 10_000_000
    bench.sitl.set_clock_offset(offset)
    fly(bench)
    log = bench.log(tmp_path)
    t_us = log.frames["ident"]["t_us"]
    assert int(t_us.max()) > 2**32 - 20_000
    assert int(t_us.min()) < 20_000
    frames = {name: log.frames[name] for name in NAMES}
    wrong = [d for d in compare(frames, flight(34.0), clock_us=offset) if not d.good]
    assert wrong == []
    assert missing(log.frames["ident"]["count"]) == 0
    table = log.table()
    assert np.all(np.diff(table["t_s"]) > 0.005)
    assert log.complete == "complete"


@pytest.mark.parametrize("rate_hz", [50, 100, 200])
def test_rates(tmp_path: Path, rate_hz: int) -> None:
    bench = Bench()
    bench.set_rate(rate_hz)
    fly(bench)
    log = bench.log(tmp_path)
    ident = log.frames["ident"]
    seconds = (int(ident["t_us"][-1]) - int(ident["t_us"][0])) / 1e6
    assert abs((len(ident) - 1) / seconds / rate_hz - 1) < 0.005
    assert missing(ident["count"]) == 0
    assert np.all(ident["valid"] & 0x2400 == 0x2400)  # fresh, and an IMU packet set the time
    frames = {name: log.frames[name] for name in NAMES}
    assert [d for d in compare(frames, flight(34.0)) if not d.good] == []


def test_two_runs_give_identical_cards_and_outputs() -> None:
    results = []
    for _ in range(2):
        bench = Bench()
        fly(bench, 6.0)
        start, output, width = bench.sitl.pulses()
        results.append(
            (
                bytes(bench.image),
                bench.sitl.eeprom(),
                bench.sitl.sent(Port.TELEMETRY),
                bench.sitl.sent(Port.USB),
                start.tobytes() + output.tobytes() + width.tobytes(),
            )
        )
    assert results[0] == results[1]
    assert len(results[0][2]) > 10_000


def test_how_time_is_cut_into_steps_changes_nothing() -> None:
    logs = []
    for step_s in (0.003, 1.7):
        bench = Bench()
        flight(34.0).give(bench.sitl)
        bench.sitl.power_on()
        bench.sitl.press(round(0.6 * TICKS_PER_S), 0.2)
        while bench.sitl.now() < 4 * TICKS_PER_S:
            bench.sitl.run_for(step_s)
        bench.sitl.run_until(round(5.2 * TICKS_PER_S))
        logs.append(bytes(bench.image))
    assert logs[0] == logs[1]
