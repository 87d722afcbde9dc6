"""JSBSim has every derivative of a saved answer: signs, axes, units, reference sizes, rates."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from host.aircraft.file import load
from host.aircraft.local_derivatives import local_derivatives
from host.sysid.aerodynamics import Coefficient, CoefficientTable
from host.sysid.answer.aircraft_export import save_aircraft

from tests.host.sysid.answer.jsbsim_air import JSBSIM_AIR

# Forces and moments of the air alone, as coefficients, at one condition and a step to either side.
JSBSIM_SLOPES = """
def controls(de, da, dr):
    fdm["fcs/elevator-pos-rad"], fdm["fcs/left-aileron-pos-rad"] = de, da
    fdm["fcs/rudder-pos-rad"] = dr
base, slopes = [0.1, 0.0, 0.0, 0.0, 0.0, -0.12, 0.0, 0.0], {}
names = "alpha", "beta", "p", "q", "r", "de", "da", "dr"
for k, name in enumerate(names):
    step = [1e-3 * (k == j) for j in range(8)]
    hi, lo = (air(*(v + sign * d for v, d in zip(base, step))) for sign in (1, -1))
    for row, h, l in zip(("CL", "CD", "CY", "Cl", "Cm", "Cn"), hi, lo):
        slopes[row + "_" + name] = (h - l) / 2e-3
print(json.dumps(slopes))
"""

VALUES = {
    "longitudinal": {"CL_alpha": 3.9, "Cm_alpha": -1.6, "Cm_q": -11.0, "CL_q": 8.0, "Cm_de": -1.3},
    "lateral": {"CY_beta": -0.12, "Cl_beta": -0.04, "Cl_p": -0.37, "Cl_r": 0.09, "Cl_da": 0.21,
                "Cn_beta": 0.056, "Cn_p": -0.03, "Cn_r": -0.064, "Cn_dr": -0.049},
}  # fmt: skip


def test_jsbsim_has_the_derivatives_that_were_identified(tmp_path: Path) -> None:
    tables = [
        CoefficientTable(
            name, "by hand", 0.1,
            tuple(Coefficient(n, v, 0.01 * abs(v), 0.02 * abs(v)) for n, v in values.items()),
        )
        for name, values in VALUES.items()
    ]  # fmt: skip
    flown, xml = tmp_path / "again.toml", tmp_path / "aircraft/identified/identified.xml"
    for path in (flown, xml):
        save_aircraft(path, tables, "ultrastick25e")
    done = subprocess.run(
        [sys.executable, "-c", JSBSIM_AIR + JSBSIM_SLOPES, str(tmp_path), "identified"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    theirs = json.loads(done.stdout.splitlines()[-1])
    at = np.array([0.1, 0.0, 0.0, 0.0, 0.0, -0.12, 0.0, 0.0])
    ours = local_derivatives(load(flown).airframe(), at, 1e-3)
    assert len(theirs) == 48
    for name, slope in theirs.items():
        assert slope == pytest.approx(ours[name], rel=1e-8, abs=1e-8), name
    for values in VALUES.values():
        for name, value in values.items():
            if not name.endswith("_alpha"):  # other tables of the file bend with alpha too
                assert theirs[name] == pytest.approx(value, rel=1e-6), name
    head = xml.read_text(encoding="utf-8")[:1500]
    assert "trailing edge down" in head
    assert "cm_q: identified, by hand: -11 +- 0.22 (95 %)" in head
