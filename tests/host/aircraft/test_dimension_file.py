"""Dimensions alone as an aircraft, and what is said of each kind."""

from pathlib import Path

import pytest
from host.aircraft import linear_aircraft
from host.aircraft.dimension_file import is_dimensions
from host.aircraft.file import AircraftError, load, load_measured, read_document
from host.aircraft.handbook import DIMENSIONS
from host.aircraft.origin import aircraft_origin
from host.cli import main
from host.export.toml import dumps

TEXT = (DIMENSIONS / "kadetlt40.toml").read_text()


def written(tmp_path: Path, *changes: tuple[str, str]) -> Path:
    text = TEXT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return path


def test_dimensions_are_the_aircraft_that_the_handbook_makes(tmp_path: Path) -> None:
    mine = written(tmp_path, ('name = "kadetlt40"\n', ""), ('title = "SIG Kadet LT-40"\n', ""))
    made, shipped = load(mine), load("kadetlt40")
    assert made.scalars == shipped.scalars
    assert made.name == "mine"
    assert load_measured(mine).scalars == made.scalars
    assert linear_aircraft.load(mine).scalars == made.scalars


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("tail_arm_m = 0.88", "", "no tail_arm_m; dimensions are those of"),
        ("tail_arm_m = 0.88", "tail_arm_m = 880.0", "tail_arm_m is 880, expected 0.001 to 100"),
        ("tail_arm_m = 0.88", 'tail_arm_m = "88 cm"', "tail_arm_m is '88 cm', expected a number"),
        ("mass_kg = 2.605", "mass_kg = 0", "mass_kg is 0, expected"),
        ("[500.0, 60.0, 0.0]", '["strong"]', "motor_power_w[0] is 'strong'"),
        ("airspeed_mps = 14.0", "airspeed_mps = nan", "airspeed_mps"),
    ],
)
def test_a_wrong_dimension_is_one_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(AircraftError) as caught:
        read_document(written(tmp_path, (old, new)))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_other_files_are_no_dimensions() -> None:
    assert not is_dimensions(read_document("ultrastick25e"))
    assert not is_dimensions({"span_m": 1.0})


def test_each_kind_says_what_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    document = dict(read_document("ultrastick25e"))
    assert "coefficients of UASLab" in aircraft_origin("ultrastick25e")
    assert "handbook estimates" in aircraft_origin(written(tmp_path))
    assert "published matrices" in aircraft_origin("ultrastick25e_linear17")
    assert load_measured("ultrastick25e_linear17").scalar("mass.mass_kg") > 1.0
    table = dict(document["aerodynamics"])  # type: ignore[call-overload]
    table["sources"] = {**table.get("sources", {}), "Cm_q": "identified, output error: -11 +- 1"}
    again = tmp_path / "again.toml"
    again.write_text(dumps({**document, "aerodynamics": table}))
    assert "1 coefficients identified from flight" in aircraft_origin(again)
    parts = ("mass", "geometry", "trim", "sensors")
    measured = {name: document[name] for name in ("format", "name", *parts)}
    own = tmp_path / "measured.toml"
    own.write_text(dumps({**measured, "kind": "measured"}))
    assert "no coefficients" in aircraft_origin(own)
    assert main(["simulate", "calm", "--firmware", "none", "--aircraft", str(own)]) == 2
    assert "a file of its dimensions" in capsys.readouterr().err


def test_a_saved_model_is_told_from_an_aircraft(tmp_path: Path) -> None:
    """It was called a file of format None."""
    model = tmp_path / "model.toml"
    model.write_text('name = "longitudinal"\nstates = ["alpha_rad"]\n')
    with pytest.raises(AircraftError, match=r"a model of one axis, no aircraft; .*--save-aircraft"):
        read_document(model)
