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
