"""Coefficients of flights that lack an axis, a surface, thrust or air: what is left is right."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from host.aircraft.file import load_measured
from host.aircraft.powerplant import powerplant
from host.aircraft.propulsion import propeller
from host.errors import IdentificationError
from host.physical.recording import SURFACES
from host.readers.even_grid import even_columns
from host.sysid.coefficients import CoefficientModel
from host.sysid.models import read_model

import host
from tests.host.sysid.recorded import NAME, nominal_multisine

SIDE = (
    "beta_rad", "p_radps", "r_radps", "ay_mps2", "phi_rad", "aileron_rad", "rudder_rad",
)  # fmt: skip
LIFT_AND_PITCH = ("CL_alpha", "CL_de", "Cm_alpha", "Cm_q", "Cm_de")
ROLL_AND_YAW = ("Cl_beta", "Cl_p", "Cl_da", "Cn_beta", "Cn_r", "Cn_dr")


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    """A multisine on each axis, nothing drawn, by our logger, whose clock GPS checked."""
    columns, _ = even_columns(nominal_multisine().table)
    found = pd.DataFrame(columns)
    found.attrs = {"inputs": dict.fromkeys(SURFACES, "measured"), "clock_half_width": 0.0}
    return found


@pytest.fixture(scope="module")
def whole(table: pd.DataFrame) -> host.Identification:
    return host.identify(table, aircraft=NAME, models="coefficients")


def identified(table: pd.DataFrame, **options: object) -> host.Identification:
    arguments: dict[str, object] = {"aircraft": NAME, "models": "coefficients", **options}
    return host.identify(table, **arguments)  # type: ignore[arg-type]


def numbers(whole: host.Identification, *axes: str) -> list[int]:
    return [k for k, f in enumerate(whole.flights[0].maneuvers, start=1) if f.axis in axes]


def agrees(
    part: host.Identification, whole: host.Identification, names: Sequence[str], share: float = 0.7
) -> None:
    """The same coefficients within a part of their half-widths."""
    a, b = (
        {d.name: d for d in one.coefficients.fit.derivatives}
        for one in (part, whole)
        if one.coefficients
    )
    for name in names:
        assert abs(a[name].value - b[name].value) < share * a[name].half_width, name


def rows(found: host.Identification) -> set[str]:
    assert found.coefficients is not None
    return {d.name.split("_")[0] for d in found.coefficients.fit.derivatives}


def test_elevator_maneuvers_alone(table: pd.DataFrame, whole: host.Identification) -> None:
    part = identified(table, maneuvers=numbers(whole, "elevator_rad"))
    assert rows(part) == {"CL", "CD", "Cm"}
    agrees(part, whole, (*LIFT_AND_PITCH, "CD_0"))
    assert {m.name for m in part.coefficients.modes} == {"short period", "phugoid"}  # type: ignore
    assert list(part.coefficients.systems) == ["longitudinal"]  # type: ignore[union-attr]
    assert any("no maneuver of aileron and rudder: CY, Cl, Cn left out" in x for x in part.verdict)


def test_lateral_maneuvers_alone(table: pd.DataFrame, whole: host.Identification) -> None:
    part = identified(table, maneuvers=numbers(whole, "aileron_rad", "rudder_rad"))
    assert rows(part) == {"CY", "Cl", "Cn"}
    agrees(part, whole, ROLL_AND_YAW)
    assert {m.name for m in part.coefficients.modes} == {"dutch roll", "roll", "spiral"}  # type: ignore
    assert part.to_text()
    assert part.to_json()
    assert part.plot()


def test_records_of_one_axis_without_the_forces_of_the_other(
    table: pd.DataFrame, whole: host.Identification
) -> None:
    """They were refused: roll and yaw for want of alpha, lift and pitch for want of ax."""
    along = ["alpha_rad", "theta_rad", "q_radps", "elevator_rad", "ax_mps2", "az_mps2"]
    rolling = identified(table.drop(columns=along))
    assert rows(rolling) == {"CY", "Cl", "Cn"}
    agrees(rolling, whole, ROLL_AND_YAW)
    assert any("taken as in level flight" in line for line in rolling.verdict)
    pitching = identified(table.drop(columns=[*SIDE, "ax_mps2"]))
    assert rows(pitching) == {"CL", "Cm"}
    agrees(pitching, whole, LIFT_AND_PITCH)
    assert any("no ax_mps2: CD left out" in line for line in pitching.verdict)


def test_a_flying_wing(table: pd.DataFrame, whole: host.Identification) -> None:
    for lacking in (table.drop(columns=["rudder_rad"]), table.assign(rudder_rad=0.0)):
        part = identified(lacking)
        names = {d.name for d in part.coefficients.fit.derivatives}  # type: ignore[union-attr]
        assert not any(name.endswith("_dr") for name in names)
        agrees(part, whole, (*LIFT_AND_PITCH, "Cl_p", "Cl_da"))


def test_a_model_of_lift_and_pitch(
    table: pd.DataFrame, whole: host.Identification, tmp_path: Path
) -> None:
    path = tmp_path / "terms.toml"
    path.write_text(
        'kind = "coefficients"\n[rows]\nCL = ["alpha", "q", "de"]\nCm = ["alpha", "q", "de"]\n'
    )
    model = read_model(path, of_coefficients=True)
    assert isinstance(model, CoefficientModel) and set(model.equations) == {"CL", "Cm"}
    part = identified(table, models=path)
    assert rows(part) == {"CL", "Cm"}
    agrees(part, whole, LIFT_AND_PITCH)


@pytest.fixture(scope="module")
def gauged(table: pd.DataFrame) -> pd.DataFrame:
    """The table with thrust and shaft power as gauges would have them, without throttle."""
    plant, frame = powerplant(NAME), load_measured(NAME).airframe()
    speed, density = (table[c].to_numpy() for c in ("airspeed_mps", "density_kgpm3"))
    dt_s = float(table["t_s"][1] - table["t_s"][0])
    thrust, spin, _ = plant.run(table["throttle"].to_numpy(), speed, density, dt_s)
    load_nm = [propeller(frame, *x)[1] for x in zip(spin, speed, density, strict=True)]
    gauges = {"thrust_n": thrust, "power_w": np.array(load_nm) * spin}
    return table.drop(columns=["throttle"]).assign(**gauges)


@pytest.mark.parametrize("gauge", ["thrust_n", "power_w"])
def test_thrust_may_be_measured(
    gauged: pd.DataFrame, whole: host.Identification, gauge: str
) -> None:
    part = identified(gauged.drop(columns=[g for g in ("thrust_n", "power_w") if g != gauge]))
    agrees(part, whole, (*LIFT_AND_PITCH, "CD_0", "CD_alpha"))


def test_measured_thrust_is_believed(gauged: pd.DataFrame, whole: host.Identification) -> None:
    wrong = identified(gauged.drop(columns=["power_w"]).assign(thrust_n=1.5 * gauged["thrust_n"]))
    drag = [
        next(d.value for d in one.coefficients.fit.derivatives if d.name == "CD_0")  # type: ignore
        for one in (whole, wrong)
    ]
    assert drag[1] > 1.2 * drag[0]


def test_measured_thrust_comes_through_a_map(
    gauged: pd.DataFrame, whole: host.Identification, tmp_path: Path
) -> None:
    source, mapping = tmp_path / "t.csv", tmp_path / "map.toml"
    gauged = gauged.drop(columns=["power_w"])
    gauged["Thrust lbf"] = gauged.pop("thrust_n") / 4.448222
    gauged.to_csv(source, index=False)
    named = "".join(f'{c} = "{c}"\n' for c in gauged.columns if " " not in c)
    mapping.write_text(f'[columns]\n{named}thrust_n = {{ from = "Thrust lbf", unit = "lbf" }}\n')
    part = host.identify(source, aircraft=NAME, models="coefficients", mapping=mapping)
    agrees(part, whole, ("CL_alpha", "CD_0"))


def test_without_thrust_there_is_no_drag(table: pd.DataFrame, whole: host.Identification) -> None:
    part = identified(table.drop(columns=["throttle"]))
    assert rows(part) == {"CL", "Cm", "CY", "Cl", "Cn"}
    agrees(part, whole, (*LIFT_AND_PITCH, *ROLL_AND_YAW))
    assert any("no thrust known: CD left out" in x for x in part.verdict)
    assert list(part.coefficients.systems) == ["lateral"]  # type: ignore[union-attr]


def test_air_that_nobody_measured_widens(table: pd.DataFrame, whole: host.Identification) -> None:
    part = identified(table.drop(columns=["qbar_pa", "density_kgpm3", "static_pa"]))
    agrees(part, whole, (*LIFT_AND_PITCH, *ROLL_AND_YAW), 1.0)
    wide, known = (
        next(d.half_width for d in one.coefficients.fit.derivatives if d.name == "CL_alpha")
        for one in (part, whole)
        if one.coefficients
    )
    assert wide > 1.5 * known


def test_flights_of_different_axes_are_not_pooled(
    table: pd.DataFrame, whole: host.Identification
) -> None:
    other = table.drop(columns=list(SIDE))
    with pytest.raises(IdentificationError, match="do not tell the same coefficients") as caught:
        identified([table, other])  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


def test_power_of_a_rotor_is_turned_to_its_thrust() -> None:
    """Against the propeller at known rotor speeds."""
    plant, frame = powerplant(NAME), load_measured(NAME).airframe()
    spin = np.linspace(300.0, 1100.0, 40)
    speed, density = np.linspace(10.0, 24.0, 40), np.full(40, 1.1)
    pairs = [propeller(frame, *x) for x in zip(spin, speed, density, strict=True)]
    power = np.array([load for _, load in pairs]) * spin
    assert plant.of_power is not None
    working = power > 1.0
    found = plant.of_power(power[working], speed[working], density[working])
    np.testing.assert_allclose(found, np.array([t for t, _ in pairs])[working], atol=1e-6)
