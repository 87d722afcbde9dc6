"""The restricted likelihood of filter error: the constants of every maneuver integrated out."""

from dataclasses import replace

import numpy as np
import pytest
from host.sysid.estimators.filter_error import fit_filter_error
from host.sysid.models import LinearModel, Maneuver, Parameter, Term
from host.sysid.numerics import FilterProblem
from host.sysid.numerics.restricted_likelihood import restricted_slopes

DT_S, RECORD_S, RECORDS = 0.02, 2.5, 8
L_P, LAG, L_DA, GUST, GYRO_RADPS = -16.0, 5.0, 150.0, 0.5, 0.003
PROCESS = ("gust_roll_radps",)


def _rolling() -> LinearModel:
    """Return roll in air that rolls: the gust acts like a roll rate and has a lag of its own."""
    return LinearModel(
        name="roll in rolling air",
        states=("p_radps", *PROCESS),
        inputs=("aileron_rad",),
        outputs=("p_radps",),
        A=np.zeros((2, 2)),
        B=np.zeros((2, 1)),
        C=np.array([[1.0, 0.0]]),
        D=np.zeros((1, 1)),
        terms=(
            Term("A", 0, 0, "L_p"),
            Term("A", 0, 1, "L_p"),
            Term("A", 1, 1, "lag_radps", -1.0),
            Term("B", 0, 0, "L_da"),
        ),
        parameters=(
            Parameter("L_p", L_P),
            Parameter("lag_radps", LAG, lower=0.1),
            Parameter("L_da", L_DA),
        ),
        state_biases=("p_radps",),
        initial_states=("p_radps",),
        hold="zoh",
    )


def _flown(seed: int, strength: float = GUST) -> Maneuver:
    """Fly a doublet every `RECORD_S`; the air moves already when the first begins."""
    rng = np.random.default_rng(seed)
    samples, fine = round(RECORD_S / DT_S), 10
    aileron = np.zeros(RECORDS * samples)
    for first in range(0, len(aileron), samples):
        aileron[first + 25 : first + 45], aileron[first + 45 : first + 65] = 0.05, -0.05
    step = DT_S / fine
    p, gust, rolled = 0.0, strength / np.sqrt(2.0 * LAG) * rng.standard_normal(), []
    for da in aileron:
        rolled.append(p)
        for kick in strength * np.sqrt(step) * rng.standard_normal(fine):
            p += step * (L_P * (p + gust) + L_DA * da)
            gust += kick - step * LAG * gust
    measured = np.array(rolled) + GYRO_RADPS * rng.standard_normal(len(rolled))
    return Maneuver(DT_S, aileron[:, None], measured[:, None])


def _cut(whole: Maneuver) -> list[Maneuver]:
    pairs = zip(np.split(whole.inputs, RECORDS), np.split(whole.outputs, RECORDS), strict=True)
    return [Maneuver(DT_S, u, y) for u, y in pairs]


@pytest.mark.parametrize("growth_radps", [0.0, 8.0])
def test_all_noise_alike_takes_one_for_every_constant(growth_radps: float) -> None:
    """ln det (X' S^-1 X) / 2 falls by one for each constant where S grows by e^2, whatever the
    aircraft: one that diverges too, and records of two lengths."""
    records = _cut(_flown(1))[:3]
    records[1] = Maneuver(DT_S, records[1].inputs[:90], records[1].outputs[:90])
    problem = FilterProblem(_rolling(), records, PROCESS)
    theta = problem.output_problem.first_guess()
    theta[0] = growth_radps or L_P
    theta = np.concatenate([theta, np.log([0.7 * GUST, 2.0 * GYRO_RADPS])])
    bounds = np.full(len(theta), 0.1)
    bounds[1] = 0.0
    found = restricted_slopes(problem, theta, bounds)
    np.testing.assert_allclose(found[:, -2:].sum(axis=1), -2.0, rtol=2e-3)
    assert not found[:, 1].any()
    assert np.all(found[:, 0] != 0.0)
    assert found[0, 0] == found[2, 0] != found[1, 0]


def test_constants_that_cannot_be_told_apart_change_nothing() -> None:
    """A bank angle that nothing measures, of an aircraft that rights itself, starts anywhere."""
    rolling = _rolling()
    model = replace(
        rolling,
        states=(*rolling.states, "phi_rad"),
        A=np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, -0.5]]),
        B=np.zeros((3, 1)),
        C=np.array([[1.0, 0.0, 0.0]]),
        initial_states=("p_radps", "phi_rad"),
    )
    records = _cut(_flown(1))
    problem = FilterProblem(model, records, PROCESS)
    theta = np.concatenate(
        [problem.output_problem.first_guess(), np.log([0.7 * GUST, 2.0 * GYRO_RADPS])]
    )
    assert not restricted_slopes(problem, theta, np.ones(len(theta))).any()
    plain, same = (
        fit_filter_error(model, records, process=PROCESS, compare_noise=False, restricted=r)
        for r in (False, True)
    )
    np.testing.assert_array_equal(plain.estimate, same.estimate)


def test_noise_that_is_not_there_makes_no_maneuver_disagree() -> None:
    """Its deviation is on its bound: a hundredth of what is open there was no small step."""
    records = _cut(_flown(1, strength=0.0))
    found = fit_filter_error(
        _rolling(), records, process=PROCESS, compare_noise=False, restricted=True
    )
    influence = found.details["maneuver_influence"]
    assert isinstance(influence, np.ndarray)
    assert np.max(np.abs(influence[:, :3] / found.standard_error[:3])) < 2.0
