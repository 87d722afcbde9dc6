"""`host convert`: derivatives to coefficients and back, from what people have."""

import json
from pathlib import Path
from typing import Any

import pytest
from host.aircraft.mass_properties import airframe_data
from host.cli import main

NAME = "ultrastick25e"
SPEED, DENSITY = 16.0, 1.2
OWN = """[coefficients]
CL_alpha = [4.1, 0.2]
CD_alpha = 0.1
Cm_alpha = -1.6
Cm_q = [-11.0, 0.5]
CY_beta = -0.1
Cl_p = -0.4
Cn_p = -0.03
CD_0 = 0.03
"""
MODEL = """name = "short-period"
states = ["alpha_rad", "q_radps"]
inputs = ["elevator_rad"]
outputs = ["alpha_rad", "q_radps"]
A = [["Z_alpha", 1.0], ["M_alpha", "M_q"]]
B = [["Z_de"], ["M_de"]]
C = [[1, 0], [0, 1]]
D = [[0], [0]]
[parameters]
Z_alpha = { start = -7.0 }
M_q = { start = -13.0 }
[fit]
method = "by hand"
M_q = [-13.0, 0.9]
[trim]
airspeed_mps = 18.0
alpha_rad = 0.1
theta_rad = 0.1
"""


def converted(path: Path, capsys: pytest.CaptureFixture[str], *options: str) -> dict[str, Any]:
    assert main(["convert", str(path), "--aircraft", NAME, *options, "--json"]) == 0
    answer: dict[str, Any] = json.loads(capsys.readouterr().out)
    return answer


def test_there_and_back_by_the_equations_of_motion(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "own.toml"
    path.write_text(OWN)
    at = ("--airspeed", str(SPEED), "--density", str(DENSITY), "--alpha", "4")
    there = converted(path, capsys, *at)
    a, force = airframe_data(NAME), 0.5 * DENSITY * SPEED**2 * airframe_data(NAME).wing_area_m2
    found = there["converted"]
    assert found["Z_alpha"]["value"] == pytest.approx(-force * 4.1 / (a.mass_kg * SPEED))
    hat = 0.5 * a.chord_m / SPEED
    assert found["M_q"]["value"] == pytest.approx(-force * a.chord_m * 11.0 * hat / a.iyy_kgm2)
    path.write_text(OWN.replace("[-11.0, 0.5]", "-11.0"))
    alone = converted(path, capsys, *at)["converted"]["M_q"]
    own = found["M_q"]["half_width"] ** 2 - alone["half_width"] ** 2
    assert own == pytest.approx((found["M_q"]["value"] * 0.5 / 11.0) ** 2, rel=0.02)
    assert found["L_p"]["half_width"] > abs(found["L_p"]["value"]) * 1.96 * a.inertia_share
    assert found["L_p"]["widened_by"] == "Ixx"
    assert found["M_alpha"]["widened_by"] == "place of the CG along x"
    assert there["left_out"] == ["CD_0"]
    lines = [f"{n} = {x['value']!r}" for n, x in found.items()]
    path.write_text("\n".join(["[derivatives]", *lines]))
    back = converted(path, capsys, *at)
    assert back["to"] == "coefficients"
    for name, given in there["given"].items():
        assert back["converted"][name]["value"] == pytest.approx(given["value"], rel=1e-9), name


def test_a_saved_model_knows_its_flight(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "model.toml"
    path.write_text(MODEL)
    answer = converted(path, capsys)
    assert (answer["airspeed_mps"], answer["alpha_rad"]) == (18.0, 0.1)
    assert answer["given"]["M_q"] == {"value": -13.0, "half_width": 0.9}
    assert answer["given"]["Z_alpha"]["half_width"] == 0.0
    wide = answer["converted"]["Cm_q"]
    assert wide["half_width"] > abs(wide["value"]) * 0.9 / 13.0
    faster = converted(path, capsys, "--airspeed", "20")
    assert faster["converted"]["Cm_q"]["value"] == pytest.approx(wide["value"] * 18.0 / 20.0)
    assert main(["convert", str(path), "--aircraft", NAME]) == 0
    words = capsys.readouterr().out
    assert "derivatives to coefficients of Ultra Stick 25e at 18.00 m/s, alpha 5.7 deg" in words
    assert "M_q" in words
    assert "1/s " in words


def test_a_table_is_read_at_the_angle_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "table.toml"
    path.write_text("alpha_deg = [0.0, 10.0]\n[coefficients]\nCm_alpha = [-1.0, -2.0]\n")
    answer = converted(path, capsys, "--alpha", "5")
    assert answer["given"]["Cm_alpha"]["value"] == pytest.approx(-1.5)
    assert answer["airspeed_mps"] == 17.0  # of the aircraft file


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\xff\xfe\x00", "not TOML"),
        (b"[rows]\nCL = 1\n", "nothing to convert; expected a model of host identify"),
        (b"[coefficients]\nCL_alpha = 'steep'\n", "CL_alpha is 'steep', expected a number or"),
        (b"[coefficients]\nCL_alpha = [4.1, -1]\n", "CL_alpha: half-width is -1, expected 0 to"),
        (b"[coefficients]\nCL_0 = 0.1\n", "nothing to convert"),
        (b"[coefficients]\nCL_alpha = 4\n[derivatives]\nM_q = -3\n", "expected one kind"),
        (b"derivatives = 3\n", "expected lines such as M_q"),
    ],
)
def test_what_cannot_be_converted_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: bytes, message: str
) -> None:
    path = tmp_path / "own.toml"
    path.write_bytes(content)
    assert main(["convert", str(path), "--aircraft", NAME]) == 2
    printed = capsys.readouterr().err
    assert message in printed
    assert printed.count("\n") == 1


@pytest.mark.parametrize("option", [("--airspeed", "-3"), ("--density", "nan"), ("--alpha", "90")])
def test_a_flight_that_cannot_be_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], option: tuple[str, str]
) -> None:
    path = tmp_path / "own.toml"
    path.write_text(OWN)
    assert main(["convert", str(path), "--aircraft", NAME, *option]) == 2
    assert f"{option[0]} is {option[1]}" in capsys.readouterr().err
