"""Flying or on the ground, from the pins: what the recorder does to its card in either case."""

from __future__ import annotations

import numpy as np
import pytest
from host.twin.recorder.sitl_library import TICKS_PER_S, Recorder

from tests.sitl import script as scripted
from tests.sitl.bench import GROUND_S, Bench, idle_receiver
from tests.sitl.card_image import new_card

WITNESSES = ("throttle", "airspeed", "gps", "pressure", "imu")
READY_S = 30.0
RECORD_S = 4.0


def world(bench: Bench, first_s: float, last_s: float, says: dict[str, str]) -> None:
    """Give every sensor's pins from one time to another: still, moving or nothing."""
    from_tick, count = round(first_s * TICKS_PER_S), round((last_s - first_s) * 200)
    time_s = np.arange(count) / 200

    raw = np.tile(np.array(scripted.LEVEL), (count, 1))
    if says["imu"] == "moving":
        raw[:, 0] += np.round(400 * np.sin(2 * np.pi * 0.7 * time_s)).astype(np.int64)
    if says["imu"] != "nothing":
        start = from_tick + np.arange(count) * 10_000
        zeros = np.zeros(count, dtype=np.int64)
        imu = scripted.Imu(start, raw, zeros, np.zeros((count, 3), np.int64), zeros + 225, zeros)
        bench.sitl.add_packets(start, scripted.IMU_ADDRESS, imu.packets())

    counts = np.full((2, 11), 500.0)
    dp = {"still": 511.5, "moving": 560.0, "nothing": 0.0}[says["airspeed"]]
    counts[:, 4] = counts[:, 5] = dp
    bench.sitl.set_analog(from_tick, TICKS_PER_S, counts)

    if says["pressure"] == "nothing":
        bench.sitl.remove_pressure()
    else:
        sink = 0.35 if says["pressure"] == "moving" else 0.0  # UP per 10 ms: some 2 m/s
        steps = np.arange(round((last_s - first_s) * 100))
        ut, up = scripted.STILL_AIR
        rows = np.stack([np.full(len(steps), ut), up * 2 + sink * 2 * steps], axis=1)
        bench.sitl.set_pressure(scripted.COEFFICIENTS, from_tick, scripted.PRESSURE_TICKS, rows)

    if says["gps"] != "nothing":
        epochs = scripted.gps(last_s - first_s)
        speed = 1100 if says["gps"] == "moving" else 30
        epochs.values["ground_speed"][:] = speed
        epochs.start = epochs.start + from_tick
        bench.sitl.add_gps(*epochs.stream())

    if says["throttle"] != "nothing":
        # A receiver that boots with the Mega: its first pulse comes 2.5 s after the power.
        high = 1700 if says["throttle"] == "moving" else 1100
        idle_receiver(bench.sitl, first_s + 2.5, last_s, throttle_us=high)


def everybody(says: str, **others: str) -> dict[str, str]:
    return {witness: others.get(witness, says) for witness in WITNESSES}


def wake_with_an_open_file(says: dict[str, str], *, lasts_s: float) -> tuple[Bench, int]:
    """Record, lose the supply and with it the mark, wake in a world; give the writes so far."""
    bench = Bench()
    bench.power_on_and_record(RECORD_S)
    bench.sitl.power_cut(3)
    bench.sitl.run_for(0.5)
    now_s = bench.sitl.now() / TICKS_PER_S
    world(bench, now_s, now_s + lasts_s + 1.0, says)
    bench.sitl.power_on()
    return bench, bench.sitl.state().ground_writes


@pytest.mark.parametrize("missing", ["none", "airspeed", "gps", "pressure", "imu"])
def test_idle_glide_behind_a_supply_dip_goes_on_in_its_file(missing: str) -> None:
    glide = everybody("moving", **{"throttle": "still", "gps": "nothing", missing: "nothing"})
    bench, written = wake_with_an_open_file(glide, lasts_s=40.0)
    bench.sitl.run_for(6.0)
    assert bench.state() == Recorder.RECORDING
    bench.sitl.run_for(34.0)
    assert bench.state() == Recorder.RECORDING
    assert bench.sitl.state().file_number == 1
    assert bench.sitl.state().ground_writes == written


@pytest.mark.parametrize("witness", ["none", *WITNESSES])
@pytest.mark.parametrize("how", ["nothing", "moving"])
def test_aircraft_that_stands_still_is_ready(how: str, witness: str) -> None:
    """Any one sensor missing or stuck, with an open file of the flight before."""
    bench, _ = wake_with_an_open_file(everybody("still", **{witness: how}), lasts_s=READY_S)
    bench.sitl.run_for(READY_S)
    # A throttle that is stuck above idle starts a recording as soon as there is a file.
    recording = (how, witness) == ("moving", "throttle")
    assert bench.state() == (Recorder.RECORDING if recording else Recorder.READY)
    if not recording:
        assert bench.sitl.state().file_number == 2


@pytest.mark.parametrize("witness", ["none", *WITNESSES])
@pytest.mark.parametrize("how", ["nothing", "moving"])
def test_new_card_is_ready_on_the_ground(how: str, witness: str) -> None:
    bench = Bench(new_card())
    world(bench, 0.0, READY_S + 1.0, everybody("still", **{witness: how}))
    bench.sitl.power_on()
    bench.sitl.run_for(READY_S)
    recording = (how, witness) == ("moving", "throttle")
    assert bench.state() == (Recorder.RECORDING if recording else Recorder.READY)


def test_new_card_in_flight_gets_no_metadata() -> None:
    """A card swapped in while it flies, throttle idle: 20 s of a receiver's idle are no ground."""
    bench = Bench(new_card())
    world(bench, 0.0, 62.0, everybody("moving", throttle="still"))
    bench.sitl.power_on()
    bench.sitl.run_for(60.0)
    assert bench.sitl.state().ground_writes == 0


def test_bare_board_waits_for_the_receiver() -> None:
    """3 s without a receiver are not the ground."""
    bench = Bench(new_card())
    bench.sitl.power_on()
    bench.sitl.run_for(17.0)
    assert bench.sitl.state().ground_writes == 0
    bench.sitl.run_for(GROUND_S - 17.0)
    assert bench.state() == Recorder.READY
