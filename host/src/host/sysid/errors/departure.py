"""By how much departures from the trim move an estimate: removed from maneuvers, or fitted too.

`trim_departure` finds it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.arrays import Array
from host.sysid.aerodynamics.coefficient_table import ShiftedEstimate
from host.sysid.aerodynamics.left_out_terms import LeftOutTerm, expected_left_out
from host.sysid.aerodynamics.unmeasured_motion import with_unmeasured
from host.sysid.aerodynamics.varying_airspeed import VaryingModel
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel, Parameter
from host.sysid.models.thrust_column import ThrustColumn
from host.sysid.numerics.output_error_problem import OutputProblem


@dataclass(frozen=True, slots=True)
class Departure:
    """Shift of an estimate, and what one step and second order leave open of it.

    Attributes
    ----------
    shares : Array, shape (maneuvers, P)
        By how much each maneuver moves the joint estimate.
    remainders : tuple of ShiftedEstimate
    varying : VaryingModel
        What makes further inputs of the departures.
    model : LinearModel
        With these inputs.
    maneuvers : tuple of Maneuver
        Those fitted, with these inputs.
    nuisance : dict
        Terms that a template has not, of motion or thrust that was measured: what is expected, and
        one deviation.
    """

    shares: Array
    remainders: tuple[ShiftedEstimate, ...]
    varying: VaryingModel
    model: LinearModel
    maneuvers: tuple[Maneuver, ...]
    nuisance: dict[str, tuple[float, float]]

    @property
    def step(self) -> Array:
        """By how much the estimate moves, (P,)."""
        return np.asarray(self.shares.sum(axis=0))

    def influence(self, details: Mapping[str, float | Array]) -> dict[str, Array]:
        """Return the influence of each maneuver on the estimate moved, of that in the details.

        Maneuvers whose airspeed went different ways disagree before the step, not behind it.
        """
        influence = details.get("maneuver_influence")
        if not isinstance(influence, np.ndarray):
            return {}
        tested = np.any(influence != 0.0, axis=0)  # what need not agree stays out of the test
        return {"maneuver_influence": influence + tested * self.shares}

    @property
    def thrust(self) -> ThrustColumn | None:
        """What measured thrust does; None where it stayed as airspeed has it, or is not known."""
        own = {t.input_name for t in self.varying.thrust}
        columns = [k for k, name in enumerate(self.model.inputs) if name in own]
        if not columns:
            return None
        return ThrustColumn(*(M[:, columns].sum(axis=1) for M in (self.model.B, self.model.D)))

    def wide_model(self, base: LinearModel) -> LinearModel:
        """Return a template with the departures as inputs, and the terms estimated along as
        parameters behind its own."""
        known = with_second_order(self.varying.model, base, {})
        more = [t for t in self.varying.model.terms if t.parameter in self.nuisance]
        added = (Parameter(name, mean, prior_sd=sd) for name, (mean, sd) in self.nuisance.items())
        return replace(
            known,
            terms=(*known.terms, *more),
            parameters=(*known.parameters, *added),
            delays=base.delays,
        )

    def expecting(self, result: FitResult) -> Departure:
        """Return the same with what another fit of the template says of the size of the terms."""
        return replace(self, nuisance=expected_nuisance(result, self.varying.left_out))

    def of_fit(self, wide: FitResult, length: int) -> Departure:
        """Return the departures as a fit of `wide_model` has them: nothing is left to be moved.

        `length` is that of the estimate without the terms.
        """
        known = {name: wide.value(name) for name in self.nuisance}
        return replace(
            self,
            shares=np.zeros((len(self.maneuvers), length)),
            remainders=(),
            model=with_second_order(self.varying.model, self.varying.base, known),
        )

    def removed_from(self, maneuvers: Sequence[Maneuver], estimate: Array) -> list[Maneuver]:
        """Return the maneuvers as if nothing had departed; as they are if the model diverges.

        Parameters
        ----------
        maneuvers : sequence of Maneuver
            As fitted.
        estimate : Array
            Common parameters first.
        """
        return self._removed(self.maneuvers, maneuvers, estimate)

    def removed_from_held_out(
        self,
        maneuvers: Sequence[Maneuver],
        cuts: Sequence[Mapping[str, Array]],
        estimate: Array,
    ) -> list[Maneuver]:
        """Return maneuvers that were not fitted, departures from the trim removed.

        `cuts` holds all columns of each.
        """
        varying = self.varying
        whole = [with_unmeasured(c, varying.base, estimate, varying.trim) for c in cuts]
        wide = [
            replace(m, inputs=varying.maneuver(c, m.dt_s).inputs)
            for m, c in zip(maneuvers, whole, strict=True)
        ]
        return self._removed(wide, maneuvers, estimate)

    def _removed(
        self, departing: Sequence[Maneuver], maneuvers: Sequence[Maneuver], estimate: Array
    ) -> list[Maneuver]:
        return without_further_inputs(self.model, departing, maneuvers, estimate)


def without_further_inputs(
    model: LinearModel,
    departing: Sequence[Maneuver],
    maneuvers: Sequence[Maneuver],
    estimate: Array,
) -> list[Maneuver]:
    """Return maneuvers as if the further inputs of a model had been none; as they are if it
    diverges.

    Parameters
    ----------
    model : LinearModel
    departing : sequence of Maneuver
        With all inputs of the model.
    maneuvers : sequence of Maneuver
        The same, with the first of them.
    estimate : Array
        Common parameters first.
    """
    if not maneuvers:
        return []
    trimmed = [
        replace(
            wide,
            inputs=np.hstack([own.inputs, np.zeros_like(wide.inputs[:, own.inputs.shape[1] :])]),
        )
        for wide, own in zip(departing, maneuvers, strict=True)
    ]
    problems = [OutputProblem(model, data) for data in (departing, trimmed)]
    theta = problems[0].first_guess()
    theta[: problems[0].n_common] = estimate[: problems[0].n_common]
    there, here = (problem.outputs(theta) for problem in problems)
    if there is None or here is None:
        return list(maneuvers)
    return [
        replace(m, outputs=m.outputs - (moved - still).T)
        for m, moved, still in zip(maneuvers, there, here, strict=True)
    ]


def expected_nuisance(
    result: FitResult, terms: Sequence[LeftOutTerm]
) -> dict[str, tuple[float, float]]:
    """Return what is expected of each term that the template leaves out, by its neighbours."""
    error = result.standard_error
    like = {t.like for t in terms if t.like}
    known = {n: (result.value(n), float(error[result.index(n)])) for n in like}
    return expected_left_out(terms, known)


def with_second_order(
    varying: LinearModel, base: LinearModel, known: Mapping[str, float]
) -> LinearModel:
    """Return the model with departures, terms of second order at known values, others at none."""
    more = {p.name for p in varying.parameters[len(base.parameters) :]}
    B, D = varying.B.copy(), varying.D.copy()
    for t in varying.terms:
        if t.parameter in known and t.matrix in "BD":
            (B if t.matrix == "B" else D)[t.row, t.column] += t.gain * known[t.parameter]
    return replace(
        varying,
        name=base.name,
        B=B,
        D=D,
        terms=tuple(t for t in varying.terms if t.parameter not in more),
        parameters=base.parameters,
    )
