"""Lift and side force by turning, where no accelerometer tells them: known as aircraft have them.

A vane that is late looks like them: without them a vane in time is found 8 ms early, and N_r of
a trainer comes out 11 % off, known to 2. They are small against the known turning of the path.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from host.sysid.models.state_space_model import LinearModel, Parameter, Term

# State in whose equation it acts, rate, mean, one deviation; a share of what turning does to the
# angle. C_Lq over four relative masses is 0.01 (airliner at height), 0.02 to 0.03 (light aircraft),
# 0.05 (Zagi), 0.08 (trainer, Ultra Stick), more of light foam; downwash that lags acts the same.
# C_Yr gives 0.005 to 0.02, C_Yp half of that, of either sign.
RATE_FORCES = {
    "longitudinal": {"Z_q": ("alpha_rad", "q_radps", -0.05, 0.05)},
    "short-period": {"Z_q": ("alpha_rad", "q_radps", -0.05, 0.05)},
    "lateral": {
        "Y_p": ("beta_rad", "p_radps", 0.0, 0.01),
        "Y_r": ("beta_rad", "r_radps", 0.015, 0.015),
    },
}


def with_rate_forces(model: LinearModel) -> LinearModel:
    """Return a template without accelerometers, forces by turning as parameters with a prior.

    Parameters
    ----------
    model : LinearModel
        Returned as it is where it has them, or there are none.
    """
    found = model
    for name, (state, rate, mean, sd) in RATE_FORCES.get(model.name, {}).items():
        if name in (p.name for p in model.parameters):
            continue
        term = Term("A", model.states.index(state), model.states.index(rate), name)
        found = replace(
            found,
            terms=(*found.terms, term),
            parameters=(*found.parameters, Parameter(name, mean, prior_sd=sd)),
        )
    return found


def has_rate_forces(model: LinearModel) -> bool:
    """Return whether all forces by turning of a template are among its parameters, known or not."""
    names = {p.name for p in model.parameters}
    known = RATE_FORCES.get(model.name, {})
    return bool(known) and names >= known.keys()


def by_prior(model: LinearModel) -> bool:
    """Return whether forces by turning are parameters that their prior alone tells."""
    known = RATE_FORCES.get(model.name, {})
    return any(p.name in known and np.isfinite(p.prior_sd) for p in model.parameters)
