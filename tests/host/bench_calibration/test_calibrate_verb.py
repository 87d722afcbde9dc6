"""`host calibrate` as a user has it: guide, template, table, keyboard, file, picture, check."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
from host.bench_calibration import bench_session
from host.cli import main
from host.constants import RAD_PER_DEG
from host.instrument.instrument_errors import instrument_errors
from host.physical.calibration import load_calibration
from studies.bench_instruments import bench_channels


@pytest.fixture
def drawing() -> None:
    """Draw the pictures too, half a second each."""


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> Path:
    """Return a working folder with tables of one virtual instrument."""
    monkeypatch.chdir(tmp_path)
    if "drawing" not in request.fixturenames:
        monkeypatch.setattr(bench_session, "draw_picture", lambda *_: None)
    lines: dict[str, list[str]] = {}
    for one in bench_channels(np.random.default_rng(77)):
        rows = lines.setdefault(one.subject.name, ["channel,repeat,position,counts"])
        rows += [
            f"{one.channel},{p.repeat},{p.position:g},{p.readings[one.channel]:.3f}"
            for p in one.held
            if not p.change
        ]
    for name, rows in lines.items():
        Path(f"{name}.csv").write_text("\n".join(rows) + "\n")
    return tmp_path


def _said(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    code = main(["calibrate", *words])
    out, err = capsys.readouterr()
    return code, out, err


def test_a_table_becomes_a_dated_file_that_identification_counts(
    bench: Path, drawing: None, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, _ = _said(
        capsys, "vanes", "vanes.csv", "--instrument", "logger 1", "--date", "2026-11-23",
        "--serial", "alpha_a=7", "--temperature", "21", "--by", "J. Doe",
    )  # fmt: skip
    assert code == 0
    path = Path("logger_1-2026-11-23.toml")
    assert f"to {path}" in out
    calibration = load_calibration(path)
    line = calibration.lines["channel.alpha_a"]
    assert (calibration.name, calibration.date) == ("logger 1", "2026-11-23")
    assert "J. Doe" in line.source
    assert 'serial = "7"' in path.read_text()
    assert "temperature_degc = 21.0" in path.read_text()
    errors = instrument_errors(None, calibration)
    assert errors["vane_zero_rad"].sigma("alpha_a") == pytest.approx(
        line.zero_sigma * line.slope[0], rel=1e-3
    )
    assert errors["vane_scale"].sigma("alpha_a") == pytest.approx(line.slope_sigma, rel=1e-3)
    picture = Path("logger_1-2026-11-23-vanes.svg").read_text()
    assert all(name in picture for name in ("alpha_a", "beta_b", "repeat 3", "from below"))


def test_lines_of_other_channels_stay(bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.toml").write_text(
        'format = "flight-test-calibration"\nversion = 1\nname = "n"\ndate = "2026-01-01"\n'
        '[error.thrust_share]\nsigma = 0.01\nsource = "stand"\n'
    )
    assert _said(capsys, "vanes", "vanes.csv", "--into", "own.toml")[0] == 0
    assert _said(capsys, "pots", "pots.csv", "--into", "own.toml")[0] == 0
    read = load_calibration("own.toml")
    measured = set(read.lines) - set(read.defaults())
    assert {"channel.alpha_a", "channel.pot_rudder"} <= measured
    assert read.errors["thrust_share"]["sigma"] == 0.01


def test_a_doubted_line_is_drawn_and_not_written(
    bench: Path, drawing: None, capsys: pytest.CaptureFixture[str]
) -> None:
    text = Path("pots.csv").read_text().splitlines()
    bad = [
        f"{row.rpartition(',')[0]},{float(row.rpartition(',')[2]) + 40.0}"
        if row.startswith("pot_rudder") and row.split(",")[2] == "10"
        else row
        for row in text
    ]
    Path("pots.csv").write_text("\n".join(bad) + "\n")
    code, out, _ = _said(capsys, "pots", "pots.csv", "--into", "own.toml")
    assert code == 6
    assert "pot_rudder is worn: a dead spot at 10 deg" in out
    assert "channel.pot_rudder" in load_calibration("own.toml").defaults()
    assert "pot_rudder (doubted)" in Path("own-pots.svg").read_text()


@pytest.mark.parametrize(("typed", "code"), [("y", 0), ("n", 6)])
def test_vanes_of_another_slope_are_asked_about(
    typed: str,
    code: int,
    bench: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Potentiometers of a third of the slope: their counts move and scatter threefold."""
    head, *rows = Path("vanes.csv").read_text().splitlines()
    cells = [row.rpartition(",") for row in rows]
    other = [f"{place},{512.0 + 3.0 * (float(counts) - 512.0):.3f}" for place, _, counts in cells]
    Path("vanes.csv").write_text("\n".join([head, *other]) + "\n")
    monkeypatch.setattr("sys.stdin", io.StringIO(f"{typed}\n"))
    ended, out, err = _said(capsys, "vanes", "vanes.csv", "--into", "own.toml")
    assert ended == code
    assert "Is it another sensor" in err
    lines = load_calibration("own.toml").lines if code == 0 else {}
    for channel in ("alpha_a", "beta_b") if code == 0 else ():
        slope = lines[f"channel.{channel}"].slope[0]
        assert slope == pytest.approx(0.352 * RAD_PER_DEG / 3.0, rel=0.04)
    assert ("nothing was written" in out) == (code == 6)


