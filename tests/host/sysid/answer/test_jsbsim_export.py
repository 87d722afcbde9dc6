"""JSBSim has every derivative of a saved answer: signs, axes, units, reference sizes, rates."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from host.aircraft.file import load
from host.aircraft.local_derivatives import local_derivatives
from host.sysid.aerodynamics.coefficient_table import Coefficient, CoefficientTable
from host.sysid.answer.aircraft_export import save_aircraft

# Forces and moments of the air alone, as coefficients, at one condition and a step to either side.
JSBSIM_SLOPES = """
import json, math, sys, jsbsim
fdm = jsbsim.FGFDMExec(sys.argv[1])
fdm.set_debug_level(0)
fdm.set_aircraft_path("aircraft")
assert fdm.load_model("identified")
FT, LB, V, TILT, HUB, SPIN = 0.3048, 4.4482216152605, 17.0, -0.0523599, 0.297, 0.00012991
S, b, c = (fdm["metrics/" + k] * FT**n for k, n in (("Sw-sqft", 2), ("bw-ft", 1), ("cbarw-ft", 1)))
def at(x):
    alpha, beta, p, q, r, de, da, dr = x
    p, q, r = p * 2 * V / b, q * 2 * V / c, r * 2 * V / b
    fdm["ic/h-sl-ft"], fdm["ic/theta-rad"] = 1000.0, 0.0
    fdm["ic/u-fps"] = V * math.cos(alpha) * math.cos(beta) / FT
    fdm["ic/v-fps"] = V * math.sin(beta) / FT
    fdm["ic/w-fps"] = V * math.sin(alpha) * math.cos(beta) / FT
    fdm["ic/p-rad_sec"], fdm["ic/q-rad_sec"], fdm["ic/r-rad_sec"] = p, q, r
    fdm["fcs/elevator-pos-rad"], fdm["fcs/left-aileron-pos-rad"] = de, da
    fdm["fcs/rudder-pos-rad"] = dr
    assert fdm.run_ic()
    force = fdm["aero/qbar-psf"] * LB / FT**2 * S
    X, Y, Z = (fdm["forces/fb" + k + "-aero-lbs"] * LB for k in "xyz")
    L, M, N = (fdm["moments/" + k + "-aero-lbsft"] * LB * FT for k in "lmn")
    T, D, turn = fdm["rotor/thrust-n"], fdm["rotor/drive-nm"], fdm["rotor/omega"] * SPIN
    tx, tz = math.cos(TILT), -math.sin(TILT)
    X, Z, M = X - T * tx, Z - T * tz, M + HUB * tz * T + r * turn * tx - p * turn * tz
    L, N = L + D * tx + q * turn * tz, N + D * tz - q * turn * tx
    s, k = math.sin(alpha), math.cos(alpha)
    return [v / force for v in (X * s - Z * k, -X * k - Z * s, Y, L / b, M / c, N / b)]
base, slopes = [0.1, 0.0, 0.0, 0.0, 0.0, -0.12, 0.0, 0.0], {}
names = "alpha", "beta", "p", "q", "r", "de", "da", "dr"
for k, name in enumerate(names):
    step = [1e-3 * (k == j) for j in range(8)]
    hi, lo = (at([v + sign * d for v, d in zip(base, step)]) for sign in (1, -1))
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
        [sys.executable, "-c", JSBSIM_SLOPES, str(tmp_path)],
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
