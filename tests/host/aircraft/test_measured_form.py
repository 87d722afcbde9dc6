"""`host aircraft`: a form filled by options or at a terminal, computed where it can be, checked."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest
from host.aircraft.file import load_measured
from host.aircraft.mass_properties import airframe_data
from host.aircraft.measured_form import questions
from host.cli import main

from tests.host.logs import ROOT

ANSWERS = {
    "name": "mine", "title": 'My "first" trainer', "mass_kg": "1.793", "ixx_kgm2": "0.0438",
    "iyy_kgm2": "0.0838", "izz_kgm2": "0.1193", "source": "scale, J. Doe",
    "wing_area_m2": "0.309", "span_m": "1.264", "airspeed_mps": "17",
    "imu_m": "0.02, 0, 0.01", "vane_a_m": "0.18 -0.6 0", "pitot_a_m": "0.16,-0.5,0",
    "gps_m": "[-0.1, 0, -0.05]",
}  # fmt: skip


def words(answers: dict[str, str]) -> list[str]:
    return [word for key, value in answers.items() for word in ("--set", f"{key}={value}")]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys.stdin, "isatty", lambda: False)


def test_options_give_the_file_that_identify_takes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["aircraft", "new", "mine.toml", *words(ANSWERS)]) == 0
    found = airframe_data("mine.toml")
    assert (found.mass_kg, found.izz_kgm2) == (1.793, 0.1193)
    assert found.imu_m == (0.02, 0.0, 0.01)
    measured = load_measured("mine.toml")
    assert measured.title == 'My "first" trainer'
    assert measured.scalars["geometry.chord_m"] == pytest.approx(0.309 / 1.264, rel=1e-3)
    assert tuple(measured.vectors["sensors.vane_b_m"]) == (0.18, 0.6, 0.0)
    assert main(["aircraft", "check", "mine.toml"]) == 0
    out = capsys.readouterr().out
    assert "1.793 kg, span 1.264 m" in out and "plan and simulate want aerodynamics" in out
    assert main(["aircraft", "check", "kadetlt40"]) == 0
    assert "good for host identify, preflight and live, plan" in capsys.readouterr().out


def test_a_terminal_is_asked_for_the_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def ask(prompt: str) -> str:
        key = prompt.partition(":")[0]
        asked.append(key)
        return {"chord_m": "0.25", "ground_pitch_rad": "0.19"}.get(key, ANSWERS.get(key, ""))

    monkeypatch.setattr(sys.stdin, "isatty", lambda: True)
    monkeypatch.setattr("builtins.input", ask)
    assert main(["aircraft", "new", "mine.toml", "--set", "mass_kg=2"]) == 0
    assert asked == [q.key for q in questions() if q.key != "mass_kg"]
    scalars = load_measured("mine.toml").scalars
    assert (scalars["mass.mass_kg"], scalars["geometry.chord_m"]) == (2.0, 0.25)
    text = Path("mine.toml").read_text()
    assert "ground_pitch_tolerance_rad" in text and "elevator_arm_m" not in text


WRONG = [
    ({"mass_kg": ""}, "mass_kg is missing: kg, on a scale"),
    ({"mass_kg": "2 kg"}, "mass_kg is '2 kg', expected a number"),
    ({"imu_m": "1,2"}, "imu_m has 2 numbers, expected 3"),
    ({"izz_kgm2": "11.93"}, "izz"),  # of the moments one exceeds the sum of the others
    ({"wingspan": "1.2"}, "wingspan: not asked for; there are name, title"),
]


@pytest.mark.parametrize(("change", "said"), WRONG)
def test_a_wrong_answer_is_one_line_and_no_file(
    change: dict[str, str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    answers = {key: value for key, value in (ANSWERS | change).items() if value}
    assert main(["aircraft", "new", "mine.toml", *words(answers)]) == 2
    err = capsys.readouterr().err
    assert said in err and err.count("\n") == 1
    assert list(Path().iterdir()) == []


def test_a_file_that_is_there_stays(capsys: pytest.CaptureFixture[str]) -> None:
    Path("mine.toml").write_text("mine")
    assert main(["aircraft", "new", "mine.toml", *words(ANSWERS)]) == 2
    assert Path("mine.toml").read_text() == "mine"
    assert main(["aircraft", "check", "mine.toml"]) == 6
    assert capsys.readouterr().err.count("\n") == 2


def test_form_and_the_example_have_the_same_lines() -> None:
    example = (ROOT / "host/examples/mine.toml").read_text(encoding="utf-8")
    form = (ROOT / "host/src/host/aircraft/measured_form.txt").read_text(encoding="utf-8")
    keys = re.compile(r"^(?:\[(\w+)\]|(\w+) =)", re.MULTILINE)
    assert keys.findall(example) == keys.findall(form)
