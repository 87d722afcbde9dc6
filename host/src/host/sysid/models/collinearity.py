"""Correlated estimates, and inputs that never change."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from host.constants import ENTANGLED
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import CONSTANT, LinearModel

CONDITION_LIMIT = 1e5  # of the scaled information: more digits than any sensor has


@dataclass(frozen=True, slots=True)
class Collinearity:
    """Condition number of the correlation matrix and strongly correlated pairs of parameters."""

    condition: float
    pairs: tuple[tuple[str, str, float], ...]

    @property
    def severe(self) -> bool:
        """Whether the information is close to singular."""
        return self.condition > CONDITION_LIMIT


def collinearity(result: FitResult, left_out: Collection[str] = ()) -> Collinearity:
    """Return the collinearity of the estimates, some parameters left out.

    Klein & Morelli, Aircraft System Identification, ch. 5.
    """
    asked = np.array([name not in left_out for name in result.names])
    estimated = np.flatnonzero(asked & (result.standard_error > 0.0))
    correlation = result.correlation[np.ix_(estimated, estimated)]
    values = np.linalg.eigvalsh(correlation)
    condition = float(values[-1] / max(values[0], 1e-300))
    pairs = []
    count = len(result.model.parameters)
    for i in range(len(estimated)):
        for j in range(i):
            if estimated[i] < count and abs(correlation[i, j]) > ENTANGLED:
                pairs.append(
                    (
                        result.names[estimated[j]],
                        result.names[estimated[i]],
                        float(correlation[i, j]),
                    )
                )
    pairs.sort(key=lambda pair: -abs(pair[2]))
    return Collinearity(condition, tuple(pairs))


def constant_inputs(model: LinearModel, maneuvers: Sequence[Maneuver]) -> tuple[str, ...]:
    """Return inputs that never change: each is collinear with a bias."""
    constant = []
    for k, name in enumerate(model.inputs):
        if name != CONSTANT and all(float(np.ptp(m.inputs[:, k])) == 0.0 for m in maneuvers):
            constant.append(name)
    return tuple(constant)
