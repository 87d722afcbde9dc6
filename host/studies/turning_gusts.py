"""Departures of a flight whose gusts may turn with the aircraft, as MIL-F-8785C writes them.

What gusts are follows from the flight but for three constants (`gust_reckoning`): further inputs of
the model, and whether gusts turn at all is a parameter between 0 and 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from host.arrays import Array
from host.sysid.aerodynamics.varying_airspeed import VaryingModel
from host.sysid.models import LinearModel, Maneuver, Parameter, Term

from studies.gust_reckoning import AXES, gust_motion, turning

# States in whose equations a gust that turns with the aircraft appears.
TURNED = {"longitudinal": ("airspeed_mps", "alpha_rad"), "lateral": ("beta_rad",)}
# Prior mean and deviation of `gust_turns`: 1 if gusts turn with the aircraft, 0 if they stay with
# the ground.
TURNS_PRIOR = (0.5, 0.5)
STEADY_SHARE = 0.1  # of the airspeed: deviation of the gust reckoning cannot tell


@dataclass(frozen=True)
class TurningModel(VaryingModel):
    """A model with departures, and what gusts turn, among its inputs."""

    @property
    def model(self) -> LinearModel:
        """The template with all these inputs, gusts staying with the ground."""
        plain = super().model
        names = [f"turning {of} on {row}" for row in TURNED[self.axis] for of in ("gust", *AXES)]
        B, D = (np.hstack([M, np.zeros((len(M), len(names)))]) for M in (plain.B, plain.D))
        return replace(plain, inputs=(*plain.inputs, *names), B=B, D=D)

    @property
    def gusty(self) -> LinearModel:
        """The same with ``gust_turns`` and ``gust_x``, ``_y``, ``_z`` (m/s) behind its parameters.

        For filter error, to which the fast part of the gusts is process noise.
        """
        still, share = self.model, STEADY_SHARE * self.trim.airspeed_mps
        more = (
            Parameter("gust_turns", TURNS_PRIOR[0], prior_sd=TURNS_PRIOR[1]),
            *(Parameter(f"gust_{axis}", prior_sd=share) for axis in AXES),
        )
        # Per row the gust reckoned, behind it the constants it is known but for.
        terms = [
            Term("B", still.states.index(row), still.inputs.index(f"turning {of} on {row}"), p.name)
            for row in TURNED[self.axis]
            for of, p in zip(("gust", *AXES), more, strict=True)
        ]
        return replace(still, terms=(*still.terms, *terms), parameters=(*still.parameters, *more))

    def maneuver(
        self, columns: Mapping[str, Array], dt_s: float, name: str = "maneuver"
    ) -> Maneuver:
        """Return the samples of one maneuver in the columns of `model`."""
        plain = super().maneuver(columns, dt_s, name)
        gust, steady = gust_motion(columns, dt_s)
        motions = [gust, *(steady[:, :, k] for k in range(len(AXES)))]
        turns = [turning(columns, motion) for motion in motions]
        found = [self._moving(turn[row]) for row in TURNED[self.axis] for turn in turns]
        return replace(plain, inputs=np.column_stack([plain.inputs, *found]))
