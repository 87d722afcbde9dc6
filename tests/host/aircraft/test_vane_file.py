"""An aircraft file that names a vane file: its numbers count, and none stands in both."""

from __future__ import annotations

from pathlib import Path

import pytest
from host.aircraft import file as aircraft_file

REPOSITORY = Path(__file__).resolve().parents[3]
VANE = (REPOSITORY / "hw/mechanics/generated/vane.toml").read_text(encoding="utf-8")
SHIPPED = (aircraft_file.FOLDER / "ultrastick25e.toml").read_text(encoding="utf-8")
OWN = """vane_frequency_hz_per_mps = 0.8
vane_damping = 0.35
vane_friction_rad = 0.0017
"""


def write(folder: Path, sensors: str, vane: str = VANE) -> Path:
    """Return an aircraft file whose own vane lines are replaced."""
    assert OWN in SHIPPED
    path = folder / "mine.toml"
    path.write_text(SHIPPED.replace(OWN, sensors), encoding="utf-8")
    (folder / "vane.toml").write_text(vane, encoding="utf-8")
    return path


def test_vane_of_the_mechanics_is_flown_when_a_file_names_it(tmp_path: Path) -> None:
    plane = aircraft_file.load(write(tmp_path, 'vane = "vane.toml"\n'))
    assert plane.scalar("sensors.vane_frequency_hz_per_mps") == pytest.approx(0.807, abs=0.05)
    assert plane.scalar("sensors.vane_damping") < 0.2
    assert "hw/mechanics" in plane.sources["sensors.vane_damping"]


def test_shipped_aircraft_keep_their_numbers() -> None:
    assert aircraft_file.load("ultrastick25e").scalar("sensors.vane_damping") == 0.35


@pytest.mark.parametrize(
    ("sensors", "vane", "complaint"),
    [
        ('vane = "vane.toml"\n' + OWN, VANE, "vane_frequency_hz_per_mps stands there and in"),
        ('vane = "fin.toml"\n', VANE, "no vane file"),
        ("vane = 3\n", VANE, "sensors.vane is 3"),
        ('vane = "vane.toml"\n', VANE.replace("vane_damping", "damping"), "has no vane_damping"),
        ('vane = "vane.toml"\n', VANE + "vane_damping = 1\n", "vane.toml"),
        ('vane = "vane.toml"\n', VANE.replace("0.132", "-1"), "vane_damping"),
    ],
)
def test_what_is_no_vane_is_refused(
    sensors: str, vane: str, complaint: str, tmp_path: Path
) -> None:
    with pytest.raises(aircraft_file.AircraftError, match=complaint):
        aircraft_file.load(write(tmp_path, sensors, vane))
