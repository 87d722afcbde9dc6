"""An answer becomes an aircraft that flies again, and one that JSBSim reads."""

import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable
from itertools import starmap
from pathlib import Path

import numpy as np
import pytest
from host.aircraft.airframe import Airframe
from host.aircraft.file import load as load_aircraft
from host.aircraft.local_derivatives import coefficients, local_derivatives
from host.aircraft.mass_properties import airframe_data
from host.aircraft.powerplant import powerplant
from host.arrays import Array
from host.cli import main
from host.export import toml as tomlout
from host.sysid.aerodynamics import Coefficient, CoefficientTable
from host.sysid.answer import read_truth, true_coefficients
from host.sysid.answer.aircraft_export import AXES, CONTROLS, aircraft_document
from host.sysid.coefficients.coefficient_fit import MeanCondition, ThrustEffect
from host.sysid.flight import read_columns

from tests.host.sysid.at_hand import identify

METHOD = "output-error-white"  # in calm air as good as the default, in a third of its time
JSBSIM = """
import sys, jsbsim
fdm = jsbsim.FGFDMExec(sys.argv[1])
fdm.set_debug_level(0)
fdm.set_aircraft_path("aircraft")
assert fdm.load_model("identified")
fdm.set_dt(0.002)
fdm["ic/u-fps"], fdm["ic/w-fps"], fdm["ic/h-sl-ft"] = 55.0, 5.5, 1000.0
fdm["fcs/elevator-pos-rad"] = float(sys.argv[2])
assert fdm.run_ic()
for _ in range(10):
    fdm.run()
print(fdm["velocities/q-rad_sec"])
"""


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory, simulated: Callable[[str, int], Path]) -> Path:
    """A flight, its answer as two files, and a flight of the answer."""
    folder = tmp_path_factory.mktemp("export")
    quiet = ["--firmware", "none", "--no-picture"]
    (folder / "one").symlink_to(simulated("calm", 4))
    again, xml = folder / "again.toml", folder / "aircraft/identified/identified.xml"
    xml.parent.mkdir(parents=True)
    flags = ["--aircraft", "ultrastick25e", "--no-corrections", "--method", METHOD]
    flags += ["--save-aircraft", str(again), "--save-model", str(xml)]
    assert main(["identify", str(folder / "one/flight.csv"), *flags]) == 0
    card = folder / "card.toml"
    card.write_text(
        f'format = 1\ntitle = "again"\naircraft = "{again}"\n'
        "[pilot]\ntiming_s = 0.0\namplitude = 0.0\ndrift = 0.0\nremnant = 0.0\nearly = 0.0\n"
        + "".join(
            f'[[segment]]\nkind = "3211"\naxis = "{axis}"\namplitude = 3.0\nwidth_s = 0.25\n'
            for axis in ("elevator", "elevator", "aileron", "rudder")
        )
    )
    assert main(["simulate", str(card), *quiet, "--seed", "5", "-o", str(folder / "two")]) == 0
    return folder


def test_the_second_aircraft_is_the_first_ones_answer(saved: Path) -> None:
    with (saved / "again.toml").open("rb") as file:
        table = tomllib.load(file)["aerodynamics"]
    columns, _ = read_columns(saved / "one/flight.csv")
    used = 0
    known_of = airframe_data("ultrastick25e"), powerplant("ultrastick25e")
    for answer in identify(columns, airframe=known_of[0], powerplant=known_of[1], method=METHOD):
        for c in answer.coefficients:
            axis, _, label = c.name.partition("_")
            key = f"{AXES.get(axis, axis)}_{CONTROLS.get(label, label)}"
            known = c.half_width < abs(c.value)
            if key in table and axis in AXES:
                assert table["sources"].get(key, "").startswith("identified") == known
                if known:
                    assert table[key] == pytest.approx([c.value] * len(table["alpha_rad"]))
                    used += 1
    assert used >= 10


