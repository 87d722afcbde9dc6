"""Aircraft files: complete, sourced, and refused in one line when not."""

from __future__ import annotations

from pathlib import Path

import pytest
from host.aircraft import file as aircraft


@pytest.mark.parametrize("name", ["ultrastick25e", "kadetlt40", "lowsupertrainer"])
def test_every_number_has_a_source(name: str) -> None:
    plane = aircraft.load(name)
    assert plane.name == name
    assert set(plane.sources) == set(plane.scalars) | set(plane.vectors)
    assert all(len(text) >= 8 for text in plane.sources.values())


@pytest.mark.parametrize("name", ["ultrastick25e", "kadetlt40", "lowsupertrainer"])
def test_signs_are_those_of_the_house(name: str) -> None:
    plane = aircraft.load(name)

    def sign(key: str) -> set[bool]:
        return set((plane.vector(f"aerodynamics.{key}") > 0).tolist())

    assert sign("cm_elevator") == sign("cn_rudder") == sign("cm_alpha") == {False}
    assert sign("croll_aileron") == sign("cn_beta") == sign("cl_alpha") == {True}


@pytest.mark.parametrize(
    ("found", "replaced", "message"),
    [
        ("mass_kg = 1.793\n", "", r"mass\.mass_kg is None, expected a number"),
        ("mass_kg = 1.793", 'mass_kg = "heavy"', r"mass\.mass_kg is 'heavy', expected a number"),
        ("cl_0 = [0.0016, 0.0033]", "cl_0 = [0.0016]", "has 1 values, expected 2"),
        ("format = 1", "format = 9", "format is 9, expected 1"),
        ("[servo]", "[servos]", r"section \[servo\] is missing"),
        ('source = "UASLab OpenFlight actuator model: 25 deg"', "", "has no source"),
        ("alpha_rad = [0.08", "alpha_rad = [0.98", "must increase"),
        ("cl_0 = [0.0016, 0.0033]", "cl_0 = [0.0016, nan]", r"cl_0\[1\] is nan, expected a number"),
        ("cg_m = [0.0, 0.0, 0.0]", "cg_m = [0.0, 0.0]", "mass.cg_m has 2 numbers, expected 3"),
    ],
)
def test_broken_files_say_what_is_wrong(
    tmp_path: Path, found: str, replaced: str, message: str
) -> None:
    text = (aircraft.FOLDER / "ultrastick25e.toml").read_text()
    assert found in text
    path = tmp_path / "broken.toml"
    path.write_text(text.replace(found, replaced))
    with pytest.raises(aircraft.AircraftError, match=message):
        aircraft.load(path)


def test_unknown_aircraft_lists_the_known_ones() -> None:
    with pytest.raises(aircraft.AircraftError, match=r"expected a file or one of .*ultrastick25e"):
        aircraft.load("spitfire")
