"""Mean and spreads of a type: against statsmodels, against a dense covariance, against truth."""

from dataclasses import astuple, replace

import numpy as np
import pytest
from host.fleet.statistics.loaded_flight import LoadedFlight, fleet_estimates
from host.fleet.statistics.reference_cg import about_cg
from host.fleet.statistics.spread_intervals import type_effect
from host.fleet.statistics.type_model import type_model
from host.fleet.statistics.variance_components import FleetEstimates, reduced


def fleet(aircraft: int, flights: int, between: float, seed: int) -> FleetEstimates:
    """Return a fleet whose flights have no error of estimation."""
    rng = np.random.default_rng(seed)
    codes = np.repeat(np.arange(aircraft), flights)
    value = 5.0 + between * rng.standard_normal(aircraft)[codes]
    value += 0.5 * rng.standard_normal(len(codes))
    none = np.zeros((len(codes), 0))
    return FleetEstimates(value, np.zeros(len(codes)), codes, none, none)


@pytest.mark.parametrize(("aircraft", "flights"), [(5, 3), (8, 8), (12, 4)])
def test_the_peer_finds_the_same_mean_and_spreads(aircraft: int, flights: int) -> None:
    from statsmodels.regression.mixed_linear_model import MixedLM

    data = fleet(aircraft, flights, 0.7, 1)
    found = type_effect(data)
    peer = MixedLM(data.value, np.ones((data.flights, 1)), data.aircraft).fit(reml=True)
    assert found.mean.value == pytest.approx(float(peer.params[0]), rel=1e-6)
    assert found.between.value == pytest.approx(float(np.sqrt(peer.cov_re[0, 0])), rel=1e-3)
    assert found.within.value == pytest.approx(float(np.sqrt(peer.scale)), rel=1e-3)
    assert found.mean_deviation == pytest.approx(float(peer.bse[0]), rel=1e-3)


def test_sums_over_aircraft_are_the_dense_restricted_likelihood() -> None:
    rng = np.random.default_rng(3)
    codes = np.repeat(np.arange(4), [2, 5, 1, 3])
    count = len(codes)
    data = FleetEstimates(
        rng.standard_normal(count) + 100.0,
        rng.uniform(0.1, 1.0, count),
        codes,
        rng.standard_normal((count, 2)),
        rng.standard_normal((count, 1)),
    )
    same = codes[:, None] == codes
    covariance = np.diag(data.variance + 0.3) + 0.7 * same + data.shared @ data.shared.T
    covariance += same * (data.local @ data.local.T)
    inverse, ones = np.linalg.inv(covariance), np.ones(count)
    information = float(ones @ inverse @ ones)
    mean = float(ones @ inverse @ data.value) / information
    left = data.value - mean
    found = reduced(data, 0.7, 0.3)
    assert found.information == pytest.approx(information)
    assert found.mean == pytest.approx(mean)
    assert found.quadratic == pytest.approx(float(left @ inverse @ left))
    assert found.log_determinant == pytest.approx(float(np.linalg.slogdet(covariance)[1]))


@pytest.mark.parametrize("between", [0.0, 0.5, 2.0])
def test_intervals_of_five_aircraft_hold(between: float) -> None:
    """Twelve fleets: of 36 intervals of 95 % each at least 31 hold. More: `studies.fleet_truth`."""
    held, zero = [], []
    for seed in range(12):
        data = fleet(5, 3, 0.5 * between, 100 + seed)
        found = type_effect(data)
        held += [
            found.mean.holds(5.0), found.between.holds(0.5 * between), found.within.holds(0.5)
        ]  # fmt: skip
        zero.append(found.between.lower == 0.0)
    assert sum(held) >= 31
    if between == 0.0:
        assert sum(zero) >= 10


def test_aircraft_more_alike_than_chance_makes_them_still_may_differ_a_little() -> None:
    """No variance has such squares: the interval was 0 to 0."""
    codes, none = np.repeat(np.arange(6), 4), np.zeros((24, 0))
    value = np.tile([4.0, 4.5, 5.5, 6.0], 6) + 0.01 * codes
    found = type_effect(FleetEstimates(value, np.full(24, 0.5), codes, none, none)).between
    assert found.value == found.lower == 0.0
    assert 0.1 < found.upper < 1.5


def flight(aircraft: str, value: float, source: str, loading: float) -> LoadedFlight:
    return LoadedFlight(
        aircraft=aircraft,
        names=("Cm_q",),
        values=np.array([value]),
        own=np.array([[0.01]]),
        sources=((source, "alpha_scale"),),
        loadings=np.array([[loading]]),
        conditions={"alpha_rad": 0.1},
    )


def test_an_error_that_all_aircraft_share_does_not_average_out() -> None:
    rng = np.random.default_rng(5)
    values = (-10.0 + 0.2 * rng.standard_normal(40)).tolist()
    one = [flight(f"N{k % 10}", v, "one file", 0.5) for k, v in enumerate(values)]
    alone = [flight(f"N{k % 10}", v, "none", 0.0) for k, v in enumerate(values)]
    shared, none = (type_effect(fleet_estimates(f, "Cm_q")) for f in (one, alone))
    assert shared.shared_deviation == pytest.approx(0.5, rel=1e-6)
    assert shared.mean.width > 2.0 * 1.9 * 0.5
    assert shared.between.value == pytest.approx(none.between.value, abs=1e-3)


