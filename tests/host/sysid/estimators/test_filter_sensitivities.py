"""Slopes of filter error against differences, and where its search may end."""

import numpy as np
import pytest
from host.errors import IdentificationError
from host.sysid.estimators import filter_error
from host.sysid.estimators.filter_error import fit_filter_error, near_its_optimum
from host.sysid.estimators.gust_model import gust_model
from host.sysid.models import LinearModel, Maneuver, Trim, template
from host.sysid.numerics import FilterProblem, InnovationLikelihood, OutputProblem

KNOWN = {"Z_alpha": -8.0, "M_alpha": -60.0, "M_q": -8.0, "M_de": -70.0, "Z_de": -0.5}
KNOWN |= {"D_V": -0.2, "D_alpha": -5.0, "Z_V": -0.07, "imu_x_m": 0.02, "imu_z_m": -0.01}


def aircraft() -> LinearModel:
    """Return an aircraft with accelerometers on arms and biases."""
    trim = Trim(17.0, 0.05, 0.05)
    base = template("longitudinal", trim, accelerometers=True, delays=(), imu_sd_m=0.02)
    return base.with_start([KNOWN.get(p.name, 0.0) for p in base.parameters])


def gusty_aircraft() -> LinearModel:
    """Return the same with a gust."""
    return gust_model(aircraft(), 17.0)


def flown(model: LinearModel, seeds: tuple[int, ...]) -> list[Maneuver]:
    """Return doublets with noise that remembers, so that both kinds of noise are there."""
    result = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        t = np.arange(0.0, 4.0, 0.02)
        u = 0.05 * (np.sign(t - 1.0) - 2.0 * np.sign(t - 1.5) + np.sign(t - 2.0))[:, None]
        empty = Maneuver(0.02, u, np.zeros((len(t), len(model.outputs))))
        problem = OutputProblem(model, [empty])
        y = problem.outputs(problem.first_guess())
        assert y is not None
        drift = np.cumsum(rng.standard_normal(y[0].shape), axis=1)
        noise = rng.standard_normal(y[0].shape) + 0.2 * drift
        outputs = y[0] + 0.05 * np.std(y[0], axis=1)[:, None] * noise
        result.append(Maneuver(0.02, u, outputs.T))
    return result


def vector(problem: FilterProblem) -> np.ndarray:
    """Return unknowns away from any optimum."""
    rng = np.random.default_rng(3)
    theta = problem.output_problem.first_guess()
    theta += 0.03 * (np.abs(theta) + 0.01) * rng.standard_normal(len(theta))
    deviation = np.std(np.vstack([m.outputs for m in problem.maneuvers]), axis=0)
    return np.concatenate([theta, np.log([0.03, 0.3]), np.log(0.1 * deviation)])


def known(point: InnovationLikelihood | None) -> InnovationLikelihood:
    """Return a point that must be there."""
    assert point is not None
    return point


def test_gradient_is_that_of_differences_where_a_gust_dies_away_within_a_sample() -> None:
    """Slopes of its process noise were rounding, times 1e38."""
    model = gust_model(aircraft(), 17.0, scale_m=0.01)
    problem = FilterProblem(model, flown(model, (1,)), ("gust_rad", "airspeed_mps"))
    theta = vector(problem)
    here = known(problem.evaluate(theta))
    information, gradient = problem.total(theta, *problem.scoring(theta, here))
    for name in ("Z_alpha", "M_q", "log_process.gust_rad"):
        k, width = problem.names.index(name), np.zeros(len(theta))
        width[k] = 1e-3 / np.sqrt(information[k, k])
        up, down = (known(problem.evaluate(theta + s * width)) for s in (1.0, -1.0))
        slope = (down.cost - up.cost) / (2.0 * width[k])
        assert gradient[k] == pytest.approx(slope, rel=1e-3), name


def test_gradient_and_information_are_those_of_differences() -> None:
    model = gusty_aircraft()
    problem = FilterProblem(model, flown(model, (1, 2)), ("gust_rad", "airspeed_mps"))
    theta = vector(problem)
    here = known(problem.evaluate(theta))
    information, gradient = problem.total(theta, *problem.scoring(theta, here))
    size = np.sqrt(np.diag(information))
    white, spread, slope = [], [], []
    for k in range(len(theta)):
        width = np.zeros(len(theta))
        width[k] = 1e-4 / max(size[k], 1e-3)
        up, down = (known(problem.evaluate(theta + s * width)) for s in (1.0, -1.0))
        slope.append((down.cost - up.cost) / (2.0 * width[k]))
        W = here.filters[0].whitener
        moved = [(a - b) / (2.0 * width[k]) @ W.T for a, b in zip(up.e, down.e, strict=True)]
        white.append(np.concatenate(moved).ravel())
        spread.append((W @ (up.filters[0].S - down.filters[0].S) @ W.T / (2.0 * width[k])).ravel())
    J, L = np.array(white), np.array(spread)
    exact = np.vstack([s.reshape(-1, len(theta)) for s in problem.whitened_slopes(theta, here)])
    np.testing.assert_allclose(exact / size, J.T / size, atol=1e-6)
    expected = J @ J.T + 0.5 * problem.output_problem.samples * L @ L.T
    expected[: problem.n_model, : problem.n_model] += np.diag(
        problem.output_problem.prior_precision
    )
    np.testing.assert_allclose(gradient / size, np.array(slope) / size, atol=1e-3)
    assert np.max(np.abs(gradient / size)) > 10.0
    np.testing.assert_allclose(
        information / np.outer(size, size), expected / np.outer(size, size), atol=1e-5
    )


@pytest.mark.parametrize("share", [0.3, 3.0])
def test_the_answer_does_not_hang_on_the_start(share: float) -> None:
    model = gusty_aircraft()
    maneuvers = flown(model, (4, 5))
    process = ("gust_rad", "airspeed_mps")
    start = OutputProblem(model, maneuvers).first_guess()
    reference = fit_filter_error(
        model, maneuvers, process=process, start=start, compare_noise=False
    )
    start[: len(model.parameters)] *= 1.0 + 0.1 * share
    other = fit_filter_error(model, maneuvers, process=process, start=start, compare_noise=False)
    assert reference.converged
    assert other.converged
    common = slice(0, len(model.parameters))
    step = (other.estimate - reference.estimate)[common] / reference.standard_error[common]
    assert np.max(np.abs(step)) < 0.1


def test_a_search_that_must_end_makes_no_result_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(filter_error, "MAX_ITERATIONS", 1)
    model = gusty_aircraft()
    maneuvers, process = flown(model, (4,)), ("gust_rad", "airspeed_mps")
    start = OutputProblem(model, maneuvers).first_guess()
    early = fit_filter_error(model, maneuvers, process=process, start=start, compare_noise=False)
    assert not near_its_optimum(early)
    with pytest.raises(IdentificationError, match="no convergence: last step"):
        fit_filter_error(model, maneuvers, process=process, start=start, must_end=True)
