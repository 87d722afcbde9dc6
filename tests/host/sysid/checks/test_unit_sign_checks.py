"""Identities of motion: every wrong unit, sign or clock of a flight is found, and told."""

import itertools
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from host.readers.column_map import UNITS
from host.sysid.checks import CHECKS, Finding, checked, open_channels
from host.sysid.checks.side_force import unlikely_factors
from host.sysid.checks.unit_sign_checks import SURFACES, check
from host.sysid.flight import read_columns
from studies.foreign.flight import Air, fly

Columns = dict[str, np.ndarray]
DEG = 180.0 / np.pi
SHORT = ("t_s", "airspeed_mps", "alpha_rad", "q_radps", "elevator_rad")


@pytest.fixture(scope="module")
def flights(simulated: Callable[[str, int], Path]) -> dict[str, Columns]:
    """One flight in calm air and one in light turbulence, all tolerances of sensors drawn."""
    found = {}
    for card in ("calm", "demo"):
        found[card], notes = read_columns(simulated(card, 5) / "flight.csv")
        assert notes == []
    return found


@pytest.fixture(scope="module")
def foreign() -> Columns:
    """A flight of a simulator that is not ours, in calm air, with white noise of its sensors."""
    return fly(Air(), 17022)[0]


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


PROVEN: dict[str, tuple[Callable[[Columns], Columns], str]] = {
    "p converted twice": (times("p_radps", 1 / DEG), "phi_rad moves 5.* as fast as p_radps"),
    "q converted twice": (times("q_radps", 1 / DEG), "theta_rad moves 5.* as fast as q_radps"),
    "q turned round": (times("q_radps", -1.0), "theta_rad and q_radps turn opposite ways"),
    "psi turned round": (times("psi_rad", -1.0), "psi_rad and r_radps turn opposite ways"),
    "alpha converted twice": (times("alpha_rad", 1 / DEG), r"alpha_rad moves 0\.0.* q_radps"),
    "beta converted twice": (times("beta_rad", 1 / DEG), r"beta_rad moves 0\.0.* r_radps"),
    "az in g, ay not": (times("az_mps2", 1 / 9.80665), "az_mps2 is -1.* m/s2 .*: give|likely g"),
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
    "rudder in degrees": (times("rudder_rad", DEG), "rudder_rad reaches .* likely degrees"),
    "airspeed below zero": (times("airspeed_mps", -1.0), "not above zero"),
}  # fmt: skip
# Gusts hide these.
PROVEN_IN_CALM: dict[str, tuple[Callable[[Columns], Columns], str]] = {
    "ax turned round": (times("ax_mps2", -1.0), "airspeed_mps and ax_mps2 turn opposite ways"),
    "ax in g": (times("ax_mps2", 1 / 9.80665), "airspeed_mps moves .* as fast as ax_mps2"),
    "alpha twice, alone": (only(SHORT, times("alpha_rad", 1 / DEG)), "as fast as q_radps"),
    "alpha turned alone": (only(SHORT, times("alpha_rad", -1.0)), "alpha_rad and q_radps turn"),
}
IN_DOUBT: dict[str, tuple[Callable[[Columns], Columns], str]] = {
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


@pytest.mark.parametrize(("begin_s", "end_s"), [(4.0, 5.5), (4.0, 6.0), (14.0, 19.0), (43.0, 45.0)])
def test_noise_of_a_short_record_is_no_finding(
    begin_s: float, end_s: float, foreign: Columns
) -> None:
    """Its slopes are those of single samples: noise, which no rate explains."""
    inside = (foreign["t_s"] >= begin_s) & (foreign["t_s"] < end_s)
    assert check({k: v[inside] for k, v in foreign.items()}) == []


def lines(findings: list[Finding]) -> str:
    return "\n".join(finding.line for finding in findings)


@pytest.mark.parametrize("about", list(itertools.product((-0.03, 0.03), (-0.03, 0.03))))
def test_without_vanes_a_tilted_imu_is_no_finding(
    about: tuple[float, float], flights: dict[str, Columns]
) -> None:
    """Lift and side force lean into ax by 1.7 deg about y and z; its unit is found as before."""
    calm = {k: v for k, v in flights["calm"].items() if k not in ("alpha_rad", "beta_rad")}
    pitched, yawed = about
    leaning = calm["ax_mps2"] - pitched * calm["az_mps2"] + yawed * calm["ay_mps2"]
    assert check({**calm, "ax_mps2": leaning}) == []
    [found] = check({**calm, "ax_mps2": leaning / 9.80665})
    assert found.check == "airspeed-against-ax"


@pytest.mark.parametrize("case", PROVEN)
def test_what_kinematics_forbids_is_a_proven_finding(case: str, flight: Columns) -> None:
    change, words = PROVEN[case]
    proven = [f for f in check(change(flight)) if f.wrong_unit]
    assert re.search(words, lines(proven)), lines(proven)
    assert all(f.check in CHECKS for f in proven)


@pytest.mark.parametrize("case", PROVEN_IN_CALM)
def test_what_only_calm_air_shows_is_a_proven_finding(
    case: str, flights: dict[str, Columns]
) -> None:
    change, words = PROVEN_IN_CALM[case]
    proven = [f for f in check(change(flights["calm"])) if f.wrong_unit]
    assert re.search(words, lines(proven)), lines(proven)


@pytest.mark.parametrize("case", IN_DOUBT)
def test_what_no_law_forbids_is_in_doubt(case: str, flight: Columns) -> None:
    change, words = IN_DOUBT[case]
    found = check(change(flight))
    assert words in lines(found), lines(found)
    assert open_channels(found)


# The column that is wrong, and by what its reading shall bring it back.
READ: dict[str, tuple[str, float]] = {
    "p converted twice": ("p_radps", DEG),
    "q converted twice": ("q_radps", DEG),
    "q turned round": ("q_radps", -1.0),
    "psi turned round": ("psi_rad", -1.0),
    "alpha converted twice": ("alpha_rad", DEG),
    "beta converted twice": ("beta_rad", DEG),
    "az in g, ay not": ("az_mps2", 9.80665),
    "throttle in percent": ("throttle", 0.01),
    "static pressure in hPa": ("static_pa", 100.0),
    "rudder in degrees": ("rudder_rad", 1 / DEG),
    "airspeed below zero": ("airspeed_mps", -1.0),
}


@pytest.mark.parametrize("case", READ)
def test_the_unit_that_agrees_with_all_others_is_read(case: str, flight: Columns) -> None:
    name, gain = READ[case]
    wrong = PROVEN[case][0](flight)
    columns, findings = checked(wrong)
    np.testing.assert_allclose(columns[name], wrong[name] * gain, rtol=1e-9)
    assert any(f.wrong_unit and name in f.channels for f in findings)
    assert name in open_channels(findings)  # read otherwise, and still never under trust
    assert f"read as {name}" in lines(findings)
    others = [k for k in wrong if k != name and k in flight]
    assert all(columns[k] is wrong[k] for k in others)


@pytest.mark.parametrize(("unit", "per_mps"), [("kt", 1.94384), ("ft/s", 3.28084)])
def test_noise_of_a_vane_does_not_change_the_unit_read(
    unit: str, per_mps: float, flights: dict[str, Columns]
) -> None:
    """Its slopes scatter; the middle of the range of factors said km/h for both."""
    calm = {k: v for k, v in flights["calm"].items() if k not in ("qbar_pa", "density_kgpm3")}
    rng = np.random.default_rng(17000)
    noise = 0.015 * rng.standard_normal(len(calm["t_s"]))
    noisy = {k: calm[k] + noise for k in ("alpha_rad", "beta_rad")}
    _, findings = checked(times("airspeed_mps", per_mps)(calm | noisy))
    assert f"read as airspeed_mps in {unit} " in lines(findings), lines(findings)


PER_MPS = {"kt": 1.94384, "km/h": 3.6, "mph": 2.23694, "ft/s": 3.28084}


@pytest.fixture(scope="module", params=[("dryden", 0.5, 19401), ("karman", 1.0, 19402)])
def gusty(request: pytest.FixtureRequest) -> Columns:
    """A flight of the simulator that is not ours in gusts, as they turn wind angles and speed."""
    form, intensity_mps, seed = request.param
    return fly(Air(form, intensity_mps, spread=True), seed)[0]


def test_in_gusts_a_right_table_is_not_accused(gusty: Columns) -> None:
    assert check(gusty) == []


@pytest.mark.parametrize("unit", ["km/h", "ft/s"])
def test_in_gusts_the_right_unit_is_among_the_likely_ones(unit: str, gusty: Columns) -> None:
    """By slopes the gusts chose: mph in place of ft/s, an accelerometer in place of knots."""
    wrong = times("airspeed_mps", PER_MPS[unit])(gusty)
    columns, findings = checked(wrong)
    [done] = {f.done for f in findings}
    assert f"airspeed_mps in {unit}" in done
    assert "as likely" in done  # gusts leave more than one
    assert all(f.wrong_unit for f in findings)
    assert "airspeed_mps" in open_channels(findings)
    assert not np.array_equal(columns["airspeed_mps"], wrong["airspeed_mps"])


def test_a_relation_that_a_wrong_unit_made_need_not_stay() -> None:
    """Speed seemed to follow ax turned by alpha of many turns: alpha was never read in degrees."""
    flown = fly(Air("karman", 0.5, spread=True), 19402)[0]
    columns, findings = checked(times("alpha_rad", DEG)(flown))
    assert {f.done for f in findings} == {"read as alpha_rad in deg (times 0.01745)"}
    np.testing.assert_allclose(columns["alpha_rad"], flown["alpha_rad"], rtol=1e-9)


def test_lift_and_side_force_tell_together_what_none_does_alone() -> None:
    """Knots in gusts of 1 m/s: factors of 2 that each alone leaves open."""
    flown = fly(Air("dryden", 1.0), 19401)[0]
    assert check(flown) == []
    _, findings = checked(times("airspeed_mps", PER_MPS["kt"])(flown))
    [found] = findings
    assert "what forces make of it" in found.text
    assert "airspeed_mps in kt" in found.done
    still = {k: np.zeros_like(v) if k in SURFACES else v for k, v in flown.items()}
    assert check(times("airspeed_mps", PER_MPS["kt"])(still)) == []  # gusts alone accuse nothing


def test_a_wind_angle_that_gusts_alone_turn_follows_its_force(gusty: Columns) -> None:
    """Without an elevator's input no rate says how alpha turns; beta in its place is still seen."""
    part = {k: v[2 * len(v) // 3 :] for k, v in gusty.items()}
    assert check(part) == []
    found = check(swapped("alpha_rad", "beta_rad")(part))
    assert "alpha_rad does not follow" in lines(found), lines(found)


def test_a_scale_that_no_unit_makes_is_named_as_such(flights: dict[str, Columns]) -> None:
    calm = flights["calm"]
    _, findings = checked(times("q_radps", 3.0)(calm))
    [found] = [f for f in findings if f.check == "theta-against-q"]
    scale = re.fullmatch(r"a scale of q_radps of ([\d.]+)", found.causes[0])
    assert scale is not None, found.causes
    assert float(scale[1]) == pytest.approx(3.0, rel=0.1)
    assert found.wrong_unit
    assert found.done == "used as it is"
    [in_degrees] = [f for f in check(times("q_radps", DEG)(calm)) if f.check == "theta-against-q"]
    assert in_degrees.causes[0].startswith("another unit of one of them")


def test_no_reading_settles_a_finding_by_hiding_it(flights: dict[str, Columns]) -> None:
    """All gyros times 3: a bank angle times 1000 left nothing that could be compared."""
    rates = ("p_radps", "q_radps", "r_radps")
    wrong = flights["calm"] | {k: 3.0 * flights["calm"][k] for k in rates}
    columns, findings = checked(wrong)
    assert all(columns[k] is wrong[k] for k in columns)
    assert {"theta-against-q", "phi-against-p"} <= {f.check for f in findings if f.wrong_unit}


def test_what_is_accepted_is_used_as_it_is_and_stays_open(flight: Columns) -> None:
    wrong = PROVEN["q turned round"][0](flight)
    accepted = {f.check for f in check(wrong)}
    columns, findings = checked(wrong, accepted)
    assert columns == wrong
    assert all(f.accepted and "accepted" in f.done for f in findings)
    assert any(f.wrong_unit and "q_radps" in f.channels for f in findings)
    assert "q_radps" in open_channels(findings)


def test_degrees_everywhere_are_read_together(flight: Columns) -> None:
    angular = [k for k in flight if k.endswith(("_rad", "_radps"))]
    columns, findings = checked({k: v * (DEG if k in angular else 1.0) for k, v in flight.items()})
    for name in angular:
        np.testing.assert_allclose(columns[name], flight[name], rtol=1e-9, err_msg=name)
    assert any(f.wrong_unit and f.channels for f in findings)


def test_a_doubt_that_another_column_explains_is_none() -> None:
    """Angles in degrees: the airspeed beside them had looked like one in cm/s."""
    right = fly(Air("dryden", 0.5, True, False), 21290)[0]
    assert check(right) == []
    in_degrees = {k: v * (DEG if k.endswith(("_rad", "_radps")) else 1.0) for k, v in right.items()}
    assert any("airspeed_mps" in f.channels for f in check(in_degrees))
    columns, findings = checked(in_degrees)
    np.testing.assert_allclose(columns["alpha_rad"], right["alpha_rad"], rtol=1e-9)
    assert "airspeed_mps" not in open_channels(findings)
    assert "alpha_rad" in open_channels(findings)


def test_exchanged_aileron_and_rudder_are_named(flights: dict[str, Columns]) -> None:
    """Each drives the rate of the other: both stood in the list of what stays silent."""
    for card, flown in flights.items():
        (found,) = check(swapped("aileron_rad", "rudder_rad")(flown))
        assert found.check == "surface-exchanged", card
        assert found.channels == ("aileron_rad", "rudder_rad")
        assert check(flown) == [], card


def test_accelerations_without_weight_are_not_read_in_g(flight: Columns) -> None:
    """In a turn their median is about 1 m/s2, as that of a load factor is."""
    free = flight["az_mps2"] + 9.80665
    changed = flight | {"az_mps2": free - float(np.median(free)) - 1.0}
    _, findings = checked(changed)
    assert not any("mps2 in g" in f.done for f in findings)
    _, findings = checked(times("az_mps2", 1 / 9.80665)(flight))
    assert any("az_mps2 in g" in f.done for f in findings)


def test_an_unusual_side_force_alone_is_no_other_unit() -> None:
    """A Zagi's is a fiftieth of lift, an Aerosonde's over a quarter: neither is in ft/s2."""
    t = np.arange(0.0, 20.0, 0.1)
    for share in (0.02, 0.03, 0.19, 0.28):
        means = {"alpha_rad": np.sin(t), "az_mps2": -100.0 * np.sin(t),
                 "beta_rad": np.cos(t), "ay_mps2": -100.0 * share * np.cos(t)}  # fmt: skip
        unlikely = unlikely_factors(means, (1.0, 1.0 / 3.28084, 3.28084, 9.80665))
        assert unlikely[1.0] - min(unlikely.values()) < 2.0, share  # half a deviation and more


def faults(flight: Columns) -> Iterator[tuple[str, Columns]]:
    """Return every fault of one column that a map makes: units, twice converted, signs, swaps."""
    for name in (k for k in flight if k not in ("t_s", "bridged", "density_kgpm3")):
        for unit, factor in UNITS.get(name.rsplit("_", 1)[-1], {"1": 1.0}).items():
            if factor != 1.0:
                yield f"{name} in {unit}", times(name, 1.0 / factor)(flight)
        if name.endswith(("_rad", "_radps")):
            yield f"{name} converted twice", times(name, 1.0 / DEG)(flight)
        if not name.endswith(("_pa", "throttle")):
            yield f"{name} turned round", times(name, -1.0)(flight)
    for alike in ("pqr", ("ax", "ay", "az"), ("alpha", "beta", "phi", "theta", "psi"), SURFACES):
        names = [k for stem in alike for k in flight if k.split("_")[0] == stem.split("_")[0]]
        for one, other in itertools.combinations(names, 2):
            yield f"{one} for {other}", swapped(one, other)(flight)
    for unit, factor in (("half", 0.5), ("twice", 2.0), ("minutes", 1 / 60.0), ("ms", 1e3)):
        yield f"t_s {unit}", times("t_s", factor)(flight)


def test_most_wrong_lines_of_a_map_are_found(flight: Columns) -> None:
    """What stays silent: ax in ft/s2 or turned, ay in g or ft/s2, ax for ay, some surfaces."""
    silent, count = [], 0
    for label, columns in faults(flight):
        count += 1
        if not check(columns):
            silent.append(label)
    assert count == 96
    assert len(silent) <= 7, silent
