"""One step with a further parameter comes to what a fit of both comes to."""

from dataclasses import replace

import numpy as np
import pytest
from host.sysid.errors import one_step_of
from host.sysid.estimators import fit
from host.sysid.models import LinearModel, Maneuver, Parameter, Term, Trim, template
from host.sysid.numerics import OutputProblem

TRIM = Trim(18.0)
TRUE = {
    "Z_alpha": -7.4, "Z_q": -0.08, "Z_de": -0.6, "M_alpha": -91.0, "M_q": -11.3, "M_de": -121.0,
}  # fmt: skip
EXTRA = 2.0


def _models() -> tuple[LinearModel, LinearModel]:
    """Return the short period with a known further input, without and with its parameter."""
    base = template("short-period", TRIM, accelerometers=False)
    n, p = len(base.states), len(base.outputs)
    wide = replace(
        base,
        inputs=(*base.inputs, "disturbance"),
        B=np.hstack([base.B, np.zeros((n, 1))]),
        D=np.hstack([base.D, np.zeros((p, 1))]),
    )
    row = base.states.index("q_radps")
    free = replace(
        wide,
        parameters=(*wide.parameters, Parameter("extra")),
        terms=(*wide.terms, Term("B", row, len(base.inputs), "extra")),
    )
    return wide, free


def _flown(model: LinearModel, seed: int) -> Maneuver:
    rng, t = np.random.default_rng(seed), 0.02 * np.arange(500)
    u = np.column_stack([0.05 * np.sign(np.sin(3.0 * t)), 0.5 * np.cos(1.7 * t) ** 2])
    data = Maneuver(0.02, u, np.zeros((len(t), len(model.outputs))))
    problem = OutputProblem(model, [data])
    theta = problem.first_guess()
    theta[: len(model.parameters)] = [TRUE.get(p.name, EXTRA) for p in model.parameters]
    [y] = problem.outputs(theta) or []
    return replace(data, outputs=y.T + 0.002 * rng.standard_normal(y.T.shape))


def test_nothing_new_moves_nothing() -> None:
    still, free = _models()
    data = [_flown(free, 3)]
    alone = fit("output-error-white", still, data, multiple_starts=False)
    one_step = one_step_of(alone, data, TRIM)
    assert one_step is not None
    np.testing.assert_allclose(one_step.change(still, TRIM, data), 0.0, atol=1e-9)


def test_what_other_unknowns_explain_is_known_by_its_prior() -> None:
    """Rounding made its information negative, and its deviation no number."""
    still, free = _models()
    data = [_flown(free, seed) for seed in (1, 2)]
    alone = fit("output-error-white", still, data, multiple_starts=False)
    found = one_step_of(alone, data, TRIM)
    assert found is not None
    rounded = replace(found, inverse=1.1 * found.inverse)
    other = replace(still, B=still.B.copy())  # another elevator effectiveness
    other.B[still.states.index("q_radps"), 0] += 1.0
    _, sd = rounded.share_of((other, data), alone, TRIM, data, 0.5)
    assert sd == pytest.approx(0.5, rel=1e-3)
