"""Damaged logs: cut anywhere, bits flipped at random: an answer or one line, never a traceback."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from host.cli import main
from host.errors import HostError
from host.readers.autopilot_flight import read_autopilot
from host.readers.dataflash_binary import read_records

from tests.host.readers.autopilot_flights import FORMATS, rows_of, write

CUTS, FLIPS, SECTOR = 10, 6, 512


def attempt(path: Path, data: bytes) -> tuple[str, float]:
    """Return what came of a log: its damage or its error in words, and the seconds it holds."""
    path.write_bytes(data)
    try:
        flight = read_autopilot(path)
    except HostError as error:
        assert "\n" not in str(error)
        return str(error), 0.0
    columns = flight.columns()
    for name, values in columns.items():
        assert len(values) == len(columns["t_s"]), name
    length_s = float(np.ptp(columns["t_s"])) if columns else 0.0
    return "; ".join(flight.log.damage), length_s


@pytest.mark.parametrize("kind", FORMATS)
def test_a_log_cut_anywhere(kind: str, tmp_path: Path) -> None:
    """It is said, and the part before the cut is read."""
    whole = write(kind, tmp_path)
    data = whole.read_bytes()
    _, full_s = attempt(whole, data)
    rng = np.random.default_rng(5)
    for share in np.sort(rng.uniform(0.0, 1.0, CUTS)):
        size = int(share * len(data))
        said, length_s = attempt(tmp_path / f"cut{whole.suffix}", data[:size])
        assert length_s <= full_s
        assert length_s > 0.8 * share * full_s - 1.0 or "holds no" in said or share < 0.05
        assert said or kind == "tlog"  # a telemetry log has no end of its own


@pytest.mark.parametrize("kind", FORMATS)
def test_bits_flipped_at_random(kind: str, tmp_path: Path) -> None:
    """Most of the flight stays, and no value leaves the range of what can be."""
    whole = write(kind, tmp_path)
    data = np.frombuffer(whole.read_bytes(), dtype=np.uint8)
    _, full_s = attempt(whole, data.tobytes())
    rng = np.random.default_rng(6)
    kept = []
    for _ in range(FLIPS):
        hurt = data.copy()
        at = rng.integers(0, len(hurt), 20)
        hurt[at] ^= (1 << rng.integers(0, 8, 20)).astype(np.uint8)
        path = tmp_path / f"hurt{whole.suffix}"
        _, length_s = attempt(path, hurt.tobytes())
        kept.append(length_s)
        assert length_s < 1.5 * full_s + 60.0
    assert np.median(kept) > 0.9 * full_s


def test_a_lost_sector_brings_no_wrong_row(tmp_path: Path) -> None:
    """DataFlash: no row is made of the ends of two, as pymavlink splices one in 11 of 12 runs."""
    whole = write("dataflash", tmp_path)
    data = whole.read_bytes()
    right = read_records(whole)
    number = next(k for k, kind in right.kinds.items() if kind.name == "IMU")
    rows = {tuple(row) for row in zip(*(v.tolist() for v in rows_of(right, number).values()),
                                      strict=True)}  # fmt: skip
    rng = np.random.default_rng(8)
    path = tmp_path / "gap.bin"
    for at in rng.integers(2000, len(data) - SECTOR, 12).tolist():
        path.write_bytes(data[:at] + data[at + SECTOR :])
        found = read_records(path)
        assert found.lost
        own = zip(*(v.tolist() for v in rows_of(found, number).values()), strict=True)
        assert not {tuple(row) for row in own} - rows
        assert len(found.places[number]) > len(rows) - 20


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("verb", ["info", "decode", "maneuvers", "identify"])
def test_a_head_alone_is_one_line(
    kind: str, verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    whole = write(kind, tmp_path)
    path = tmp_path / f"head{whole.suffix}"
    path.write_bytes(whole.read_bytes()[: 20 if kind == "tlog" else 40])
    code = main([verb, str(path)])
    out, err = capsys.readouterr()
    assert code in (4, 6), (out, err)
    assert "Traceback" not in err
    assert len(err.strip().splitlines()) == 1
