"""Dimensional derivatives to coefficients and back: values, covariance, what cancels."""

from collections.abc import Mapping

import numpy as np
import pytest
from host.aircraft.airframe import Airframe
from host.aircraft.file import load
from host.aircraft.local_derivatives import coefficients as about_cg
from host.aircraft.mass_properties import Condition, airframe_data
from host.arrays import Array
from host.errors import IdentificationError
from host.instrument.deviations import sensor_error_model
from host.instrument.error_list import conversion_errors
from host.sysid.aerodynamics import coefficient_parts, coefficients
from host.sysid.conversion.derivative_conversion import (
    ConversionPoint,
    Quantities,
    consider_deviations,
    to_coefficients,
    to_derivatives,
)
from host.sysid.models import FitResult, free_model

NAME = "ultrastick25e"
AIRFRAME = airframe_data(NAME)
ALPHA = 0.08
PLACE = ConversionPoint(AIRFRAME, Condition(17.0, 177.0), ALPHA)
ERRORS = consider_deviations(AIRFRAME, sensor_error_model(NAME))
TRUE = {
    "CL_alpha": 3.94, "CL_q": 8.0, "CL_de": 0.53, "CD_alpha": 0.30, "CD_de": 0.05,
    "Cm_alpha": -1.65, "Cm_q": -10.9, "Cm_de": -1.27,
    "CY_beta": -0.114, "CY_p": 0.115, "CY_r": 0.12, "CY_da": 0.01, "CY_dr": 0.1,
    "Cl_beta": -0.039, "Cl_p": -0.39, "Cl_r": 0.078, "Cl_da": 0.22, "Cl_dr": 0.001,
    "Cn_beta": 0.057, "Cn_p": -0.026, "Cn_r": -0.065, "Cn_da": 0.003, "Cn_dr": -0.052,
}  # fmt: skip


def given() -> Quantities:
    rng = np.random.default_rng(2)
    values = np.array(list(TRUE.values()))
    root = rng.standard_normal((len(values), len(values))) * 0.01 * np.abs(values)[:, None]
    return Quantities(tuple(TRUE), values, root @ root.T)


def test_there_and_back_is_the_same_with_its_covariance() -> None:
    start = given()
    out = to_derivatives(start, PLACE, ERRORS)
    back = to_coefficients(out, PLACE, {})
    assert back.names == (*TRUE, *conversion_errors())
    np.testing.assert_allclose(back.values[: len(TRUE)], start.values, rtol=1e-12)
    scale = np.sqrt(np.diag(start.covariance))
    gap = back.covariance[: len(TRUE), : len(TRUE)] - start.covariance
    assert np.max(np.abs(gap / np.outer(scale, scale))) < 1e-5
    # Without what they share with mass and inertia the same numbers come back wider.
    alone = Quantities(out.names[: len(TRUE)], out.values[: len(TRUE)],
                       out.covariance[: len(TRUE), : len(TRUE)])  # fmt: skip
    assert to_coefficients(alone, PLACE, ERRORS).deviation("Cm_q") > 1.2 * back.deviation("Cm_q")


def agree(found: Quantities, by_hand: Mapping[str, Array]) -> None:
    """Hold means and covariance against drawn ones, (n,) each."""
    at = [found.names.index(n) for n in by_hand]
    expected = np.cov(np.stack(list(by_hand.values())))
    scale = np.sqrt(np.diag(expected))
    gap = (found.covariance[np.ix_(at, at)] - expected) / np.outer(scale, scale)
    assert np.max(np.abs(gap)) < 0.02, np.round(gap, 3)
    means = np.array([values.mean() for values in by_hand.values()])
    assert np.max(np.abs(found.values[at] - means) / scale) < 0.06


