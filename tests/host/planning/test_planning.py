"""Plans: the designed card reaches its excursions, and its bounds mean what they say."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path

import numpy as np
import pytest
from host.aircraft.file import load
from host.aircraft.linearisation import linearise
from host.aircraft.trim import solve
from host.cli import main
from host.export.toml import dumps
from host.planning import card_design
from host.planning import card_planning as planning
from host.twin.testcard import cards
from host.twin.testcard.cards import parse


@pytest.fixture(scope="module")
def plan() -> planning.Plan:
    return planning.judge(card_design.design("ultrastick25e"))


def test_designed_inputs_reach_the_wanted_excursions(plan: planning.Plan) -> None:
    assert len(plan.points) == 12
    for point in plan.points:
        reached = {
            "elevator": point.alpha_deg / card_design.TARGET_EXCURSIONS["alpha_deg"],
            "rudder": point.beta_deg / card_design.TARGET_EXCURSIONS["beta_deg"],
            "aileron": point.bank_deg / card_design.TARGET_EXCURSIONS["bank_deg"],
        }[point.axes[0]]
        assert 0.75 < reached < 1.25, point
        assert point.width_s >= 0.2


def test_predicted_derivatives_are_those_of_the_prior_model(plan: planning.Plan) -> None:
    frame = load("ultrastick25e").airframe()
    trim = solve(frame, 17.0, density_kgpm3=1.2133)
    linear = linearise(frame, trim)
    speed = trim.airspeed_mps
    found = {bound.name: bound.value for bound in plan.bounds}
    # dw = V d(alpha): moments per alpha are V times those per w. An elevator 3-2-1-1 of 5 deg gains
    # 1.1 m/s, 7 % of dynamic pressure on average: a linear model sees its mean.
    assert found["M_alpha"] == pytest.approx(linear.longitudinal_a[2, 1] * speed, rel=0.10)
    assert found["M_de"] == pytest.approx(linear.longitudinal_b[2, 0], rel=0.10)
    assert found["L_p"] == pytest.approx(linear.lateral_a[1, 1], rel=0.03)
    assert found["N_beta"] == pytest.approx(linear.lateral_a[2, 0] * speed, rel=0.04)
    assert found["L_da"] == pytest.approx(linear.lateral_b[1, 0], rel=0.03)


def test_bounds_shrink_with_amplitude_and_a_missing_axis_is_refused() -> None:
    def judged(amplitude: float) -> planning.Plan:
        return planning.judge(
            parse(
                {
                    "format": 1,
                    "aircraft": "ultrastick25e",
                    "segment": [
                        {"kind": "trim", "duration_s": 3},
                        {"kind": "3211", "axis": "elevator", "amplitude": amplitude,
                         "width_s": 0.25},
                    ],
                },
                "card",
            )
        )  # fmt: skip

    small, large = judged(1.0), judged(2.0)
    ratio = [
        one.half_width / two.half_width
        for one, two in zip(small.bounds, large.bounds, strict=True)
        if one.name in ("M_alpha", "M_q", "M_de")
    ]
    assert np.mean(ratio) == pytest.approx(2.0, rel=0.25)
    assert small.refused == ["lateral: no input on aileron, rudder, its derivatives stay unknown"]


def test_designed_card_comes_back_from_its_file(tmp_path: Path) -> None:
    card = card_design.design("kadetlt40")
    path = tmp_path / "card.toml"
    path.write_text(dumps(card_design.document(card)))
    assert cards.load(path).segments == card.segments


def test_command_prints_the_card_and_its_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "card.toml"
    quick = ["--flights", "0"]
    assert main(["plan", "--aircraft", "lowsupertrainer", "--save", str(path), *quick]) == 0
    text = capsys.readouterr().out
    assert "3x 3211 elevator" in text
    assert "M_alpha" in text
    assert main(["plan", str(path), "--json", "--flights", "0"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["aircraft"] == "lowsupertrainer"
    assert {"M_q", "N_beta"} <= {bound["name"] for bound in answer["bounds"]}
    assert main(["plan", "demo", "--save", str(path)]) == 2
    assert "leave the card's name out" in capsys.readouterr().err


def test_command_hears_another_aircraft_and_keeps_unlike_inputs_apart(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    document: dict[str, object] = {
        "format": 1,
        "aircraft": "ultrastick25e",
        "segment": [
            {"kind": "doublet", "axis": "elevator", "amplitude": 2.0, "width_s": width_s}
            for width_s in (0.3, 0.3, 0.5)
        ],
    }
    path = tmp_path / "card.toml"
    path.write_text(dumps(document))
    options = ["--aircraft", "kadetlt40", "--airspeed", "15", "--flights", "0"]
    assert main(["plan", str(path), *options]) == 0
    text = capsys.readouterr().out
    assert "Kadet LT-40" in text
    assert "2x doublet elevator" in text
    assert "1x doublet elevator" in text
    assert main(["plan", "demo", "--airspeed", "-4"]) == 2
    assert "--airspeed is -4 m/s, expected 0.5 to 2000 m/s" in capsys.readouterr().err


def test_a_full_disk_names_the_folder_of_the_flight(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("host.twin.outcome.truth_files.np.savez", full)
    arguments = ["simulate", "calm", "-o", str(tmp_path), "--firmware", "none", "--no-picture"]
    assert main(arguments) == 2
    error = capsys.readouterr().err.strip()
    assert error.endswith(
        f"{tmp_path}: not all files of the flight were written: No space left on device"
    )
    assert len(error.splitlines()) == 1


def test_simulate_command_lists_flies_and_refuses(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["simulate"]) == 0
    assert "thesis_flight2" in capsys.readouterr().out
    arguments = ["simulate", "calm", "-o", str(tmp_path), "--firmware", "none", "--json"]
    assert main([*arguments, "--both"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["maneuvers"] == 4
    for name in ("flight.csv", "flight.truth.npz", "flight.truth.toml", "flight.thesis.txt",
                 "calibration.toml"):  # fmt: skip
        assert (tmp_path / name).stat().st_size > 500, name
    assert (tmp_path / "flight.png").read_bytes().startswith(b"\x89PNG")
    assert main(["simulate", "nowhere"]) == 2
    assert "expected a file or one of" in capsys.readouterr().err
    monkeypatch.setenv("HOST_SITL", str(tmp_path / "no.so"))
    assert main(["simulate", "calm", "-o", str(tmp_path)]) == 2
    assert "it names the recorder's library" in capsys.readouterr().err
    monkeypatch.setenv("HOST_ELF", str(tmp_path / "no.elf"))
    assert main(["simulate", "calm", "--firmware", "avr", "-o", str(tmp_path)]) == 2
    assert "--firmware avr needs `pio run`" in capsys.readouterr().err
