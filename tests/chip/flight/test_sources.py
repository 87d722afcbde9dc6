"""What may stand in for the usual devices, and a board with next to nothing, on the real image."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from host.original.rows import parse_rows

import host

if TYPE_CHECKING:
    from devices.ardu_imu import ImuSample
    from flight.rig import FlightRig

MakeRig = Callable[..., "FlightRig"]

ASCII_ROW, ORIGINAL_GPS = 2, 2  # telemetry, gps_source of firmware/settings.toml
BUTTON, LED, BUZZER = "PG0", "PH3", "PH4"
LATITUDE, LONGITUDE = 250_500_000, 1_215_000_000  # of the original packets of devices/ardu_imu.py
RATE_STEPS = 16.4 / 65.5  # of the original packets, to those of ours


def turning(time_s: float) -> ImuSample:
    """Give samples that move, slowly enough for rows five times a second."""
    from devices.ardu_imu import ImuSample

    swing = round(1000 * math.sin(time_s))
    return ImuSample((swing, -swing, 2 * swing), (100 + swing, -swing, -8192), (swing, 300, 9000))


def test_original_imu_with_its_position_and_ascii_rows(make_rig: MakeRig, tmp_path: Path) -> None:
    """The 2015 wiring: two packets to 42 and 27, GPS inside them, rows for its ground station."""
    from flight.rig import CRUISE_US, MEGA_US, check_card, take_log
    from flight.settings import settings_image

    rig = make_rig(imu_hz=50.0)
    rig.imu.original, rig.imu.scl_hz, rig.source = True, 100_000.0, turning
    rig.chip.load(settings_image(telemetry=ASCII_ROW, gps_source=ORIGINAL_GPS))
    rig.power_on()
    rig.chip.run_s(11.0)
    assert "| gps fix 3 sat 8 |" in rig.status_lines()[-1]
    rig.receiver.width_us[3] = CRUISE_US
    rig.chip.run_s(1.5)
    rig.receiver.width_us[4] = MEGA_US
    rig.chip.run_s(4.5)
    sent, flown_s = rig.chip.uart_sent(3), rig.chip.cycle / 16e6
    assert rig.relay.engaged
    rig.land()
    check_card(rig.card_image)

    parsed = parse_rows(sent)
    assert parsed.variant == "26 readings"
    rows = sent.count(b"RLL:")
    assert 3 * flown_s <= rows <= 5 * flown_s + 1
    live = slice(-12, -1)
    assert np.all(np.abs(parsed.values["AN5"][live] - 8192) <= 1)  # minus specific force
    assert np.all(np.abs(parsed.values["AN0"][live]) <= 1000 * RATE_STEPS + 1)
    assert float(np.ptp(parsed.values["AN0"][live])) > 50
    assert np.all(np.abs(parsed.values["lat"][live] - LATITUDE / 1e7) < 1e-3)

    log = host.read_log(take_log(rig.card_image, tmp_path / "flight.bin"))
    assert not log.loss.any
    gps = log.frames["gps"]
    assert len(gps) > 10
    assert set(gps["source"].tolist()) == {ORIGINAL_GPS}
    assert np.all(np.abs(gps["latitude"] - LATITUDE) <= 40)  # they are float32
    assert np.all(np.abs(gps["longitude"] - LONGITUDE) <= 80)
    names = ("p", "q", "r", "ax", "ay", "az")
    logged = np.stack([log.frames["ident"][name].astype(float) for name in names], axis=1)
    sample = [(*s.sample.rates, *s.sample.specific_force) for s in rig.imu.sent]
    wanted = np.array(sample, dtype=float) * ([RATE_STEPS] * 3 + [-1.0] * 3)
    distance = np.abs(logged[:, None, :] - wanted[None, :, :]).max(axis=2).min(axis=1)
    assert float(distance.max()) <= 1.0  # never of two packets that do not belong together


def test_bmp280_stands_in_for_the_bmp085(make_rig: MakeRig, tmp_path: Path) -> None:
    from flight.rig import CRUISE_US, take_log
    from simavr_bench import Bmp280

    rig = make_rig()
    rig.baro.present = False
    baro = Bmp280(rig.chip, "PA2", "PA3")
    rig.power_on()
    rig.chip.run_s(11.0)
    assert "baro 10065" in rig.status_lines()[-1]  # 100653 Pa: the datasheet's example
    rig.receiver.width_us[3] = CRUISE_US
    rig.chip.run_s(4.0)
    rig.land()
    rows = host.read_log(take_log(rig.card_image, tmp_path / "flight.bin")).frames["baro"]
    assert len(rows) > 50
    assert set(rows["sensor"].tolist()) == {2}
    assert np.all(rows["raw_pressure"] == baro.raw_pressure)
    assert np.all(np.abs(rows["static_pressure"] / 16.0 - 100653.27) < 4.0)
    assert np.all(rows["temperature"] == 2508)


def test_bare_board_with_a_card_records_what_is_there(make_rig: MakeRig, tmp_path: Path) -> None:
    """No receiver, IMU, barometer, GPS: the button starts, rows come by the timer, marked."""
    from flight.faults.model import valid_bit
    from flight.rig import check_card, take_log

    rig = make_rig()
    rig.baro.present = False
    rig.chip.watch(LED, BUZZER)
    rig.chip.power_on()
    rig.chip.run_s(24.0)  # nobody but the pitots says still: 18 s, and the file is made
    assert any("card ready 1" in line for line in rig.status_lines()[-2:])
    pressed = rig.chip.cycle
    assert rig.chip.level(LED)
    rig.chip.drive(BUTTON, False)
    rig.chip.run_s(0.2)
    rig.chip.drive(BUTTON, None)
    rig.chip.run_s(4.0)
    at, _ = rig.chip.edges(LED)
    assert np.all(at[at < pressed] < pressed - 16_000_000)  # steady: ready
    assert np.diff(at[at > pressed])[1:] / 16e3 == pytest.approx(500, abs=20)  # it records
    at, level = rig.chip.edges(BUZZER)
    assert level[at > pressed].tolist() == [1, 0]  # one tone
    assert np.diff(at[at > pressed]) / 16e3 == pytest.approx(500, abs=20)
    assert all(state != 2 for _, state in rig.relay.contacts)
    rig.land()
    check_card(rig.card_image)
    log = host.read_log(take_log(rig.card_image, tmp_path / "flight.bin"))
    assert not log.loss.any
    ident = log.frames["ident"]
    assert len(ident) > 350
    steps_us = np.diff(ident["t_us"].astype(np.int64))
    assert np.all(np.abs(steps_us - 10_000) <= 300)  # a turn that looks at the stack takes 0.24 ms
    assert steps_us.mean() == pytest.approx(10_000, abs=1)
    assert np.all(np.abs(ident["alpha_a"] / 4096 * 5.0 - 0.8) < 0.01)
    bits = valid_bit("imu_fresh") | valid_bit("imu_triggered") | valid_bit("mega_drives")
    assert not np.any(ident["valid"] & bits)
    for name in ("rc_aileron", "rc_switch", "servo_throttle"):
        assert not np.any(ident[name]), name
    assert len(log.frames["baro"]) == len(log.frames["gps"]) == 0