def test_errors_of_as_many_calibrations_as_aircraft_average_out_and_are_no_spread() -> None:
    rng = np.random.default_rng(5)
    wrong = 0.5 * rng.standard_normal(10)
    values = (-10.0 + np.tile(wrong, 4) + 0.2 * rng.standard_normal(40)).tolist()
    own = [flight(f"N{k % 10}", v, f"file {k % 10}", 0.5) for k, v in enumerate(values)]
    blind = [flight(f"N{k % 10}", v, "none", 0.0) for k, v in enumerate(values)]
    each, none = (type_effect(fleet_estimates(f, "Cm_q")) for f in (own, blind))
    assert each.shared_deviation == 0.0
    assert each.mean.width < 1.0
    assert none.between.lower > 0.2
    assert each.between.lower == 0.0
    assert each.between.upper < none.between.upper


def test_loadings_that_go_with_the_estimate_do_not_draw_the_mean_down() -> None:
    rng = np.random.default_rng(6)
    values = 10.0 + rng.standard_normal(40)
    flights = [flight(f"N{k % 10}", v, "the type", 0.2 * v) for k, v in enumerate(values.tolist())]
    found = fleet_estimates(flights, "Cm_q")
    kept = type_effect(found).mean
    raw = type_effect(replace(found, shared=0.2 * found.value[:, None])).mean
    assert raw.value < values.mean() - 0.5  # Peelle's puzzle
    assert kept.value == pytest.approx(float(values.mean()), abs=0.05)
    assert 0.5 * kept.width == pytest.approx(1.96 * 2.0, rel=0.1)  # a fifth, shared by all


@pytest.mark.parametrize("seed", [0, 2])
def test_a_wild_flight_that_says_it_tells_nothing_changes_nothing(seed: int) -> None:
    rng, codes = np.random.default_rng(seed), np.repeat(np.arange(8), 6)
    value = 5.0 + 0.5 * rng.standard_normal(8)[codes]
    value += np.hypot(0.3, 0.3) * rng.standard_normal(48)
    own, none = np.full(48, 0.3), np.zeros((48, 0))
    still = type_effect(FleetEstimates(value, own**2, codes, none, none))
    value[7], own[7] = 3000.0, 2000.0
    wild = type_effect(FleetEstimates(value, own**2, codes, none, none))
    for name in ("mean", "between", "within"):
        ends = [astuple(getattr(effect, name)) for effect in (still, wild)]
        assert ends[1] == pytest.approx(ends[0], rel=0.1, abs=0.03), name


def test_a_flight_is_left_out_by_a_finding_only() -> None:
    flights = [flight(f"N{k % 3}", -10.0 + 0.1 * k, "a", 0.1) for k in range(9)]
    doubted = LoadedFlight(
        **{
            **{n: getattr(flights[0], n) for n in LoadedFlight.__dataclass_fields__},
            "values": np.array([-99.0]),
            "left_out": frozenset({"Cm_q"}),
        }
    )
    assert type_model("t", [*flights, doubted]).effects["Cm_q"].flights == 9
    wild = LoadedFlight(**{
        **{n: getattr(flights[0], n) for n in LoadedFlight.__dataclass_fields__},
        "values": np.array([-99.0]),
    })  # fmt: skip
    assert type_model("t", [*flights, wild]).effects["Cm_q"].flights == 10


def test_moments_about_another_cg_come_back() -> None:
    names = ("CL_alpha", "CL_q", "CD_alpha", "CD_q", "Cm_alpha", "Cm_q", "CY_beta", "CY_r",
             "Cn_beta", "Cn_r")  # fmt: skip
    values = np.array([5.0, 8.0, 0.3, 0.1, -1.0, -12.0, -0.5, 0.2, 0.08, -0.1])
    at = {"alpha_rad": 0.0, "lift": 0.0, "drag": 0.0, "chord_m": 0.25, "span_m": 1.25}
    one = LoadedFlight(
        "N1", names, values, np.eye(10), (("a", "b"),), np.ones((1, 10)), conditions=at
    )
    there = about_cg(one, (0.025, 0.0, 0.0))  # 10 % of the chord ahead
    table = dict(zip(names, there.values.tolist(), strict=True))
    assert table["Cm_alpha"] == pytest.approx(-1.0 - 0.1 * 5.0)  # steadier about a point ahead
    assert table["CL_q"] == pytest.approx(8.0 + 2.0 * 0.1 * 5.0)
    assert table["Cn_beta"] == pytest.approx(0.08 + 0.02 * 0.5)
    back = about_cg(there, (-0.025, 0.0, 0.0))
    assert back.values == pytest.approx(values)
    assert back.own == pytest.approx(one.own)
    assert back.loadings == pytest.approx(one.loadings)
