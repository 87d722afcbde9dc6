"""The fit of a calibration line: known lines come back, its uncertainty is what repeats show."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from host.physical.calibration import load_calibration

from tests.hw.test_pin_map import load_module

FIT = load_module("calibration/fit_line")
ANGLES_DEG = np.array([*range(-40, 41, 10), *range(40, -41, -10)], dtype=float)
HEAD = 'format = "flight-test-calibration"\nversion = 1\nname = "test"\ndate = "2026-11-21"\n'


def test_a_line_comes_back_exactly() -> None:
    fit = FIT.fit_line(ANGLES_DEG, 498.5 - 2.9 * ANGLES_DEG, reference=0.0)
    assert fit.zero == pytest.approx(498.5)
    assert fit.slope == pytest.approx(-1 / 2.9)
    assert fit.zero_sigma == pytest.approx(0.0, abs=1e-9)
    assert fit.hysteresis == pytest.approx(0.0, abs=1e-9)


def test_uncertainty_covers_what_repeats_show() -> None:
    rng = np.random.default_rng(3)
    fits = [
        FIT.fit_line(ANGLES_DEG, 500 + 3 * ANGLES_DEG + rng.normal(0, 1.0, 18), reference=0.0)
        for _ in range(400)
    ]
    slopes = np.array([fit.slope for fit in fits])
    assert np.mean([fit.slope_sigma for fit in fits]) == pytest.approx(
        slopes.std() / slopes.mean(), rel=0.12
    )
    # Scatter between up and down counts as hysteresis too: on the safe side, never below.
    zeros = np.array([fit.zero for fit in fits])
    assert np.mean([fit.zero_sigma for fit in fits]) >= zeros.std()


def test_hysteresis_and_reference_are_in_the_uncertainty() -> None:
    back = np.r_[np.zeros(9), np.full(9, 6.0)]
    fit = FIT.fit_line(ANGLES_DEG, 500 + 3 * ANGLES_DEG + back, reference=0.5)
    assert fit.hysteresis == pytest.approx(6.0)
    assert fit.zero == pytest.approx(503.0)
    assert fit.zero_sigma >= math.hypot(3.0 / math.sqrt(3.0), 1.5)
    assert fit.slope_sigma >= 0.5 * math.sqrt(2) / 80


def test_printed_table_is_read_by_the_host(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    points = tmp_path / "points.csv"
    rows = [f"{a},{512.0 + 1024 / 360 * a}" for a in ANGLES_DEG]
    points.write_text("true,raw\n" + "\n".join(rows) + "\n")
    words = [
        "channel.alpha_a",
        str(points),
        "--in",
        "deg",
        "--reference",
        "0.2",
        "--source",
        'a "b"',
    ]
    assert FIT.main(words) == 0
    path = tmp_path / "own.toml"
    path.write_text(HEAD + capsys.readouterr().out)
    line = load_calibration(path).lines["channel.alpha_a"]
    assert line.slope[0] == pytest.approx(2 * math.pi / 1024, rel=1e-6)
    assert line.zero[0] == pytest.approx(512.0)
    assert (line.unit, line.default) == ("rad", False)
    assert line.zero_sigma == pytest.approx(0.2 * 1024 / 360, abs=1e-3)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("true,raw\n0,1\n1,2\n", "2 points"),
        ("true,raw\n" + "5,500\n" * 9, "3 or more settings"),
        ("true,raw\n" + "".join(f"{a},{500 + (-1) ** a}\n" for a in range(9)), "does not follow"),
        ("angle,raw\n1,2\n", "columns true and raw"),
        ("true,raw\n1,\n", "columns true and raw"),
        ("true,raw\n" + "".join(f"{a},nan\n" for a in range(9)), "missing"),
    ],
)
def test_points_that_make_no_line(
    text: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "points.csv"
    path.write_text(text)
    assert FIT.main(["channel.dp_a", str(path), "--reference", "1", "--source", "x"]) == 2
    assert said in capsys.readouterr().err


def test_a_log_is_no_table_of_points(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "points.csv"
    path.write_bytes(b"FLT1\xb3\xff\x00\n\x80")
    assert FIT.main(["channel.dp_a", str(path), "--reference", "1", "--source", "x"]) == 2
    assert "columns true and raw" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "given", "reference"),
    [
        ("channel.alpha", "deg", "0.2"),
        ("channel.alpha_a", "degrees", "0.2"),
        ("channel.alpha_a", "deg", "nan"),
        ("channel.alpha_a", "deg", "-0.2"),
    ],
)
def test_a_word_that_would_spoil_the_line_is_refused(
    name: str, given: str, reference: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [name, "points.csv", "--in", given, "--reference", reference, "--source", "x"]
    with pytest.raises(SystemExit) as ended:
        FIT.main(words)
    assert ended.value.code == 2
    assert "invalid" in capsys.readouterr().err
