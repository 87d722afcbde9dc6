"""Each simulator's form, read by that simulator's published formula, against ours at 50 points.

Formulas: gz-sim's AdvancedLiftDrag.cc, ArduPilot's SIM_Plane.cpp, AVL's documentation of ST; JSBSim
runs itself, python-control too, AeroSandbox's file runs on numpy, whose names it takes.
"""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
import types
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from host.aircraft.airframe import Airframe
from host.aircraft.file import load
from host.aircraft.local_derivatives import coefficients
from host.errors import IdentificationError
from host.sysid.aerodynamics import Coefficient, CoefficientTable
from host.sysid.answer import OutputPaths, check_outputs
from host.sysid.answer.aircraft_export import save_aircraft
from host.sysid.answer.simulator_forms import write_form

from tests.host.sysid.answer.jsbsim_air import JSBSIM_AIR

ROWS = ("CL", "CD", "CY", "Cl", "Cm", "Cn")
VALUES = {
    "longitudinal": {"CL_alpha": 4.2, "Cm_alpha": -1.4, "Cm_q": -11.0, "CL_q": 8.0, "Cm_de": -1.3,
                     "CL_de": 0.5},
    "lateral": {"CY_beta": -0.3, "Cl_beta": -0.05, "Cl_p": -0.37, "Cl_r": 0.09, "Cl_da": 0.21,
                "Cn_beta": 0.056, "Cn_p": -0.03, "Cn_r": -0.064, "Cn_dr": -0.049},
}  # fmt: skip
SPEED_MPS, DENSITY = 17.0, 1.225
# At 2.5 deg of sideslip, 0.6 deg about the trim's alpha: of the range of each coefficient.
LIMIT = 0.03


@dataclass
class Known:
    """The identified aircraft, the points, and our coefficients there, (50, 6)."""

    tables: list[CoefficientTable]
    frame: Airframe
    points: np.ndarray
    ours: np.ndarray

    def same(self, theirs: np.ndarray, limit: float = LIMIT) -> None:
        spread = np.ptp(self.ours, axis=0)
        error = np.max(np.abs(theirs - self.ours), axis=0) / spread
        assert (error < limit).all(), dict(zip(ROWS, error, strict=True))


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> Known:
    tables = [
        CoefficientTable(
            name, "by hand", 0.1,
            tuple(Coefficient(n, v, 0.01 * abs(v), 0.02 * abs(v)) for n, v in values.items()),
        )
        for name, values in VALUES.items()
    ]  # fmt: skip
    path = tmp_path_factory.mktemp("forms") / "again.toml"
    save_aircraft(path, tables, "ultrastick25e")
    frame = load(path).airframe()
    rng = np.random.default_rng(11)
    low = np.array([0.09, -0.044, -0.04, -0.006, -0.02, -0.25, -0.2, -0.2])
    points = rng.uniform(low, np.where(low > 0.0, 0.11, -low), (50, 8))
    points[:, 5] -= 0.05
    return Known(tables, frame, points, np.array([coefficients(frame, p) for p in points]))


def _text(known: Known, name: str, folder: Path) -> str:
    path = folder / name
    assert write_form(path, known.tables, [], "ultrastick25e", None)[0] == path
    text = path.read_text(encoding="utf-8")
    assert "cm_q: identified, by hand: -11 +- 0.22 (95 %)" in text
    assert "Straight lines about alpha 5.73 deg" in text or name.endswith(".xml")
    return text


def _velocity(point: np.ndarray) -> tuple[float, float, float]:
    alpha, beta = point[:2]
    along = SPEED_MPS * math.cos(beta)
    return along * math.cos(alpha), SPEED_MPS * math.sin(beta), along * math.sin(alpha)


def _of_body(x: float, y: float, z: float, alpha: float) -> tuple[float, float, float]:
    """Return lift, drag, side of force coefficients in body axes."""
    return x * math.sin(alpha) - z * math.cos(alpha), -x * math.cos(alpha) - z * math.sin(alpha), y


