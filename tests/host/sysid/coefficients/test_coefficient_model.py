"""The equations of a fit of coefficients as data: terms read, truths with a bend recovered."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.aircraft.file import read_document
from host.aircraft.mass_properties import airframe_data
from host.aircraft.powerplant import powerplant
from host.arrays import Array
from host.cli import main
from host.errors import IdentificationError
from host.export import toml as tomlout
from host.instrument.deviations import sensor_error_model
from host.sysid.coefficients import (
    CoefficientFit,
    CoefficientModel,
    fit_coefficients,
    standard_model,
)
from host.sysid.coefficients.coefficient_fit import Derivative
from host.sysid.coefficients.trim_derivatives import TrimMeans, derivatives_at_trim
from host.sysid.models import read_model
from host.sysid.models.coefficient_model import parse_term
from host.twin.testcard.cards import load
from host.twin.virtual import VirtualFlight, virtual_flight

from tests.host.sysid.recorded import NAME, aloft

BEND, LIFTED_DAMPING = -4.0, -40.0  # of the bent aircraft: Cm_alpha2, Cm_alpha_q
ROWS = {
    "CL": ["alpha", "q", "de"],
    "CD": ["alpha", "de"],
    "Cm": ["alpha", "q", "de"],
    "CY": ["beta", "p", "r", "da", "dr"],
    "Cl": ["beta", "p", "r", "da", "dr"],
    "Cn": ["beta", "p", "r", "da", "dr"],
}
BESIDE = {"CD": ["q", "CL^2"]}


def written(
    folder: Path, rows: Mapping[str, list[str]], beside: Mapping[str, list[str]] = BESIDE
) -> Path:
    path = folder / "model.toml"
    document = {"kind": "coefficients", "name": "own", "rows": dict(rows), "beside": dict(beside)}
    path.write_text(tomlout.dumps(document))
    return path


def read_terms(path: Path) -> CoefficientModel:
    model = read_model(path, of_coefficients=True)
    assert isinstance(model, CoefficientModel)
    return model


@pytest.fixture(scope="module")
def bent(tmp_path_factory: pytest.TempPathFactory) -> VirtualFlight:
    """An aircraft whose pitching moment is a parabola in alpha and whose damping grows with it.

    Tables between two nodes are straight, so cm_alpha = a + b alpha makes Cm hold b alpha^2.
    """
    document = json.loads(json.dumps(read_document(NAME)))
    table = document["aerodynamics"]
    nodes = np.array([-0.05, 0.20])
    for name, value in table.items():
        if name != "alpha_rad" and isinstance(value, list) and len(value) == 2:
            table[name] = value if name == "stall_alpha_rad" else [value[0], value[0]]
    table["alpha_rad"] = nodes.tolist()
    trim = 0.07
    table["cm_alpha"] = (-1.65 + BEND * (nodes - 2.0 * trim)).tolist()
    table["cm_0"] = 2 * [0.0038 - BEND * trim**2]
    table["cm_q"] = (-10.9 + LIFTED_DAMPING * (nodes - trim)).tolist()
    path = tmp_path_factory.mktemp("bent") / "bent.toml"
    path.write_text(tomlout.dumps(document))
    card = load("multisine")
    calm = replace(card, aircraft=str(path), sensors=replace(card.sensors, tolerances=False))
    return virtual_flight(calm, 7, chain="none")


def fitted(flight: VirtualFlight, model: CoefficientModel | None) -> CoefficientFit:
    data = sensor_error_model(NAME)
    return fit_coefficients(*aloft(flight), airframe_data(NAME), data, powerplant(NAME), model)


def by_name(fit: CoefficientFit) -> dict[str, Derivative]:
    return {d.name: d for d in fit.derivatives}


def test_recovers_the_bend_of_a_moment_and_of_the_polar(
    bent: VirtualFlight, tmp_path: Path
) -> None:
    rows = ROWS | {
        "Cm": ["alpha", "q_hat", "de", "alpha^2", "q*alpha", "V"],
        "CD": ["CL^2", "q", "de"],
    }
    model = read_terms(written(tmp_path, rows, {"CD": ["de^2"]}))
    fit = fitted(bent, model)
    found = by_name(fit)
    for name, truth, within in (
        ("Cm_alpha2", BEND, 0.25), ("Cm_alpha_q", LIFTED_DAMPING, 0.4), ("CD_CL2", 0.0962, 0.12),
    ):  # fmt: skip
        assert abs(found[name].value - truth) <= 1.2 * found[name].half_width, name
        assert found[name].value == pytest.approx(truth, rel=within), name
    # Nothing in this aircraft goes with airspeed beyond dynamic pressure.
    assert abs(found["Cm_V"].value) <= 1.5 * found["Cm_V"].half_width
    # Slopes stay those at the trim; drag's hold what lift brings.
    steep = -1.65 + 2.0 * BEND * (fit.condition.alpha_rad - 0.07)
    assert found["Cm_alpha"].value == pytest.approx(steep, rel=0.05)
    assert found["CD_alpha"].value == pytest.approx(
        2.0 * found["CD_CL2"].value * fit.condition.lift * found["CL_alpha"].value, rel=1e-9
    )
    # Taken for straight, the moment fits visibly worse; zero lift is where it was.
    straight = fitted(bent, None)
    assert found["CD_0"].value == pytest.approx(by_name(straight)["CD_0"].value, abs=0.003)
    assert fit.histories["Cm"].nrmse < 0.97 * straight.histories["Cm"].nrmse


def test_body_axes_say_the_same_as_lift_and_drag_turned(
    bent: VirtualFlight, tmp_path: Path
) -> None:
    """Each with the terms the other implies: CX holds a part of CL_q, so CD must have q."""
    moments = {k: v for k, v in ROWS.items() if k not in ("CL", "CD")}
    normal = ["alpha", "q", "de"]
    bends = ["alpha^2", "alpha*q", "alpha*de", "de^2"]
    fits = []
    for forces in (("CL", "CD"), ("CZ", "CX")):
        rows, beside = dict.fromkeys(forces, normal) | moments, dict.fromkeys(forces, bends)
        model = read_terms(written(tmp_path, rows, beside))
        fits.append(by_name(fitted(bent, model)))
    wind, body = fits
    for name in ("CL_alpha", "CL_q", "CL_de", "CD_alpha", "CD_de", "CD_0"):
        ours, theirs = body[name], wind[name]
        assert abs(ours.value - theirs.value) < 0.35 * theirs.half_width, name
        assert ours.half_width == pytest.approx(theirs.half_width, rel=0.25), name
    assert body["CZ_alpha"].value == pytest.approx(-wind["CL_alpha"].value, rel=0.05)


def test_turning_is_the_slope_of_turned_forces(tmp_path: Path) -> None:
    moments = {k: v for k, v in ROWS.items() if k not in ("CL", "CD")}
    model = read_terms(written(tmp_path, {"CZ": ["alpha"], "CX": ["alpha"]} | moments, {}))
    position = {name: k for k, (name, _, _) in enumerate(model.named())}
    trim, lift, drag = 0.08, 0.4, 0.05
    z, x = (
        -(lift * np.cos(trim) + drag * np.sin(trim)), lift * np.sin(trim) - drag * np.cos(trim),
    )  # fmt: skip
    state = np.zeros(len(position))
    state[position["CZ_alpha"]], state[position["CX_alpha"]] = -4.0, 0.3

    def turned(alpha: float) -> Array:
        normal, axial = z - 4.0 * (alpha - trim), x + 0.3 * (alpha - trim)
        ca, sa = np.cos(alpha), np.sin(alpha)
        return np.array([-normal * ca + axial * sa, -axial * ca - normal * sa])

    expected = (turned(trim + 1e-6) - turned(trim - 1e-6)) / 2e-6
    still = np.zeros(len(position))
    found = derivatives_at_trim(model, state, position, TrimMeans(trim, lift, drag, still, still))
    assert [found["CL_alpha"][0], found["CD_alpha"][0]] == pytest.approx(expected, rel=1e-7)


def test_the_standard_equations_are_a_file(tmp_path: Path) -> None:
    assert read_terms(written(tmp_path, ROWS)).equations == standard_model().equations
    assert standard_model().nuisance == {"CD_q", "CD_CL2"}


def test_a_term_is_known_by_its_factors() -> None:
    for text, label in (
        ("q_hat*alpha", "alpha_q"), ("alpha * alpha", "alpha2"), ("|beta|*beta", "beta_abs_beta"),
        ("de^3", "de3"), ("V", "V"),
    ):  # fmt: skip
        term = parse_term(text, "Cm", "here")
        assert sorted(term.label.split("_")) == sorted(label.split("_"))
    t = np.linspace(-0.1, 0.3, 5)
    values = parse_term("alpha^2*|q|", "Cm", "here").values({"alpha": t, "q": -t}, {"alpha": 0.1})
    np.testing.assert_allclose(values, (t - 0.1) ** 2 * np.abs(t))


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ({"Cm": ["alpha", "gamma"]}, "Cm: unknown term 'gamma'"),
        ({"Cm": ["alpha", "alpha^4"]}, "Cm: unknown term 'alpha^4'"),
        ({"Cm": ["alpha", "|alpha"]}, "unknown term '|alpha'"),
        ({"Cm": ["alpha", "CL^2"]}, "lift stands in CD only, as CL^2"),
        ({"Cm": ["alpha", "q*alpha", "alpha*q_hat"]}, "Cm: alpha_q stands there twice"),
        ({"CD": ["alpha", "CL^2"]}, "CD: CL2 stands there twice"),  # in [beside] too
        ({row: [] for row in ROWS}, "[rows] needs one row or more"),
        ({"CX": ["alpha"]}, "unknown row CL"),
        ({"CW": ["alpha"]}, "unknown row CW"),
        ({"Cm": "alpha"}, "[rows]: expected lines such as"),
    ],
)
def test_what_is_wrong_with_a_file_is_one_line(
    rows: dict[str, list[str]], said: str, tmp_path: Path
) -> None:
    with pytest.raises(IdentificationError) as caught:
        read_terms(written(tmp_path, ROWS | rows))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_term_that_never_moves_is_named(bent: VirtualFlight) -> None:
    flight = replace(bent, table=bent.table.assign(rudder_rad=0.01))
    with pytest.raises(IdentificationError, match=r"cannot tell .*Cn_dr"):
        fitted(flight, standard_model())


def test_the_command_names_what_is_wrong(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = tmp_path / "flight.csv"
    table.write_text("t_s,alpha_rad\n" + "".join(f"{0.02 * k:.2f},0.1\n" for k in range(200)))
    wrong = written(tmp_path, ROWS | {"Cm": ["alpha", "gamma"]})
    (tmp_path / "right").mkdir()
    right = written(tmp_path / "right", ROWS)
    for models, said in (
        ([str(wrong)], "unknown term 'gamma'"),
        (["coefficients", str(right)], "several models of the coefficients; give one at a time"),
    ):
        flags = [x for model in models for x in ("--model", model)]
        assert main(["identify", str(table), "--aircraft", NAME, *flags]) == 2
        assert said in capsys.readouterr().err
