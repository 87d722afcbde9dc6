"""The SD card model, driven by a host of our own on the simulated chip."""

from __future__ import annotations

import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest
from simavr_bench import CardKind, SdCard, cycles
from simavr_bench.sd_card import make_fat32
from simavr_bench.testing import MakeChip, run_until_value


def pattern(seed: int) -> bytes:
    return bytes((seed + i * 7) & 0xFF for i in range(512))


@pytest.mark.parametrize("kind", list(CardKind), ids=lambda k: k.value)
def test_card_does_what_the_specification_says(make_chip: MakeChip, kind: CardKind) -> None:
    chip = make_chip("sd_card", power=False)
    card = SdCard(chip, "PB0", kind=kind, busy_s=0.003, blocks=8192)
    chip.power_on()
    run_until_value(chip, "finished", 1)
    seen = [int(v) for v in chip.read_array("result", "<u2")[: chip.read("result_count")]]
    high = kind is CardKind.SDHC
    back = pattern(1)[0] | pattern(1)[511] << 8
    assert seen[:4] == [0, int(high), 0, 0]
    assert seen[4:7] == [0, 5, 0]  # CMD24, accepted, status clean
    assert seen[7:9] == [0, 0x0B]  # wrong CRC refused
    assert seen[9:12] == [0, 0, back]
    assert seen[12:18] == [0, 0, 5, 5, 5, 5]
    assert seen[18:24] == [0, 0, 10, 0, 11, 0]
    assert seen[24:29] == [0, 0, 0, 0, 0]
    assert seen[29:] == [0x20, 0x04]  # address error, illegal command
    assert card.block(100) == pattern(1)
    assert card.block(101) == bytes(512)
    assert card.block(202, 2) == pattern(12) + pattern(13)
    assert card.block(200, 2) == bytes(1024)
    assert chip.read_array("busy_ticks", "<u2")[0] * 4 == pytest.approx(3000, abs=20)
    csd = chip.read_array("csd", "u1").tobytes()
    if high:
        assert (int.from_bytes(csd[7:10], "big") & 0x3FFFFF) + 1 == 8192 // 1024
    else:
        c_size = (csd[6] & 3) << 10 | csd[7] << 2 | csd[8] >> 6
        mult = (csd[9] & 3) << 1 | csd[10] >> 7
        assert (c_size + 1) << (mult + 2 + (csd[5] & 15)) == 8192 * 512


def test_stream_runs_at_the_bus_clock_and_busy_time(make_chip: MakeChip) -> None:
    chip = make_chip("sd_stream", power=False)
    card = SdCard(chip, "PB0", busy_s=0.001)
    chip.power_on()
    chip.run_s(0.5)
    before, at = chip.read("next_block"), chip.time_s
    chip.run_s(0.5)
    written = chip.read("next_block") - before
    per_block_s = (chip.time_s - at) / written
    # CRC in software dominates; 514 bytes at 8 MHz alone are 0.5 ms, busy is 1 ms
    assert 0.0015 < per_block_s < 0.03
    count = card.count()
    assert abs(count.written - chip.read("next_block")) <= 1
    for number in (0, 5, count.written - 2):
        assert card.block(1000 + number) == bytes((number + i) & 0xFF for i in range(512))


def test_card_that_is_slow_to_start_and_to_read(make_chip: MakeChip) -> None:
    finished_s = []
    for read_s, init_s in ((0.0002, 0.05), (0.0022, 0.05), (0.0002, 0.15)):
        chip = make_chip("sd_card", power=False)
        card = SdCard(chip, "PB0", blocks=8192)
        card.delay(read_s=read_s, init_s=init_s)
        chip.power_on()
        run_until_value(chip, "finished", 1)
        finished_s.append(chip.time_s)
    usual_s, reading_s, starting_s = finished_s
    assert starting_s - usual_s == pytest.approx(0.1, abs=0.005)
    assert reading_s - usual_s == pytest.approx(0.002 * 3, abs=0.0005)  # three commands that read


def test_blocks_put_while_the_card_is_out_are_on_it(make_chip: MakeChip) -> None:
    card = SdCard(make_chip("sd_card", power=False), "PB0", blocks=8192)
    card.remove()
    card.put(7, pattern(9) + pattern(8))
    assert card.block(7, 2) == pattern(9) + pattern(8)
    assert card.block(9) == bytes(512)


