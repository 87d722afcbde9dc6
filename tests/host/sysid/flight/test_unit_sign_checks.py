"""Identities of motion: every wrong unit, sign or clock of a flight is refused or told."""

from collections.abc import Callable

import numpy as np
import pytest
from host.cli import main
from host.sysid.flight.flight_tables import read_columns
from host.sysid.flight.unit_sign_checks import check
from host.sysid.identification_error import IdentificationError

Columns = dict[str, np.ndarray]
DEG = 180.0 / np.pi
SHORT = ("t_s", "airspeed_mps", "alpha_rad", "q_radps", "elevator_rad")


@pytest.fixture(scope="module")
def flights(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Columns]:
    """One flight in calm air and one in light turbulence, all tolerances of sensors drawn."""
    found = {}
    for card in ("calm", "demo"):
        folder = tmp_path_factory.mktemp(card)
        options = ["--seed", "5", "--firmware", "none", "--no-picture", "-o", str(folder)]
        assert main(["simulate", card, *options]) == 0
        found[card], notes = read_columns(folder / "flight.csv")
        assert notes == []
    return found


@pytest.fixture(scope="module")
def flight(flights: dict[str, Columns]) -> Columns:
    return flights["demo"]


def times(name: str, factor: float) -> Callable[[Columns], Columns]:
    return lambda c: {**c, name: c[name] * factor}


def swapped(one: str, other: str) -> Callable[[Columns], Columns]:
    return lambda c: {**c, one: c[other], other: c[one]}


def only(
    names: tuple[str, ...], then: Callable[[Columns], Columns]
) -> Callable[[Columns], Columns]:
    return lambda c: then({k: c[k] for k in names})


REFUSED: dict[str, tuple[Callable[[Columns], Columns], str]] = {
    "p converted twice": (times("p_radps", 1 / DEG), "phi_rad moves 5.* as fast as p_radps"),
    "q converted twice": (times("q_radps", 1 / DEG), "theta_rad moves 5.* as fast as q_radps"),
    "q turned round": (times("q_radps", -1.0), "theta_rad and q_radps turn opposite ways"),
    "psi turned round": (times("psi_rad", -1.0), "psi_rad and r_radps turn opposite ways"),
    "alpha converted twice": (times("alpha_rad", 1 / DEG), r"alpha_rad moves 0\.0.* q_radps"),
    "beta converted twice": (times("beta_rad", 1 / DEG), r"beta_rad moves 0\.0.* r_radps"),
    "az in g, ay not": (times("az_mps2", 1 / 9.80665), "in g"),
    "half the time": (times("t_s", 0.5), "theta_rad moves 2.* as fast as q_radps"),
    "twice the time": (times("t_s", 2.0), r"theta_rad moves 0\.5.* as fast as q_radps"),
    "minutes": (times("t_s", 1 / 60.0), "theta_rad moves .* as fast as q_radps"),
    "knots": (
        lambda c: {k: v * (1.944 if k == "airspeed_mps" else 1.0) for k, v in c.items()
                   if k not in ("qbar_pa", "density_kgpm3")},
        "as fast as .* over airspeed_mps",
    ),
    "throttle in percent": (times("throttle", 100.0), "throttle is .* of full"),
    "static pressure in hPa": (times("static_pa", 0.01), "static_pa is 1.* Pa"),
    "rudder in degrees": (times("rudder_rad", DEG), "rudder_rad reaches .* in degrees"),
    "airspeed below zero": (times("airspeed_mps", -1.0), "not above zero"),
}  # fmt: skip
# Gusts hide these.
REFUSED_IN_CALM: dict[str, tuple[Callable[[Columns], Columns], str]] = {
    "ax turned round": (times("ax_mps2", -1.0), "airspeed_mps and ax_mps2 turn opposite ways"),
    "ax in g": (times("ax_mps2", 1 / 9.80665), "airspeed_mps moves .* as fast as ax_mps2"),
    "alpha twice, alone": (only(SHORT, times("alpha_rad", 1 / DEG)), "as fast as q_radps"),
    "alpha turned alone": (only(SHORT, times("alpha_rad", -1.0)), "alpha_rad and q_radps turn"),
}
TOLD: dict[str, tuple[Callable[[Columns], Columns], str]] = {
    "p for q": (swapped("p_radps", "q_radps"), "theta_rad does not follow q_radps"),
    "phi for theta": (swapped("phi_rad", "theta_rad"), "theta_rad does not follow q_radps"),
    "alpha for beta": (swapped("alpha_rad", "beta_rad"), "alpha_rad does not follow"),
    "elevator converted twice": (times("elevator_rad", 1 / DEG), "elevator_rad moves by 0.1"),
}


def test_a_flight_as_it_is_passes(flight: Columns) -> None:
    assert check({k: flight[k] for k in SHORT}) == []
    rng, shape = np.random.default_rng(1), flight["t_s"].shape  # wings level, nothing but noise
    noise = {"theta_rad": 1e-3, "q_radps": 3e-3}
    level = {k: s * rng.standard_normal(shape) for k, s in noise.items()}
    assert check({**{k: flight[k] for k in ("t_s", "airspeed_mps")}, **level}) == []
    slow = {k: v[::10] for k, v in flight.items()}  # 10 Hz
    assert check(slow) == []


@pytest.mark.parametrize("case", REFUSED)
def test_what_kinematics_forbids_is_refused(case: str, flight: Columns) -> None:
    change, words = REFUSED[case]
    with pytest.raises(IdentificationError, match=words):
        check(change(flight))


@pytest.mark.parametrize("case", REFUSED_IN_CALM)
def test_what_only_calm_air_shows_is_refused(case: str, flights: dict[str, Columns]) -> None:
    change, words = REFUSED_IN_CALM[case]
    with pytest.raises(IdentificationError, match=words):
        check(change(flights["calm"]))


@pytest.mark.parametrize("case", TOLD)
def test_what_no_law_forbids_is_told(case: str, flight: Columns) -> None:
    change, words = TOLD[case]
    assert any(words in note for note in check(change(flight))), check(change(flight))