def test_gazebo(known: Known, tmp_path: Path) -> None:
    """AdvancedLiftDrag, as its documentation has Cem: Cem0 + Cema alpha + Cemb beta."""
    text = _text(known, "mine.sdf", tmp_path)
    plugin = ElementTree.fromstring(text)
    v = {e.tag: float(e.text or 0) for e in plugin if re.fullmatch(r"[-\d.e]+", e.text or "")}
    surfaces = [{e.tag: e.text or "" for e in c} for c in plugin.iter("control_surface")]
    assert [s["name"] for s in surfaces] == ["elevator_joint", "aileron_joint", "rudder_joint"]
    assert "Cem = this->Cemb * this->beta" in text
    span, M, stall = math.sqrt(v["area"] * v["AR"]), 15.0, v["alpha_stall"]
    found = []
    for point in known.points:
        u, y, w = _velocity(point)
        alpha, beta, plane = math.atan2(w, u), math.atan2(y, u), math.hypot(u, w)
        rates = point[2:5] * 2.0 * SPEED_MPS / [span, v["mac"], span]
        hats = dict(zip("pqr", rates * [span, v["mac"], span] / (2.0 * plane), strict=True))
        control = {
            row: sum(math.degrees(d) * float(s[f"{row}_ctrl"]) * float(s["direction"])
                     for d, s in zip(point[5:], surfaces, strict=True))
            for row in ("CL", "CD", "CY", "Cell", "Cem", "Cen")
        }  # fmt: skip
        up, down = math.exp(-M * (alpha - stall)), math.exp(M * (alpha + stall))
        sigma = (1 + up + down) / ((1 + up) * (1 + down))
        flat = 2 * math.copysign(1, alpha) * math.sin(alpha) ** 2 * math.cos(alpha)
        lift = (1 - sigma) * (v["CL0"] + v["CLa"] * alpha) + sigma * flat
        lift += v["CLb"] * beta + control["CL"]
        drag = (1 - sigma) * (v["CD0"] + lift**2 / (math.pi * v["AR"] * v["eff"])) + control["CD"]
        c = {"CL": lift, "CD": drag}
        for row in ("CY", "Cell", "Cen"):
            c[row] = v[f"{row}a"] * alpha + v[f"{row}b"] * beta + control[row]
        c["Cem"] = v["Cem0"] + v["Cema"] * alpha + v["Cemb"] * beta + control["Cem"]
        for row in c:
            c[row] += sum(v[f"{row}{x}"] * hats[x] for x in "pqr")
        pressure = (plane / SPEED_MPS) ** 2
        sizes = dict.fromkeys(("Cell", "Cen"), span / known.frame.span_m)
        sizes["Cem"] = v["mac"] / known.frame.chord_m
        found.append([c[r] * pressure * sizes.get(r, 1.0) * v["area"] / known.frame.wing_area_m2
                      for r in ("CL", "CD", "CY", "Cell", "Cem", "Cen")])  # fmt: skip
    known.same(np.array(found))


