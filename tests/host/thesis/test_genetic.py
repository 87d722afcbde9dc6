"""The genetic search, from far away."""

import dataclasses

import numpy as np
import pytest
from host.sysid import fit
from studies.data import TRUTH, noisy
from studies.navion import navion_structured


@pytest.mark.costs(20, "sixty generations of a search")
def test_genetic_search_finds_the_valley_from_far_away() -> None:
    far = navion_structured().with_start(np.array([0, 0, 0, -1, 0, -1, -1, 0, -1.0]))
    bounded = dataclasses.replace(
        far,
        parameters=tuple(
            dataclasses.replace(p, lower=-3.0 * abs(t) - 0.01, upper=3.0 * abs(t) + 0.01)
            for p, t in zip(far.parameters, TRUTH, strict=True)
        ),
    )
    result = fit("genetic", bounded, [noisy(14)], generations=30)
    reference = fit("output-error", navion_structured(), [noisy(14)])
    miss = np.abs(result.estimate - reference.estimate) / reference.standard_error
    assert np.max(miss) < 0.05
    search = np.asarray(result.details["search_best"])
    assert search[6] == pytest.approx(TRUTH[6], rel=0.5)
