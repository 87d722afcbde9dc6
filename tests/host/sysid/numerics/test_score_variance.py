"""A residual larger than counted on widens what it explains, by what it explains."""

import numpy as np
import pytest
from host.sysid.models import Maneuver
from host.sysid.numerics import ArNoise, OutputProblem
from host.sysid.numerics.score_variance import variance_ratio
from studies.inputs import multistep_3211
from studies.navion import navion_structured

DT_S, DEVIATION = 0.05, 0.01


def ratios(times: dict[str, float], larger: tuple[str, ...]) -> dict[str, float]:
    """Return the ratio of each parameter; outputs have white noise of so many times the counted."""
    model = navion_structured()
    theta = np.concatenate([model.start, np.zeros(4)])
    u = multistep_3211(0.05, DT_S, 60.0)
    blank = OutputProblem(model, [Maneuver(DT_S, u, np.zeros((len(u), 4)))]).respond(theta)
    assert blank is not None
    noise = DEVIATION * np.random.default_rng(3).standard_normal((len(u), 4))
    noise *= [times.get(name, 1.0) for name in model.outputs]
    problem = OutputProblem(model, [Maneuver(DT_S, u, blank[0].y.T + noise)])
    responses = problem.respond(theta)
    assert responses is not None
    found = variance_ratio(
        problem, responses, [ArNoise.white()] * 4, np.full(4, DEVIATION**2), larger
    )
    return dict(zip(problem.names, found.tolist(), strict=True))


def test_noise_as_counted_on_changes_nothing() -> None:
    assert all(one == pytest.approx(1.0, rel=1e-6) for one in ratios({}, ()).values())


def test_twice_the_noise_of_every_output_is_four_times_the_variance() -> None:
    names = navion_structured().outputs
    found = ratios(dict.fromkeys(names, 2.0), names)
    assert np.mean(list(found.values())) == pytest.approx(4.0, rel=0.4)


def test_one_output_widens_no_parameter_by_more_than_its_own_excess() -> None:
    """The ratio of two optimal covariances that was taken before had no such end."""
    name = navion_structured().outputs[0]
    found = ratios({name: 3.0}, (name,))
    assert max(found.values()) > 2.0
    assert max(found.values()) < 9.0 * 1.6
    assert min(found.values()) < 1.5
