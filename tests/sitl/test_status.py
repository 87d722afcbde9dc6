"""What the instrument says of itself on USB, and what keeps it from driving."""

import binascii
import struct

import numpy as np
import pytest
from host.link.status_line import StatusLine, parse_status
from host.twin.recorder.sitl_library import TICKS_PER_S, Level, Port
from host.wire.framing import text_of
from host.wire.schema_text import packed_schema

from tests.sitl import script as scripted
from tests.sitl.bench import Bench, flight

SELF_TEST, MEGA = (packed_schema().number("drive", n) for n in ("direct_self_test", "mega"))
REFERENCE_ADDRESS = 4092


def ticks(seconds: float) -> int:
    return round(seconds * TICKS_PER_S)


def last_line(bench: Bench) -> StatusLine:
    text = text_of(bench.sitl.sent(Port.USB)).decode("ascii").split("\r\n")[-2]
    line = parse_status(text)
    assert line is not None, text
    return line


def test_every_sensor_shows_its_value() -> None:
    bench = Bench()
    plan = flight(34.0)
    plan.give(bench.sitl)
    counts = [200.0, 300.0, 400.0, 500.0, 600.0, 700.0, 800.0, 900.0, 1000.0, 1023.0, 512.0]
    bench.sitl.set_analog(0, scripted.GRID_TICKS, np.tile(counts, (2, 1)))
    bench.sitl.power_on()
    bench.sitl.run_until(ticks(1.8))
    found = last_line(bench).as_json()
    assert found["complaints"] == ["pots: one is at an end of its range (-); plugged in?"]
    assert "None" not in str(found["imu"])
    assert found["alpha"] == {"state": "ok", "counts": [200, 300]}
    assert found["pitot"] == {"state": "ok", "counts": [600, 700]}
    assert found["pots"] == {"state": "ok", "counts": [800, 900, 1000, None]}
    assert found["rail_mv"] == 5000
    assert found["relay"] == "released"


def test_silent_sensors_are_stale_and_keep_their_last_value() -> None:
    bench = Bench()
    plan = flight(34.0)
    packets = plan.imu.packets()
    heard = plan.imu.start < ticks(5.0)
    bench.configure(auto_start=0)
    bench.sitl.add_edges(*plan.receiver.edges())
    bench.sitl.add_packets(plan.imu.start[heard], scripted.IMU_ADDRESS, packets[: int(heard.sum())])
    at, data = plan.gps.stream()
    bench.sitl.add_gps(at[at < ticks(5.0)], data[at < ticks(5.0)])
    bench.sitl.set_pressure(scripted.COEFFICIENTS, 0, scripted.PRESSURE_TICKS, plan.pressure)
    bench.sitl.power_on()
    bench.sitl.run_until(ticks(1.8))
    assert [last_line(bench).state(key) for key in ("imu", "baro", "gps")] == ["ok"] * 3
    bench.sitl.run_until(ticks(5.0))
    bench.sitl.remove_pressure()
    bench.sitl.run_until(ticks(9.0))
    line = last_line(bench)
    assert [line.state(key) for key in ("imu", "baro", "gps")] == ["stale"] * 3
    assert line.numbers("baro") != []
    assert line.as_json()["gps"] != {"state": "stale", "fix": None, "satellites": None}
    assert sum("went silent" in one for one in line.complaints()) == 3


def test_a_contact_that_is_closed_before_the_first_heartbeat_is_never_used() -> None:
    bench = Bench()
    flight(34.0).give(bench.sitl)
    bench.sitl.weld_relay()
    bench.sitl.power_on()
    bench.sitl.run_until(ticks(6.0))
    assert bench.sitl.levels(Level.RELAY)[0].size == 0
    assert bench.sitl.state().drive == SELF_TEST
    assert last_line(bench).state("relay") == "stuck"


def test_a_contact_that_stays_closed_is_not_used_again() -> None:
    bench = Bench()
    plan = flight(34.0)
    at, levels = plan.receiver.edges()
    lost = (at > ticks(6.0)) & (at < ticks(6.5))
    bench.configure(auto_start=0)
    bench.sitl.add_edges(at[~lost], levels[~lost])
    bench.sitl.power_on()
    bench.sitl.run_until(ticks(5.0))
    assert bench.sitl.state().drive == MEGA
    bench.sitl.weld_relay()
    bench.sitl.run_until(ticks(8.0))
    assert bench.sitl.state().drive == SELF_TEST
    assert last_line(bench).state("relay") == "stuck"


@pytest.mark.parametrize(
    ("seen_mv", "reference_mv", "drives"),
    [
        (4354, 0, True),  # 4.75 V by a chip whose reference is 1.2 V
        (4120, 0, False),  # below 4.5 V by any chip
        (4354, 1200, True),
        (4354, 1100, False),
        (5450, 1000, True),  # 4.95 V
        (4900, 1000, False),  # 4.45 V
    ],
)
def test_supply_is_judged_by_the_chips_own_reference(
    seen_mv: int, reference_mv: int, drives: bool
) -> None:
    bench = Bench()
    flight(34.0).give(bench.sitl)
    eeprom = bytearray(b"\xff" * 4096)
    if reference_mv:
        word = struct.pack("<H", reference_mv)
        eeprom[REFERENCE_ADDRESS:] = word + struct.pack("<H", binascii.crc_hqx(word, 0xFFFF))
    bench.sitl.set_eeprom(bytes(eeprom))
    bench.sitl.set_supply(seen_mv)
    bench.sitl.power_on()
    bench.sitl.run_until(ticks(6.0))
    assert bench.sitl.state().drive == (MEGA if drives else SELF_TEST)
    line = last_line(bench)
    assert line.supply_calibrated == (reference_mv > 0)
    shown_mv = line.as_json()["supply_mv"]
    assert shown_mv == pytest.approx(seen_mv * (reference_mv or 1100) / 1100, abs=1)
    assert any("supply below" in one for one in line.complaints()) == (not drives)
