"""The vane's motion from its geometry, on committed text; the bodies themselves: campaign."""

from __future__ import annotations

import math
import re
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from host.twin.sensors import filters

from tests.hw.test_pin_map import load_module

MECHANICS = Path(__file__).resolve().parents[2] / "hw" / "mechanics"
MASSES = (MECHANICS / "generated" / "masses.csv").read_text(encoding="utf-8")
SIZES = (MECHANICS / "vane.toml").read_text(encoding="utf-8")
DYNAMICS: ModuleType = load_module("mechanics/dynamics")
SOURCES: ModuleType = load_module("mechanics/sources")
STACK = (MECHANICS / "generated" / "stack.csv").read_text(encoding="utf-8")
FIN = DYNAMICS.load(SIZES, MASSES)


def test_masses_and_vane_file_are_those_of_the_committed_sources() -> None:
    assert DYNAMICS.sources_hash() in MASSES.splitlines()[0], "run hw/mechanics/make_parts.py"
    made = (MECHANICS / "generated" / "vane.toml").read_text(encoding="utf-8")
    assert made == DYNAMICS.vane_file(FIN)


def test_vane_follows_a_step_as_the_twin_says() -> None:
    # The equation of motion integrated from mass, area and arm against the twin's filter.
    speed, step_s, n = 17.0, 1e-3, 400
    pressure = 0.5 * DYNAMICS.RHO_KGPM3 * speed**2
    moment = pressure * FIN.stiffness_Nm_per_Pa
    target = np.full(n, 0.1)
    target[0] = 0.0
    angle = rate = 0.0
    physical = []
    for _ in range(n):
        physical.append(angle)
        for _ in range(200):
            turning = moment * (0.1 - angle - FIN.arm_m * rate / speed) / FIN.inertia_kgm2
            rate += step_s / 200 * turning
            angle += step_s / 200 * rate
    twin = filters.vane(
        target, np.full(n, speed), FIN.frequency_hz_per_mps, FIN.damping, 0.0, 17.0, step_s
    )
    # The twin lets the flow turn within its first step: half a step earlier or later at most.
    fastest = np.abs(np.gradient(np.array(physical), step_s)).max()
    assert np.abs(np.array(physical) - twin).max() < fastest * 1.1 * step_s


def test_friction_holds_less_the_faster_the_flow() -> None:
    assert FIN.friction_rad(8.0) / FIN.friction_rad(16.0) == pytest.approx(4.0)


def test_balance_left_over_is_below_the_friction() -> None:
    (left,) = re.findall(r"residual_Nm=(\S+)", MASSES)
    assert float(left) < FIN.friction_newton_m


def test_pages_state_the_difference_to_the_shipped_aircraft() -> None:
    said = (MECHANICS / "README.md").read_text(encoding="utf-8")
    assert f"{FIN.frequency_hz_per_mps:.2f} Hz per m/s" in said
    assert f"damping {FIN.damping:.2f}" in said
    assert f"{math.degrees(FIN.friction_rad(17.0)):.2f} deg at 17 m/s" in said
    airframes = MECHANICS.parents[1] / "host/src/host/aircraft/airframes"
    for path in airframes.glob("*.toml"):
        text = path.read_text(encoding="utf-8")
        if "vane_damping" in text:
            assert f"vane_damping = {DYNAMICS.SHIPPED['damping']}" in text


def test_every_body_has_its_files() -> None:
    rows = DYNAMICS.masses(MASSES)
    for row in rows:
        if row["file"]:
            stem = row["file"].removesuffix(".step")
            assert (MECHANICS / "generated/step" / row["file"]).exists(), stem
            assert (MECHANICS / "generated/drawings" / f"{stem}.svg").exists(), stem
            printed = (MECHANICS / "generated/stl" / f"{stem}.stl").exists()
            assert printed == (row["material"] == "petg"), stem


def test_stack_is_that_of_the_committed_board_and_sizes() -> None:
    assert STACK.splitlines()[0].endswith(SOURCES.hash_of(SOURCES.STACK)), "run make_parts.py"


def test_room_is_left_around_mega_and_shield() -> None:
    left = dict(re.findall(r"^left (.+),(\S+)$", STACK, re.M))
    assert set(left) >= {"below the lid", "left", "right", "front", "back", "under the Mega"}
    assert min(map(float, left.values())) >= 1.0
    page = " ".join((MECHANICS.parent / "build.md").read_text(encoding="utf-8").split())
    assert f"{float(left['left']):.2f} mm from USB shell to wall" in page
    assert f"{float(left['below the lid']):.1f} mm below the lid" in page


def test_boards_name_solids_that_are_there() -> None:
    boards = MECHANICS.parent / "board"
    for path in (boards / "logger.kicad_pcb", *sorted((boards / "sensors").glob("*.kicad_pcb"))):
        models = re.findall(r'\(model "\$\{KIPRJMOD\}/([^"]+)"', path.read_text(encoding="utf-8"))
        assert models, path.name
        assert {m for m in set(models) if not (path.parent / m).exists()} == set(), path.name
        assert "3DMODEL_DIR" not in path.read_text(encoding="utf-8")
