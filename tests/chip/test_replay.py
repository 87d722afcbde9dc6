"""Recorded stimuli reach the pins at their ticks; the program around it keeps its exit codes."""

from __future__ import annotations

import json
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import replay as program
from devices.stimuli import ANALOG, Replay, Stimuli, read_stimuli, signal_pins
from simavr_bench import Chip
from simavr_bench.log import pulses
from simavr_bench.sd_card import make_fat32
from simavr_bench.testing import MakeChip

ROOT = Path(__file__).resolve().parents[2]
TICKS_PER_S = 2_000_000


def some_stimuli(time_s: float = 1.0) -> Stimuli:
    rng = np.random.default_rng(2)
    duration = int(time_s * TICKS_PER_S)
    starts = np.arange(10_000, duration - 30_000, 40_000)
    edges, levels = [], []
    for start in starts:
        for bit in range(5):
            width = int(rng.integers(2000, 4000))
            edges += [start, start + width]
            levels += [1 << bit, 0]
            start += width + 10
    packets = np.arange(20_000, duration - 20_000, 10_000)
    rows = duration // 2000 + 1
    counts = np.linspace(100.25, 900.75, rows)[:, None] * np.ones(len(ANALOG))
    return Stimuli(
        duration=duration,
        edge_at=np.array(edges),
        edge_levels=np.array(levels, np.uint8),
        packet_start=packets,
        packet_address=np.full(len(packets), 43, np.uint8),
        packet_size=np.full(len(packets), 36, np.uint8),
        packet_data=rng.integers(0, 256, (len(packets), 40)).astype(np.uint8),
        analog=counts,
        pressure=np.column_stack((np.linspace(20_000, 30_000, rows), np.full(rows, 271_097.0))),
        coefficients=np.array(
            [408, -72, -14383, 32741, 32757, 23153, 6190, 4, -32768, -8711, 2868]
        ),
        gps_at=np.arange(100_000, duration - 10_000, 600),
        gps_value=np.arange(100_000, duration - 10_000, 600).astype(np.uint8),
        button_at=np.array([500_000, 600_000]),
    )


def test_stimuli_arrive_at_their_ticks(make_chip: MakeChip, tmp_path: Path) -> None:
    chip = make_chip("everything", power=False)
    given = some_stimuli()
    pins = signal_pins(ROOT / "hw" / "pin_map.toml")
    assert (pins["rc_0"], pins["imu_sda"], pins["card_cs"]) == ("PK0", "PD1", "PB0")
    lines = [pins[f"rc_{i}"] for i in range(5)]
    flight = Replay(chip, given, pins, make_fat32(tmp_path / "card.img"), busy_s=0.001)
    chip.watch(*lines, pins["button"])
    chip.pull(pins["button"], True)  # the recorder would switch its own on
    chip.power_on()
    flight.run()
    assert chip.cycle == given.duration * 8
    seen = pulses(*chip.edges(lines[2])) // 8
    rises = given.edge_at[given.edge_levels == 4]
    assert np.array_equal(seen[:, 0], rises)
    assert chip.read("packets") == len(given.packet_start)
    assert set(chip.twi_results().values()) == {36}
    assert chip.read("gps_bytes") == len(given.gps_at)
    assert list(chip.edges(pins["button"])[0][-2:] // 8) == [500_000, 600_000]
    assert chip.read("edges") == len(given.edge_at)
    # half way through the ramp the barometer's source and the converter agree with it
    assert flight.baro.source is not None
    assert flight.baro.source(given.duration * 4)[0] == pytest.approx(25_000, abs=1)


def test_program_reads_files_and_tells_what_it_did(
    build: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = some_stimuli(0.3)
    arrays = {name: np.asarray(getattr(given, name)) for name in Stimuli.__slots__}
    np.savez(tmp_path / "stimuli.npz", allow_pickle=False, **arrays)
    assert read_stimuli(tmp_path / "stimuli.npz").duration == given.duration
    elf = build.build_program("everything")
    card = make_fat32(tmp_path / "card.img")
    files = [str(elf), str(tmp_path / "stimuli.npz"), str(card)]
    assert program.main([*files, "--servos", str(tmp_path / "servos.npz")]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["simulated_s"] == pytest.approx(0.3)
    assert summary["resets"] == 1
    with np.load(tmp_path / "servos.npz") as servos:
        assert len(servos["servo_aileron"]) > 10
    busy, cut = "card_busy:0.1:50", "power_cut:0.25"
    assert program.main([*files, "--fault", busy, "--fault", cut]) == 0
    captured = json.loads(capsys.readouterr().out)
    assert captured["simulated_s"] == pytest.approx(0.25)
    assert captured["blocks_written"] < summary["blocks_written"]
    assert program.main([*files, "--fault", "meteor:0.1"]) == 2
    assert "meteor" in capsys.readouterr().err
    assert program.main([files[0], str(tmp_path / "none.npz"), files[2]]) == 2
    assert "none.npz" in capsys.readouterr().err
    np.savez(tmp_path / "wrong.npz", allow_pickle=False, duration=1)
    assert program.main([files[0], str(tmp_path / "wrong.npz"), files[2]]) == 2
    assert "wrong.npz" in capsys.readouterr().err


def test_wrong_eeprom_is_refused() -> None:
    with Chip() as chip, pytest.raises(ValueError, match="expected 4096"):
        chip.set_eeprom(b"")