def test_coefficients_of_drawn_derivatives_scatter_as_the_covariance_says() -> None:
    exact, rng = to_derivatives(given(), PLACE, {}), np.random.default_rng(8)
    drawn = rng.multivariate_normal(exact.values, exact.covariance, 200_000).T
    d = dict(zip(exact.names, drawn, strict=True))
    e = {n: sd * rng.standard_normal(drawn.shape[1]) for n, sd in ERRORS.items()}
    a, at = AIRFRAME, PLACE.condition
    qbar = (at.qbar_pa - e["pitot_zero_pa"]) / (1.0 + e["pitot_scale"])
    V = at.airspeed_mps * np.sqrt(qbar / at.qbar_pa / (1.0 + e["density_share"]))
    force = qbar * a.wing_area_m2
    upwash = (1.0 + a.upwash * (1.0 + e["upwash_share"])) / (1.0 + a.upwash)
    ixx, iyy, izz = (
        getattr(a, f"{i}_kgm2") * (1.0 + e[f"{i}_share"]) for i in ("ixx", "iyy", "izz")
    )
    mass, b, c = a.mass_kg * (1.0 + e["mass_share"]), a.span_m, a.chord_m
    side = mass * V * d["Y_r"] / force * 2.0 * V / b
    by_hand = {
        "CL_alpha": -d["Z_alpha"] * mass * V / force * (1.0 + e["alpha_scale"]) * upwash,
        "CD_de": -d["D_de"] * mass / force * (1.0 + e["elevator_scale"]),
        "Cm_q": d["M_q"] * iyy / (force * c) * 2.0 * V / c
        + (e["cg_z_m"] * np.sin(ALPHA) + e["cg_x_m"] * np.cos(ALPHA)) / c
        * (-d["Z_q"] * mass * V / force * 2.0 * V / c),
        "Cl_r": (ixx * d["L_r"] - a.ixz_kgm2 * d["N_r"]) / (force * b) * 2.0 * V / b
        - e["cg_z_m"] * side / b,
        "Cn_r": (izz * d["N_r"] - a.ixz_kgm2 * d["L_r"]) / (force * b) * 2.0 * V / b
        + e["cg_x_m"] * side / b,
    }  # fmt: skip
    agree(to_coefficients(exact, PLACE, ERRORS), by_hand)


def test_moments_go_to_the_nominal_cg_as_the_twin_takes_them_from_it() -> None:
    frame = load(NAME).airframe()
    moved = frame._replace(cg_m=np.array([0.008, 0.0, -0.006]))
    at = np.array([ALPHA, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    labels = ("alpha", "beta", "p", "q", "r", "de", "da", "dr")
    rows = ("CL", "CD", "CY", "Cl", "Cm", "Cn")

    def slopes(of: Airframe) -> dict[str, float]:
        found: dict[str, float] = {}
        for k, label in enumerate(labels):
            step = 1e-5 * np.eye(8)[k]
            rise = (about_cg(of, at + step) - about_cg(of, at - step)) / 2e-5
            found |= {f"{row}_{label}": float(x) for row, x in zip(rows, rise, strict=True)}
        return {n: v for n, v in found.items() if n in TRUE}

    lift, drag = about_cg(frame, at)[:2]
    weight = AIRFRAME.mass_kg * 9.80665
    qbar = float(weight / (lift * AIRFRAME.wing_area_m2))
    place = ConversionPoint(AIRFRAME, Condition(17.0, qbar), ALPHA, float(drag))
    here, there = slopes(frame), slopes(moved)
    none = np.zeros((len(here), len(here)))
    measured = to_derivatives(
        Quantities(tuple(there), np.array(list(there.values())), none), place, {}
    )
    names = (*measured.names, "cg_x_m", "cg_z_m")
    values = np.array([*measured.values, 0.008, -0.006])
    back = to_coefficients(Quantities(names, values, np.zeros((len(names), len(names)))), place, {})
    for name, value in here.items():
        assert back.value(name) == pytest.approx(value, rel=1e-5, abs=1e-7), name
    assert abs(there["Cm_alpha"] - here["Cm_alpha"]) > 0.05


def test_the_linear_answer_converts_by_the_same_equations() -> None:
    out = to_derivatives(given(), PLACE, {})
    some, none = free_model("pitch", ("q_radps",), ("de",)), np.zeros((0, 0))
    many = np.full(len(out.values), 100.0)
    result = FitResult(
        "by hand", some, out.names, out.values, out.covariance, out.covariance, many,
        (), (), "simulation", none, 1, True,
    )  # fmt: skip
    found = {c.name: c for c in coefficients(coefficient_parts(result, AIRFRAME, PLACE.condition))}
    assert set(found) == set(TRUE)
    for name, value in TRUE.items():
        assert found[name].value == pytest.approx(value, rel=1e-9), name
        assert found[name].fit_error == pytest.approx(given().deviation(name), rel=1e-5), name


def test_what_is_wrong_is_said() -> None:
    with pytest.raises(IdentificationError, match="unknown error luck"):
        to_derivatives(given(), PLACE, {"luck": 1.0})
    with pytest.raises(IdentificationError, match="nothing to convert among phi_rad"):
        to_coefficients(Quantities(("phi_rad",), np.zeros(1), np.eye(1)), PLACE, ERRORS)
