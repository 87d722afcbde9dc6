"""Both images on one bus: each sample once in the log at its instant; faults and either side."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from both_images import each_image_once
from image_hash import image_hash

if TYPE_CHECKING:
    from imu.rig import PairRig

CHOSEN = (
    "IMU reset",
    "MPU sends garbage",
    "MPU stuck",
    "700 deg/s and 6 g",
    "bus: SDA low",
    "bus: SCL high",
    "Mega absent (in reset)",
    "Mega slow: 110 us a byte",
)


@pytest.mark.parametrize(
    ("gcc", "over_i2c"), each_image_once([(False,), (True,)]), ids=lambda value: str(value)
)
def test_every_sample_is_in_the_log_once_at_its_instant(
    tmp_path: Path, gcc: str, over_i2c: bool
) -> None:
    from flight.images import build_image
    from flight.rig import make_card
    from imu.link import run_link
    from imu.rig import PairRig

    card = make_card(tmp_path / "card.img")
    mega_elf, imu_elf = (build_image(unit, gcc) for unit in ("mega2560", "arduimu"))
    rig = PairRig(mega_elf, imu_elf, card, clock_ppm=3000.0, mpu_ppm=-8000.0, over_i2c=over_i2c)
    link = run_link(rig, 6.0, tmp_path)
    said = rig.board.chip.uart_sent(0)
    rig.close()
    assert said.startswith(b"imu image %08x\r\n" % image_hash(imu_elf))
    assert link.match.made > 1200
    assert link.match.once == link.match.made
    assert link.match.foreign == 0
    assert np.max(np.abs(link.match.error_us)) <= 50.0
    assert (link.lost_frames, link.imu_lost, link.imu_bad) == (0, 0, 0)
    assert link.field_frames > 80
    assert link.imu_load <= 0.60
    assert link.faults == 0


@pytest.mark.parametrize("injected", CHOSEN)
def test_fault_between_imu_and_mega(flying_pair: PairRig, tmp_path: Path, injected: str) -> None:
    from imu.faults import FAULTS, run_fault, verdict
    from simavr_bench import in_fork

    fault = next(fault for fault in FAULTS if fault.injected == injected)
    seen = in_fork(partial(run_fault, flying_pair, fault, tmp_path))
    assert verdict(fault, seen) == []


def test_the_mega_reads_the_compat_packets(mega_elf: Path, imu_elf: Path, tmp_path: Path) -> None:
    from flight.rig import make_card, take_log
    from imu.record import ImuRecord
    from imu.rig import PairRig

    import host

    card = make_card(tmp_path / "card.img")
    rig = PairRig(mega_elf, imu_elf, card, rate_hz=50)
    rig.board.chip.load(ImuRecord(compat=1).image())
    rates = np.deg2rad([5.0, -8.0, 12.0])
    force = [1.5, -2.5, -9.80665]
    rig.power_on()
    rig.mega.run_s(11.5)  # on the ground, where a file is made
    rig.board.mpu.motion([0.0], [rates], [force])
    rig.mega.run_s(1.0)
    rig.flight.receiver.width_us[3] = 1500.0
    rig.mega.run_s(4.0)
    rig.mega.power_off()
    log = host.read_log(take_log(card, tmp_path / "flight.bin"))
    rig.close()
    ident = log.frames["ident"]
    original = (ident["valid"] >> 14) & 1 == 1
    assert original.mean() > 0.98
    fresh = original & ((ident["valid"] >> 10) & 1 == 1)
    assert fresh.mean() > 0.95
    # 16.4 LSB per deg/s and minus specific force: what the original sends, turned by the host.
    for name, value in zip(("p", "q", "r"), (5.0, -8.0, 12.0), strict=True):
        assert np.mean(ident[name][fresh]) == pytest.approx(value * 16.4, abs=1.0)
    for name, value in zip(("ax", "ay", "az"), force, strict=True):
        assert np.mean(ident[name][fresh]) == pytest.approx(-value / 9.80665 * 8192, abs=8)
    table = log.table()
    rows = fresh[: len(table)]
    assert np.mean(table["p_radps"][rows]) == pytest.approx(rates[0], rel=0.02)
    assert np.mean(table["az_mps2"][rows]) == pytest.approx(-9.80665, rel=0.01)
