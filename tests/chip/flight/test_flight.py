"""The real image flies on the simulated chip: boots, records, drives, and its log is whole."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from both_images import each_image_once
from host.link.status_line import parse_status
from host.wire.framing import text_of
from image_hash import image_hash

import host

if TYPE_CHECKING:
    from flight.rig import FlightRig

MakeRig = Callable[..., "FlightRig"]


def test_bare_board_boots_and_says_what_is_missing(flight_elf: Path) -> None:
    from simavr_bench import Chip

    with Chip(startup_s=0.0) as chip:
        chip.load(flight_elf)
        chip.power_on()
        chip.run_s(3.0)
        text = text_of(chip.uart_sent(0)).decode("ascii")
        for missing in ("imu missing", "baro missing", "gps missing", "card missing"):
            assert missing in text
        assert chip.faults() == []


@pytest.mark.parametrize(
    ("flight_elf", "imu_hz"), each_image_once([(100.0,), (200.0,)]), indirect=["flight_elf"]
)
def test_every_sample_is_in_the_log_once(
    make_rig: MakeRig, flight_elf: Path, tmp_path: Path, imu_hz: float
) -> None:
    from flight.rig import check_card, take_log

    rig = make_rig(imu_hz=imu_hz)
    rig.take_off()
    rig.chip.run_s(8.0)
    sent = {s.sequence: s for s in rig.imu.sent}
    assert rig.relay.engaged
    said = text_of(rig.chip.uart_sent(0)).decode("ascii").split("\r\n")
    rig.land()
    check_card(rig.card_image)
    log = host.read_log(take_log(rig.card_image, tmp_path / "flight.bin"))
    ident = log.frames["ident"]
    assert not log.loss.any
    # The log, the boot line and what `host status` reads name the image that flew.
    image = image_hash(flight_elf)
    assert set(log.frames["image"]["hash"].tolist()) == {image}
    assert said[0] == f"mega2560 0.1.0 image {image:08x}"
    status = next(filter(None, map(parse_status, said)))
    assert (status.board, status.image) == ("mega2560", f"{image:08x}")
    # the logger runs at 100 Hz: of 200 samples a second it logs every second one
    step = round(imu_hz / 100)
    assert np.all(np.diff(ident["imu_seq"].astype(np.uint8)) == step)
    assert np.all(np.diff(ident["count"]) == 1)
    fresh = ident["p"] % 16000
    assert len(np.unique(fresh)) == len(ident)
    by_value = {s.sample.rates[0]: s for s in sent.values()}
    for row in ident[:: max(1, len(ident) // 50)]:
        if int(row["p"]) in by_value:
            assert int(row["q"]) == by_value[int(row["p"])].sample.rates[1]


def test_servos_repeat_the_sticks_through_the_relay(make_rig: MakeRig) -> None:
    from flight.rig import sine

    sticks = [sine(2.0, 1100, 1900), sine(3.0, 1200, 1800), sine(2.5, 1150, 1850)]
    rig = make_rig(sequential=False)
    rig.take_off()
    rig.chip.watch("PE4", "PE5", "PB5", "PE3")
    assert rig.relay.engaged
    begin = rig.chip.cycle
    for _ in range(400):
        time_s = rig.chip.cycle / 16e6
        rig.receiver.width_us[:3] = [stick(time_s) for stick in sticks]
        rig.chip.run_s(0.01)
    for channel, pin in enumerate(("PE4", "PE5", "PB5")):
        received = np.array([(e - s, e) for c, s, e in rig.receiver.sent if c == channel])
        at, level = rig.chip.edges(pin)
        at = at.astype(np.int64)
        starts, ends = at[level == 1], at[level == 0]
        starts = starts[starts > begin]
        ends = ends[ends > starts[0]]
        count = min(len(starts), len(ends))
        assert count > 150
        delays_ms = []
        for start, end in zip(starts[:count], ends[:count], strict=True):
            # 3 us of the capture's error, half a timer step, jitter of the receiver's model
            same = np.abs(received[:, 0] - (end - start)) <= 4 * 16
            before = received[same & (received[:, 1] <= start), 1]
            assert len(before) > 0
            delays_ms.append((start - before[-1]) / 16e3)
        assert max(delays_ms) <= 100.0
        assert np.median(delays_ms) <= 22.0
