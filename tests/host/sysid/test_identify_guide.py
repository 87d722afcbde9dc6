"""host/IDENTIFY.md: its files are accepted as they stand."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from host.aircraft.file import AircraftError, load, load_measured, read_document
from host.aircraft.mass_properties import airframe_data
from host.aircraft.powerplant import NoPropulsionError, powerplant
from host.export.toml import dumps
from host.instrument.deviations import sensor_error_model
from host.sysid.flight import read_columns
from host.sysid.models import read_model

from tests.host.logs import ROOT

TEXT = (ROOT / "host/IDENTIFY.md").read_text(encoding="utf-8")
AIRCRAFT = (ROOT / "host/examples/mine.toml").read_text(encoding="utf-8")
MAP, MODEL, CONSTANTS, EQUATIONS = re.findall(r"```toml\n(.*?)```", TEXT, re.S)


def mine(folder: Path, text: str = AIRCRAFT) -> str:
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_a_measured_aircraft_gives_what_identification_needs(tmp_path: Path) -> None:
    airframe = airframe_data(mine(tmp_path))
    assert (airframe.mass_kg, airframe.izz_kgm2, airframe.elevator_arm_m) == (1.793, 0.1193, 0.632)
    assert airframe.imu_m == (0.02, 0.0, 0.01)
    assert sensor_error_model(mine(tmp_path)).friction_speed_mps == 17.0


def test_it_is_that_of_a_flyable_file_with_the_same_numbers(tmp_path: Path) -> None:
    document = read_document("ultrastick25e")
    for section in ("aerodynamics", "surfaces"):
        del document[section]
    less = dumps(document | {"kind": "measured"})
    assert airframe_data(mine(tmp_path, less)) == airframe_data("ultrastick25e")
    assert sensor_error_model(mine(tmp_path, less)) == sensor_error_model("ultrastick25e")
    ours, theirs = powerplant(mine(tmp_path, less)), powerplant("ultrastick25e")
    assert ours.settled_slopes(0.5, 17.0, 1.2) == theirs.settled_slopes(0.5, 17.0, 1.2)
    del document["servo"]  # usual servos then
    without = sensor_error_model(mine(tmp_path, dumps(document | {"kind": "measured"})))
    assert (without.servo_hz, without.servo) == (0.0, (8.0, 5.236))


def test_places_count_from_the_cg_wherever_it_is(tmp_path: Path) -> None:
    """What is measured from a mark on the fuselage: the same aircraft, places and CG moved."""
    here = read_document("ultrastick25e")
    there = json.loads(json.dumps(here))
    off = [0.03, -0.002, 0.01]
    there["mass"]["cg_m"] = off
    for section, names in (
        ("sensors", ("imu_m", "vane_a_m", "vane_b_m", "pitot_a_m", "pitot_b_m", "gps_m")),
        ("propulsion", ("hub_m",)),
    ):
        for name in names:
            pairs = zip(there[section][name], off, strict=True)
            there[section][name] = [place + more for place, more in pairs]
    plain, moved = mine(tmp_path, dumps(here)), tmp_path / "moved.toml"
    moved.write_text(dumps(there), encoding="utf-8")
    for of in (airframe_data, sensor_error_model):
        ours, theirs = of(str(moved)), of(plain)
        for places in ("imu_m", "vanes_m"):
            np.testing.assert_allclose(getattr(ours, places), getattr(theirs, places), atol=1e-12)
    hubs = [powerplant(source).hub_m for source in (plain, str(moved))]
    np.testing.assert_allclose(hubs[0], hubs[1], atol=1e-12)


def test_without_a_propeller_coefficients_are_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(NoPropulsionError, match=r"\[propulsion\]"):
        powerplant(mine(tmp_path))


def test_a_measured_aircraft_is_not_flown(tmp_path: Path) -> None:
    with pytest.raises(AircraftError, match="no aerodynamics"):
        load(mine(tmp_path))


@pytest.mark.parametrize(
    ("find", "put", "words"),
    [
        ("[geometry]", "[geometri]", r"section \[geometry\] is missing"),
        ("iyy_kgm2 = 0.0838", "", "mass.iyy_kgm2 is None"),
        ("chord_m = 0.253", 'chord_m = "25 cm"', "geometry.chord_m is '25 cm'"),
        ('source = "where it was flown"', "", "trim.airspeed_mps has no source"),
        ("elevator_arm_m = 0.632", 'elevator_arm_m = "long"', "elevator_arm_m is 'long'"),
        ("imu_m = [0.02, 0.0, 0.01]", "imu_m = [0.02, 0.0]", "imu_m has 2 numbers, expected 3"),
    ],
)
def test_what_is_missing_in_it_is_named(tmp_path: Path, find: str, put: str, words: str) -> None:
    with pytest.raises(AircraftError, match=words):
        load_measured(mine(tmp_path, AIRCRAFT.replace(find, put)))


def test_the_map_brings_foreign_columns_to_ours(tmp_path: Path) -> None:
    names = re.findall(r'from = "(\w+)"', MAP)
    rows = [f"{k * 10000},30,5,10,{1.0},-2" for k in range(50)]
    source, mapping = tmp_path / "theirs.csv", tmp_path / "map.toml"
    source.write_text("\n".join([",".join(names), *rows]) + "\n", encoding="utf-8")
    mapping.write_text(MAP, encoding="utf-8")
    columns, _ = read_columns(source, mapping)
    assert columns["t_s"][1] - columns["t_s"][0] == pytest.approx(0.01)
    assert columns["airspeed_mps"][0] == pytest.approx(15.4333, abs=1e-4)
    assert columns["az_mps2"][0] == pytest.approx(-9.80665)


def test_the_model_is_read(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    path.write_text(MODEL, encoding="utf-8")
    model = read_model(path)
    assert [p.name for p in model.parameters] == ["Z_alpha", "M_alpha", "M_q", "Z_de", "M_de"]


def test_the_model_with_its_constants_is_read(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    kept = [x for x in MODEL.splitlines() if not x.startswith(("state_b", "output_b", "initial_s"))]
    path.write_text(CONSTANTS + "\n".join(kept), encoding="utf-8")
    model = read_model(path)
    assert model.inputs == ("elevator_rad", "one")
    assert model.initial_states == ("q_radps",)
    assert model.known_starts == (("alpha_rad", 0.05),)
    assert model.state_biases == ("alpha_rad",)
    assert model.output_biases == ()
    assert "b_q" in [p.name for p in model.parameters]
    assert model.known_noise == (("q_radps", 0.004),)


def test_the_equations_are_read(tmp_path: Path) -> None:
    path = tmp_path / "equations.toml"
    path.write_text(EQUATIONS, encoding="utf-8")
    model = read_model(path)
    assert model.states == ("alpha_rad", "q_radps")
    assert model.inputs == ("elevator_rad", "airspeed_mps")
