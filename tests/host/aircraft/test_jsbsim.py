"""The same aircraft in JSBSim: one doublet of 1 s on each axis, 10 s, from the same trim."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from host.aircraft import file as aircraft
from host.aircraft.airframe import ELEVATOR, ROTOR, Array
from host.aircraft.attitude import euler
from host.aircraft.jsbsim_model import aircraft_xml, planet_xml
from host.aircraft.rigid_body import run
from host.aircraft.trim import solve

STEP_S = 1e-3
SIGNALS = ("u", "v", "w", "p", "q", "r", "phi", "theta")
EXCITED = {
    "elevator": ("u", "w", "q", "theta"),
    "aileron": ("v", "p", "r", "phi"),
    "rudder": ("v", "p", "r", "phi"),
}


def largest_difference(folder: Path, axis: str, changed: str = "") -> dict[str, float]:
    """Return rms difference over peak excursion of each excited signal.

    `changed` names a derivative that is switched off in JSBSim only.
    """
    plane = aircraft.load("ultrastick25e")
    frame = plane.airframe()
    trim = solve(frame, 17.0)
    steps = round(10.0 / STEP_S)
    commands = np.tile(trim.command, (steps, 1))
    k = ("elevator", "aileron", "rudder").index(axis)
    amplitude = {"elevator": 0.04, "aileron": 0.05, "rudder": 0.06}[axis]
    commands[1000:1500, k] += amplitude
    commands[1500:2000, k] -= amplitude
    ours, _ = run(frame, trim.state, commands, np.zeros(9), trim.density_kgpm3, STEP_S)

    if changed:
        plane.vectors[f"aerodynamics.{changed}"][:] = 0.0
    model = folder / "aircraft" / plane.name
    model.mkdir(parents=True)
    (model / f"{plane.name}.xml").write_text(aircraft_xml(plane, float(trim.state[ROTOR])))
    (folder / "planet.xml").write_text(planet_xml())
    surfaces = ours[:, ELEVATOR : ELEVATOR + 3]
    np.savez(
        folder / "input.npz",
        name=plane.name,
        start=trim.state,
        angles=np.array(euler(trim.state[6:10])),
        # JSBSim holds a surface over its step: the middle of each step is given.
        surfaces=0.5 * (surfaces[1:] + surfaces[:-1]),
        throttle=trim.command[3],
        density_kgpm3=trim.density_kgpm3,
        step_s=STEP_S,
    )
    script = Path(__file__).with_name("jsbsim_run.py")
    subprocess.run(
        [sys.executable, str(script), str(folder)], check=True, timeout=600, capture_output=True
    )
    peer = np.load(folder / "output.npz")["states"]
    phi, theta, _ = euler(ours[:-1, 6:10])
    mine = np.column_stack([ours[:-1, :6], phi, theta])
    return compare(mine, peer[:, :8], EXCITED[axis])


def compare(mine: Array, peer: Array, signals: tuple[str, ...]) -> dict[str, float]:
    """Return rms difference over peak excursion from the start, per signal."""
    out = {}
    for name in signals:
        k = SIGNALS.index(name)
        peak = np.abs(mine[:, k] - mine[0, k]).max()
        out[name] = float(np.sqrt(np.mean((mine[:, k] - peer[:, k]) ** 2)) / peak)
    return out


@pytest.mark.parametrize("axis", ["elevator", "aileron", "rudder"])
def test_doublet_agrees_with_jsbsim(axis: str, tmp_path: Path) -> None:
    difference = largest_difference(tmp_path, axis)
    assert max(difference.values()) < 0.01, difference


@pytest.mark.parametrize(
    ("axis", "changed"), [("elevator", "cl_q"), ("aileron", "cn_p"), ("rudder", "croll_r")]
)
def test_a_derivative_switched_off_is_seen(axis: str, changed: str, tmp_path: Path) -> None:
    assert max(largest_difference(tmp_path, axis, changed).values()) > 0.01