def test_ardupilot_sitl(known: Known, tmp_path: Path) -> None:
    """SIM_Plane.cpp: getForce as a force, getTorque as an angular acceleration."""
    text = _text(known, "SIM_Plane_mine.h", tmp_path)
    k = {n: float(x) for n, x in re.findall(r"float (\w+) = ([-\d.e]+)f;", text)}
    f, limit = known.frame, known.frame.surface_limit_rad
    found = []
    for point in known.points:
        u, v, w = _velocity(point)
        alpha, beta = math.atan2(w, u), math.atan2(v, u)
        speed, rho = SPEED_MPS, DENSITY
        p, q, r = point[2:5] * 2.0 * speed / [f.span_m, f.chord_m, f.span_m]
        elevator, aileron, rudder = -point[5] / limit[0], point[6] / limit[1], -point[7] / limit[2]
        M, stall = k["mcoeff"], k["alpha_stall"]
        up, down = math.exp(-M * (alpha - stall)), math.exp(M * (alpha + stall))
        sigma = (1 + up + down) / (1 + up) / (1 + down)
        flat = 2 * math.copysign(1, alpha) * math.sin(alpha) ** 2 * math.cos(alpha)
        line = k["c_lift_0"] + k["c_lift_a"] * alpha
        lift = (1 - sigma) * line + sigma * flat
        drag = k["c_drag_p"] + line**2 / (math.pi * k["oswald"] * k["b"] ** 2 / k["s"])
        sin, cos, c2v, b2v = (
            math.sin(alpha),
            math.cos(alpha),
            k["c"] / 2 / speed,
            k["b"] / 2 / speed,
        )
        x = -drag * cos + lift * sin + (-k["c_drag_q"] * cos + k["c_lift_q"] * sin) * c2v * q
        x += k["c_lift_deltae"] * sin * elevator - k["c_drag_deltae"] * cos * abs(elevator)
        z = -drag * sin - lift * cos + (-k["c_drag_q"] * sin - k["c_lift_q"] * cos) * c2v * q
        z += -k["c_lift_deltae"] * cos * elevator - k["c_drag_deltae"] * sin * abs(elevator)
        side, roll, yaw = (
            k[f"c_{n}_0"] + k[f"c_{n}_b"] * beta + k[f"c_{n}_p"] * b2v * p + k[f"c_{n}_r"] * b2v * r
            + k[f"c_{n}_deltaa"] * aileron + k[f"c_{n}_deltar"] * rudder
            for n in "yln"
        )  # fmt: skip
        pitch = k["c_m_0"] + k["c_m_a"] * alpha + k["c_m_q"] * c2v * q
        pitch += k["c_m_deltae"] * elevator
        qbar = 0.5 * rho * speed**2 * k["s"]
        # Accelerations as moments of the aircraft's own inertia.
        turn = np.array([qbar * k["b"] * roll, qbar * k["c"] * pitch, qbar * k["b"] * yaw])
        inertia = np.array([[f.ixx_kgm2, 0, -f.ixz_kgm2], [0, f.iyy_kgm2, 0],
                            [-f.ixz_kgm2, 0, f.izz_kgm2]])  # fmt: skip
        moment = inertia @ turn / (qbar * np.array([f.span_m, f.chord_m, f.span_m]))
        CL, CD, CY = _of_body(x, side, z, point[0])
        found.append([CL, CD, CY, *moment])
    theirs = np.array(found)
    trim = known.points.copy()
    drags = theirs[:, 1].copy()
    theirs[:, 1] = known.ours[:, 1]
    known.same(theirs)
    # Drag has no lift of the elevator in it: said at the head; 0.008 at 0.2 rad off the trim.
    assert np.max(np.abs(drags - known.ours[:, 1])) < 0.05 * np.max(np.abs(trim[:, 5] + 0.12))
    assert "c_drag_p makes it right at the trim's elevator" in text


def test_avl_table(known: Known, tmp_path: Path) -> None:
    """Stability axes and degrees, read by their names alone."""
    text = _text(known, "mine.st", tmp_path)
    k = {n: float(x) for n, x in re.findall(r"(C[LYlmn](?:[abpqr]|d\d)) = +([-\d.]+)", text)}
    assert len(k) == 40
    tot = {n: float(x) for n, x in re.findall(r"(C\wtot|Alpha|elevator) = +([-\d.]+)", text)}
    a0 = math.radians(tot["Alpha"])
    sin, cos = math.sin(a0), math.cos(a0)
    found = []
    for point in known.points:
        alpha, beta, p, q, r, *surfaces = point
        turned = p * cos + r * sin, q, -p * sin + r * cos
        degrees = np.degrees(surfaces) - [tot["elevator"], 0.0, 0.0]
        c = {}
        for row in ("CL", "CY", "Cl", "Cm", "Cn"):
            c[row] = k[f"{row}a"] * (alpha - a0) + k[f"{row}b"] * beta
            c[row] += sum(k[f"{row}{x}"] * y for x, y in zip("pqr", turned, strict=True))
            c[row] += sum(k[f"{row}d{n}"] * d for n, d in enumerate(degrees, start=1))
        found.append([c["CL"] + tot["CLtot"], 0.0, c["CY"], c["Cl"] * cos - c["Cn"] * sin,
                      c["Cm"] + tot["Cmtot"], c["Cl"] * sin + c["Cn"] * cos])  # fmt: skip
    theirs = np.array(found)
    theirs[:, 1] = known.ours[:, 1]  # ST has no slope of drag
    known.same(theirs)