def test_identifying_the_second_flight_gives_the_same_aircraft(saved: Path) -> None:
    truth = read_truth(saved / "two/flight.truth.toml")
    columns, _ = read_columns(saved / "two/flight.csv")
    for answer in identify(columns, airframe=airframe_data("ultrastick25e"), method=METHOD):
        expected = true_coefficients(truth, answer.template)
        for c in answer.coefficients:
            if c.name in ("Cm_alpha", "Cm_de", "Cl_p", "Cn_beta", "Cn_dr"):
                assert c.value == pytest.approx(expected[c.name], rel=0.25), c.name


def test_bends_have_their_place_in_the_tables() -> None:
    def known(name: str, value: float) -> Coefficient:
        return Coefficient(name, value, 0.01, 0.02)

    trim, lift = 0.07, 0.3
    values = {
        "CL_alpha": 4.0, "CD_alpha": 0.24, "CD_0": 0.03, "CL_de": 0.5, "CD_de": 0.05,
        "Cm_alpha": -1.6, "Cm_alpha2": -4.0, "Cm_q": -11.0, "Cm_alpha_q": -40.0, "Cm_V": 0.3,
    }  # fmt: skip
    flight = MeanCondition(
        17.0, 170.0, trim, lift, 0.04, ThrustEffect(2.0, -0.1, 0.0), (0.02, 0.14), (1.0, 1.0)
    )
    table = CoefficientTable("longitudinal", "by hand", trim, tuple(starmap(known, values.items())))
    document, replaced = aircraft_document([table], "ultrastick25e", flight)
    assert set(replaced) == set(values) - {"Cm_V"}
    assert "Cm_V 0.3" in document["aerodynamics"]["sources"]["not_carried"]
    before = load_aircraft("ultrastick25e").airframe()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bent.toml"
        path.write_text(tomlout.dumps(document))
        after = load_aircraft(path).airframe()

    def at(frame: Airframe, alpha: float, q_hat: float = 0.0, beta: float = 0.0) -> Array:
        return coefficients(frame, np.array([alpha, beta, 0.0, q_hat, 0.0, 0.0, 0.0, 0.0]))

    for step in (-0.04, 0.03):
        bend = -1.6 * step - 4.0 * step**2
        assert at(after, trim + step)[4] - at(after, trim)[4] == pytest.approx(bend, abs=1e-9)
        damping = (at(after, trim + step, 0.01) - at(after, trim + step))[4] / 0.01
        assert damping == pytest.approx(-11.0 - 40.0 * step, rel=1e-9)
        # What was not identified is as it was, between and beyond the old nodes.
        aside = at(after, trim + step, 0.0, 0.05) - at(before, trim + step, 0.0, 0.05)
        np.testing.assert_allclose(aside[[2, 3, 5]], 0.0, atol=1e-12)
    assert at(after, trim)[4] == pytest.approx(at(before, trim)[4], abs=1e-12)
    # At the lift flown the polar has the slope that was identified, the elevator's part its own.
    here = (lift - at(after, 0.0)[0]) / 4.0
    local = local_derivatives(after, np.array([here, 0, 0, 0, 0, 0, 0, 0]), 1e-4)
    assert local["CD_alpha"] == pytest.approx(0.24, rel=1e-3)
    assert local["CD_de"] == pytest.approx(0.05, rel=1e-3)
    assert local["CD_0"] == pytest.approx(0.03, rel=1e-3)


def test_jsbsim_reads_and_flies_it(saved: Path) -> None:
    rates = []
    for elevator in ("-0.1", "0.1"):
        done = subprocess.run(
            [sys.executable, "-c", JSBSIM, str(saved), elevator],
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        rates.append(float(done.stdout.split()[-1]))
    # M_de times twice the deflection times 20 ms, a fifth lost to damping and lag at most.
    assert rates[1] - rates[0] < -0.05


def test_without_an_aircraft_it_says_what_is_missing(
    saved: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = saved / "none.toml"
    source = str(saved / "one/flight.csv")
    assert main(["identify", source, "--save-aircraft", str(target)]) == 2
    assert "--aircraft" in capsys.readouterr().err
    assert not target.exists()
