"""An answer becomes an aircraft that flies again, and one that JSBSim reads."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from host.cli import main
from host.sysid.aircraft.aircraft_file import airframe_data
from host.sysid.answer.aircraft_export import AXES, CONTROLS
from host.sysid.answer.truth import read_truth, true_coefficients
from host.sysid.flight.linear import identify
from host.sysid.flight.tables import read_columns

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
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A flight, its answer as two files, and a flight of the answer."""
    folder = tmp_path_factory.mktemp("export")
    quiet = ["--firmware", "none", "--no-picture"]
    assert main(["simulate", "calm", *quiet, "--seed", "4", "-o", str(folder / "one")]) == 0
    again, xml = folder / "again.toml", folder / "aircraft/identified/identified.xml"
    xml.parent.mkdir(parents=True)
    flags = ["--aircraft", "ultrastick25e", "--no-corrections"]
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
    for answer in identify(columns, airframe=airframe_data("ultrastick25e")):
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
    for answer in identify(columns, airframe=airframe_data("ultrastick25e")):
        expected = true_coefficients(truth, answer.template)
        for c in answer.coefficients:
            if c.name in ("Cm_alpha", "Cm_de", "Cl_p", "Cn_beta", "Cn_dr"):
                assert c.value == pytest.approx(expected[c.name], rel=0.25), c.name


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
