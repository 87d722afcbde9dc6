"""Scatter of repeated maneuvers: fair where they agree, widened where they do not."""

import numpy as np
import pytest
from host.sysid import FitResult, Maneuver, fit
from host.sysid.numerics import OutputProblem
from host.sysid.numerics.maneuver_agreement import (
    ManeuverAgreement,
    disagreement,
    maneuver_agreement,
)
from studies.data import TRUTH, noisy
from studies.navion import navion_structured

MODEL = navion_structured()
PLACE = MODEL.parameter_names.index("M_alpha")


def flown(seed: int, spread: float, count: int = 5, method: str = "output-error") -> FitResult:
    """Fit maneuvers whose M_alpha differs from one to the next by a share `spread`."""
    rng = np.random.default_rng(seed)
    base = noisy(0, 0.05)
    maneuvers = []
    for _ in range(count):
        theta = TRUTH.copy()
        theta[PLACE] *= 1.0 + spread * rng.standard_normal()
        outputs = OutputProblem(MODEL, [base]).outputs(np.concatenate([theta, np.zeros(4)]))
        assert outputs is not None
        y = outputs[0].T
        y = y + np.sqrt(np.mean(y**2, axis=0) / 10.0) * rng.standard_normal(y.shape)
        maneuvers.append(Maneuver(0.05, base.inputs, y))
    return fit(method, MODEL.with_start(TRUTH), maneuvers)


def agreement(result: FitResult) -> ManeuverAgreement | None:
    return maneuver_agreement(result.model.parameter_names, result.uncertainty)


@pytest.mark.parametrize("method", ["output-error", "output-error-white", "filter-error"])
def test_an_aircraft_that_changes_is_named_and_its_interval_widened(method: str) -> None:
    result = flown(0, 0.1, method=method)
    found = agreement(result)
    assert found is not None
    wide = result.with_uncertainty(result.uncertainty.with_model_error([disagreement(found)]))
    assert found.p_value[PLACE] < 1e-3
    assert found.factor[PLACE] > 2.0
    assert wide.standard_error[PLACE] == pytest.approx(
        found.factor[PLACE] * result.standard_error[PLACE]
    )
    assert wide.half_width()[PLACE] == pytest.approx(2.776 * wide.standard_error[PLACE], rel=0.01)
    assert any("maneuvers disagree on M_alpha" in line for line in wide.warnings)
    other = MODEL.parameter_names.index("Z_u")
    assert found.factor[other] == 1.0


def test_one_maneuver_says_nothing_of_scatter() -> None:
    result = fit("output-error", MODEL.with_start(TRUTH), [noisy(1, 0.05)])
    assert agreement(result) is None
    known = result.uncertainty
    assert known.with_model_error([disagreement(None)]) is known
