"""The bodies in CAD: fits, balance, limiter, walls; each kind of fault planted once."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

MECHANICS = Path(__file__).resolve().parents[3] / "hw" / "mechanics"
sys.path.insert(0, str(MECHANICS))

import make_parts  # noqa: E402
import solids  # noqa: E402
import stack  # noqa: E402
from sources import SHIELD  # noqa: E402


def test_bodies_fit_and_committed_masses_are_current() -> None:
    command = [sys.executable, str(MECHANICS / "make_parts.py"), "--check"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("group", "name", "value", "complaint"),
    [
        ("fin", "leading_edge", 30.0, "fin and housing share"),
        ("counterweight", "step", 5.0, "balance"),
        ("magnet", "air_gap", 4.0, "air gap 4.0 mm"),
        ("housing", "collar", 8.0, "bearing seat: wall"),
        ("pitot", "beside_vane", 16.0, "pitot 16 mm beside a vane"),
    ],
)
def test_a_planted_fault_is_found(group: str, name: str, value: float, complaint: str) -> None:
    sizes = solids.load_sizes()
    sizes[group][name] = value
    assert complaint in "\n".join(make_parts.faults(sizes, solids.vane(sizes), []))


def test_a_limiter_in_the_wrong_place_is_found() -> None:
    sizes = solids.load_sizes()
    vane = solids.vane(sizes)
    sizes["housing"]["limit_deg"] = 50.0
    assert "limiter: at 53 deg the hub passes" in "\n".join(make_parts.faults(sizes, vane, []))


@pytest.mark.parametrize(
    ("group", "name", "value", "complaint"),
    [
        ("box", "usb_z", 12.0, "box and USB plug share"),
        ("box", "mega_y", 27.0, "share"),  # the nuts of the glands stand in the sensor plugs
        ("box", "height", 40.0, "box lid"),
        ("box", "boss", 1.0, "Mega's leads and box share"),
    ],
)
def test_a_box_that_does_not_fit_is_found(
    group: str, name: str, value: float, complaint: str
) -> None:
    sizes = solids.load_sizes()
    sizes[group][name] = value
    bodies = stack.everything(sizes, SHIELD.read_text(encoding="utf-8"))
    assert complaint in "\n".join(stack.faults(bodies))


def test_a_part_moved_into_another_is_found() -> None:
    # Relay K1 at K2's place; a plug's wire above the Mega's USB shell.
    text = SHIELD.read_text(encoding="utf-8")
    moved = text.replace("(at 77.5 63)", "(at 90.5 63)").replace("(at 77 110.8)", "(at 63 84)")
    assert moved.count("(at 90.5 63)") == 1
    said = "\n".join(stack.faults(stack.everything(solids.load_sizes(), moved)))
    assert "K1 and K2 share" in said or "K2 and K1 share" in said
    assert "USB shell" in said


def test_a_jig_in_the_vanes_way_is_found() -> None:
    sizes = solids.load_sizes()
    sizes["protractor"]["below_fin"] = -6.0
    vane = solids.vane(sizes)
    said = "\n".join(make_parts.jig_faults(sizes, vane, solids.jigs(sizes)))
    assert "protractor jig and fin share" in said