def test_aerosandbox(known: Known, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file runs on numpy; an operating point has alpha and beta in degrees."""
    text = _text(known, "mine.aerosandbox.py", tmp_path)
    package = types.ModuleType("aerosandbox")
    package.numpy = np  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "aerosandbox", package)
    monkeypatch.setitem(sys.modules, "aerosandbox.numpy", np)
    space: dict[str, object] = {}
    exec(compile(text, "mine.aerosandbox.py", "exec"), space)
    f, force = known.frame, 0.5 * DENSITY * SPEED_MPS**2 * known.frame.wing_area_m2
    found = []
    for point in known.points:
        p, q, r = point[2:5] * 2.0 * SPEED_MPS / [f.span_m, f.chord_m, f.span_m]
        op = types.SimpleNamespace(
            velocity=SPEED_MPS, alpha=math.degrees(point[0]), beta=math.degrees(point[1]),
            p=p, q=q, r=r, dynamic_pressure=lambda: 0.5 * DENSITY * SPEED_MPS**2,
        )  # fmt: skip
        c = space["aerodynamics"](op, *point[5:])  # type: ignore[operator]
        x, y, z = np.array(c["F_b"]) / force
        moments = np.array(c["M_b"]) / (force * np.array([f.span_m, f.chord_m, f.span_m]))
        found.append([*np.array(_of_body(x, y, z, point[0])), *moments])
        assert found[-1][0] == pytest.approx(c["CL"])
    known.same(np.array(found))


FLIGHTGEAR = """
def controls(de, da, dr):
    full = 0.4363323
    fdm["fcs/elevator-cmd-norm"], fdm["fcs/aileron-cmd-norm"] = de / full, da / full
    fdm["fcs/rudder-cmd-norm"] = -dr / full
    fdm["/controls/engines/engine[0]/throttle"] = 0.4
out = [air(*point) for point in json.load(sys.stdin)]
assert abs(fdm["fcs/throttle-shaft"] - 0.4) < 1e-12
print(json.dumps(out))
"""


def test_flightgear(known: Known, tmp_path: Path) -> None:
    """JSBSim, in its process, behind FlightGear's sticks: as exact as its own XML."""
    folder = tmp_path / "aircraft/mine"
    folder.mkdir(parents=True)
    files = write_form(folder / "mine-set.xml", known.tables, [], "ultrastick25e", None)
    assert [f.name for f in files] == ["mine-set.xml", "mine.xml"]
    settings = ElementTree.parse(files[0]).getroot()
    assert settings.findtext("sim/flight-model") == "jsb"
    assert settings.findtext("sim/aero") == "mine"
    assert "no landing gear" in files[1].read_text(encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", JSBSIM_AIR + FLIGHTGEAR, str(tmp_path), "mine"],
        input=json.dumps(known.points.tolist()), capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr + done.stdout
    known.same(np.array(json.loads(done.stdout.splitlines()[-1])), 1e-6)


def test_places_are_looked_at_before_the_work(tmp_path: Path) -> None:
    with pytest.raises(IdentificationError, match="an aircraft needs mass and geometry"):
        check_outputs(OutputPaths(save_model=tmp_path / "mine.sdf"))
    check_outputs(OutputPaths(save_model=tmp_path / "mine.control.py"))
    with pytest.raises(IdentificationError, match=r"expected \.toml or .*\.aerosandbox\.py"):
        check_outputs(OutputPaths(save_model=tmp_path / "mine.py"))
    mine = tmp_path / "mine.xml"
    mine.write_text("<a/>")
    with pytest.raises(IdentificationError, match=r"mine\.xml is what the answer is made from"):
        check_outputs(
            OutputPaths(save_model=tmp_path / "mine-set.xml", source="ultrastick25e", given=(mine,))
        )