def test_stall_is_seen_by_the_host(make_chip: MakeChip) -> None:
    chip = make_chip("sd_stream", power=False)
    card = SdCard(chip, "PB0")
    card.stall(0.25, at_cycle=cycles(0.4))
    chip.power_on()
    chip.run_s(0.35)
    assert chip.read("longest_busy_us") < 1500
    chip.run_s(0.5)
    assert chip.read("longest_busy_us") == pytest.approx(250_000, abs=1000)


@pytest.mark.parametrize("token", [SdCard.CRC_REJECT, SdCard.WRITE_ERROR])
def test_rejected_block_is_sent_again(make_chip: MakeChip, token: int) -> None:
    chip = make_chip("sd_stream", power=False)
    card = SdCard(chip, "PB0")
    card.reject(2, token=token, at_cycle=cycles(0.4))
    chip.power_on()
    chip.run_s(1.0)
    assert chip.read("rejects") == 2
    count = card.count()
    assert count.rejected == 2
    assert count.bytes_ignored == 0
    for number in range(count.written - 1):
        assert card.block(1000 + number)[0] == number & 0xFF


def test_stream_is_dead_after_a_reject_until_it_is_ended(make_chip: MakeChip) -> None:
    chip = make_chip("sd_stream", power=False)
    card = SdCard(chip, "PB0")
    chip.power_on()
    chip.run_s(0.2)
    chip.poke(chip.symbols["careless"][0], b"\1")
    card.reject(1)
    while chip.read("rejects") == 0:
        chip.run_s(1e-3)
    before = card.count().written
    while chip.read("answers_missing") == 0:
        chip.run_s(1e-3)
    assert card.count().written == before
    assert card.count().bytes_ignored >= 1


def test_removed_card_is_silent_and_comes_back_uninitialised(make_chip: MakeChip) -> None:
    chip = make_chip("sd_stream", power=False)
    card = SdCard(chip, "PB0")
    chip.power_on()
    chip.run_s(0.5)
    assert chip.read("inits") == 1
    card.remove()
    chip.run_s(0.3)
    assert chip.read("answers_missing") == 1
    stopped = chip.read("next_block")
    card.insert()
    chip.run_s(1.0)
    assert chip.read("next_block") > stopped + 5


def test_power_cut_leaves_the_block_under_way_as_garbage(make_chip: MakeChip) -> None:
    chip = make_chip("sd_stream", power=False)
    card = SdCard(chip, "PB0", busy_s=0.005)
    rng = np.random.default_rng(5)
    lost = 0
    chip.power_on()
    for _ in range(12):
        chip.run_s(0.3 + float(rng.uniform(0, 0.02)))
        was_busy = card.busy
        chip.power_off()
        gone = card.count().lost - lost
        assert gone == int(was_busy)
        lost += gone
        number = chip.read("next_block")
        good = number - gone
        for block in range(max(0, good - 3), good):
            assert card.block(1000 + block) == bytes((block + i) & 0xFF for i in range(512))
        if gone:
            assert card.block(1000 + number - 1)[1] != number & 0xFF or card.block(
                1000 + number - 1
            ) != bytes((number - 1 + i) & 0xFF for i in range(512))
        chip.run_s(0.05)
        chip.power_on()
    assert lost > 0


def test_image_file_is_a_card_and_stays_one(make_chip: MakeChip, tmp_path: Path) -> None:
    path = make_fat32(tmp_path / "card.img", 64, cluster_blocks=1)
    chip = make_chip("sd_stream", power=False)
    card = SdCard(chip, "PB0", image=path)
    chip.power_on()
    chip.run_s(0.3)
    written = card.count().written
    assert written > 3
    raw = path.read_bytes()
    assert raw[(1000 + 1) * 512 : (1000 + 1) * 512 + 3] == b"\x01\x02\x03"
    assert struct.unpack_from("<H", raw, 510)[0] == 0xAA55
    other = make_fat32(tmp_path / "clean.img")
    check = subprocess.run(["/usr/sbin/fsck.vfat", "-n", other], capture_output=True, check=False)
    assert check.returncode == 0