def test_typed_readings_are_asked_for_in_words(
    bench: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("500\n528\nb\n529\nwhat\n557\n528\n500\nq\n"))
    code, out, err = _said(
        capsys, "alpha_a", "-", "--positions", "0,10,20,10,0", "--into", "own.toml"
    )
    assert code == 0
    assert "set +10 deg (from above)" in err
    assert "'what' is no number" in err
    assert "1 repeat of 3" in out
    line = load_calibration("own.toml").lines["channel.alpha_a"]
    assert line.slope[0] == pytest.approx(10.0 * RAD_PER_DEG / 28.5, rel=0.01)


def test_check_says_what_moved(bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _said(capsys, "vanes", "vanes.csv", "--into", "old.toml", "--date", "2026-01-01")[0] == 0
    rows = Path("vanes.csv").read_text().splitlines()
    moved = [
        f"{row.rpartition(',')[0]},{float(row.rpartition(',')[2]) + 9.0}"
        if row.startswith("beta_b")
        else row
        for row in rows
    ]
    Path("later.csv").write_text("\n".join(moved) + "\n")
    assert _said(capsys, "vanes", "later.csv", "--into", "new.toml", "--date", "2026-02-01")[0] == 0
    code, out, _ = _said(capsys, "--check", "old.toml")
    assert code == 6
    assert re.findall(r"channel\.(\w+) +(\w+) .*MOVED", out) == [("beta_b", "zero")]
    assert "1 of 8 numbers moved" in out
    code, out, _ = _said(capsys, "old.toml", "--check", "old.toml", "--json")
    assert code == 0
    assert not any(row["moved"] for row in json.loads(out)["numbers"])
    assert _said(capsys, "vanes", "later.csv", "--into", "new.toml", "--check", "old.toml")[0] == 6


def test_every_template_is_read_once_it_is_filled(
    bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _said(capsys, "dp_a", "--template", "own.csv")[0] == 0
    head, leak, *rest = Path("own.csv").read_text().splitlines()
    slope = 2.0  # counts per mm
    filled = [f"{','.join(row.split(',')[:3])},{512 + slope * float(row.split(',')[2])},,"
              for row in rest]  # fmt: skip
    Path("own.csv").write_text("\n".join([head, "dp_a,1,40,592,580,60", *filled]) + "\n")
    code, out, _ = _said(capsys, "dp_a", "own.csv", "--into", "own.toml")
    assert code == 6
    assert "dp_a has a leaking tube: a held pressure falls by 15.0 % a minute" in out
    assert leak.endswith(",60")
    code, _, err = _said(capsys, "dp_a", "--template", "own.csv")
    assert code == 2
    assert "is there already" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["alpha"], "nothing to calibrate is called 'alpha'"),
        (["vanes", "none.csv"], "no such file"),
        (["vanes", "."], "a folder; name a file in it"),
        (["vanes", "bad.csv"], "no column position"),
        (["vanes", "-"], "which channel was moved?"),
        (["alpha_a", "words.csv"], "expected a number with a point"),
        (["alpha_a", "empty.csv"], "fill in the column counts"),
        (["vanes", "vanes.csv", "--serial", "q=7"], "expected CHANNEL=TEXT"),
        (["vanes", "vanes.csv", "--date", "today"], "expected YYYY-MM-DD"),
        (["alpha_a", "vanes.csv", "--positions", "0,x"], "expected numbers such as"),
        (["gyros", "vanes.csv"], "no column kind"),
        (["supply", "vanes.csv"], "no column shown_v"),
        (["--check", "none.toml"], "no calibration file"),
        (["vanes", "vanes.csv", "--into", "words.csv"], "not TOML"),
        (["vanes", "vanes.csv", "--picture", "a.png"], "ends in .svg"),
    ],
)
def test_what_cannot_be_used_is_one_line(
    bench: Path, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("bad.csv").write_text("channel,angle\nalpha_a,1\n")
    Path("words.csv").write_text("position,counts\n0,five\n")
    Path("empty.csv").write_text("position,counts\n0,\n")
    code, _, err = _said(capsys, *words)
    assert code == 2
    assert said in err
    assert len(err.splitlines()) == 1
    assert not Path("instrument.toml").exists()


def test_without_anything_it_says_what_to_do(
    bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, _ = _said(capsys)
    assert code == 0
    assert "accelerometers" in out
    for word in ("vanes", "dp_a", "gyros", "magnetometer", "supply", "throttle", "speed"):
        code, out, _ = _said(capsys, word)
        assert code == 0
        assert out.startswith("1. ")
