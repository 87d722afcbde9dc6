"""Free simulation of the identified models over another flight, by its measured surfaces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from host.arrays import Array
from host.sysid.answer.figure_kinds import Trace, histories
from host.sysid.answer.mat_file import labels
from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
from host.sysid.coefficients.coefficient_modes import LinearSystem
from host.sysid.flight.free_simulation import fits_of, free_simulation, frozen_model
from host.sysid.flight.linear_estimator import Answer
from host.sysid.flight.maneuver_selection import excited_axes, merge_overlapping
from host.sysid.flight.reconstructed_flight import ReconstructedFlight, flown_maneuvers
from host.sysid.identification_error import IdentificationError
from host.sysid.models.diagnostics import SignalFit
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.pipeline.notebook_html import answer_html
from host.sysid.pipeline.notebook_pictures import Pictures

if TYPE_CHECKING:
    import pandas as pd

FIGURES = ("nrmse", "r_squared", "theil")
KINEMATIC = ("theta_rad", "phi_rad")  # their rates are known
GAP_S = 0.5  # between the maneuvers of a picture


@dataclass(frozen=True, eq=False)
class SimulatedModel:
    """One model over the maneuvers of its axes: measured and simulated outputs.

    Attributes
    ----------
    label : str
    model : LinearModel
    maneuvers : tuple of Maneuver
    simulated : tuple of Array, shape (n, outputs) each
    """

    label: str
    model: LinearModel
    maneuvers: tuple[Maneuver, ...]
    simulated: tuple[Array, ...]

    @property
    def fits(self) -> tuple[SignalFit, ...]:
        """Figures of each output, all maneuvers together."""
        return fits_of(self.model, self.maneuvers, self.simulated)


@dataclass(frozen=True, eq=False)
class Simulation:
    """Free simulations of every identified model over another flight.

    Attributes
    ----------
    source : str
        The flight.
    models : tuple of SimulatedModel
    notes : tuple of str
        Notes on the flight, and the models that could not be simulated over it.
    """

    source: str
    models: tuple[SimulatedModel, ...]
    notes: tuple[str, ...]

    @property
    def table(self) -> pd.DataFrame:
        """NRMSE, R squared and Theil's coefficient of each output, by model and signal."""
        import pandas as pd

        rows = {
            (m.label, f.name): [getattr(f, k) for k in FIGURES] for m in self.models for f in m.fits
        }
        index = pd.MultiIndex.from_tuples(list(rows), names=["model", "signal"])
        return pd.DataFrame(list(rows.values()), index=index, columns=list(FIGURES))

    @property
    def histories(self) -> pd.DataFrame:
        """Every sample: model, maneuver, `t_s` from its begin, signal, measured, simulated."""
        import pandas as pd

        parts = [
            pd.DataFrame(
                {
                    "model": m.label,
                    "maneuver": maneuver.name,
                    "t_s": maneuver.time_s,
                    "signal": signal,
                    "measured": maneuver.outputs[:, k],
                    "simulated": y[:, k],
                }
            )
            for m in self.models
            for maneuver, y in zip(m.maneuvers, m.simulated, strict=True)
            for k, signal in enumerate(m.model.outputs)
        ]
        return pd.concat(parts, ignore_index=True)

    def plot(self) -> Pictures:
        """Return measured and simulated outputs of each model."""
        return Pictures(
            {
                f"{m.label}_simulated": histories(
                    dict(_traces(m)), f"{m.label}: measured (grey), free simulation (red), unseen"
                )
                for m in self.models
            }
        )

    def _repr_html_(self) -> str:
        return answer_html(
            f"free simulation of {self.source}, unseen data",
            [f"note: {note}" for note in self.notes],
            {"figures of fit": self.table},
        )


def simulate(
    linear: Sequence[Answer],
    direct: CoefficientAnswer | None,
    flight: ReconstructedFlight,
    notes: Sequence[str],
) -> Simulation:
    """Run every model freely over the maneuvers of its axes; biases are fitted to each.

    Raises
    ------
    IdentificationError
        If no model can be run over the flight.
    """
    found: list[SimulatedModel] = []
    not_simulated: list[str] = []
    for label, model in _models(linear, direct):
        axes = excited_axes(model.inputs)
        own = [merge_overlapping([f for f in flight.maneuvers if f.axis in axes or f.given])]
        try:
            data = [m.cut(model) for m in flown_maneuvers([flight], own)]
        except IdentificationError as error:
            not_simulated.append(f"{label}: {error}")
            continue
        if data:
            simulated = free_simulation(model, data)
            found.append(SimulatedModel(label, model, tuple(data), tuple(simulated)))
        else:
            not_simulated.append(f"{label}: no maneuver of {', '.join(axes)}")
    if not found:
        raise IdentificationError("; ".join([*not_simulated, *notes]))
    return Simulation(flight.source, tuple(found), (*notes, *not_simulated))


def _models(
    linear: Sequence[Answer], direct: CoefficientAnswer | None
) -> Iterator[tuple[str, LinearModel]]:
    """Return every identified model with fixed parameters, by its label."""
    for answer, label in zip(linear, labels(linear), strict=True):
        yield label, frozen_model(answer.model, answer.result)
    if direct:
        for name, system in direct.systems.items():
            yield f"{direct.template}_{name}", _linear_model(name, system)


def _linear_model(name: str, system: LinearSystem) -> LinearModel:
    """Return the linear system of the coefficients as a model; every state is an output."""
    n, m = len(system.states), len(system.inputs)
    return LinearModel(
        name=name,
        states=system.states,
        inputs=system.inputs,
        outputs=system.states,
        A=system.A,
        B=system.B,
        C=np.eye(n),
        D=np.zeros((n, m)),
        state_biases=tuple(s for s in system.states if s not in KINEMATIC),
        initial_states=system.states,
        hold="foh",
    )


def _traces(m: SimulatedModel) -> Iterator[tuple[str, list[Trace]]]:
    for k, name in enumerate(m.model.outputs):
        traces, begin = [], 0.0
        for maneuver, y in zip(m.maneuvers, m.simulated, strict=True):
            t = begin + maneuver.time_s
            begin = float(t[-1]) + GAP_S
            title = maneuver.name if k == 0 else ""
            traces.append(Trace(t, maneuver.outputs[:, k], y[:, k], title))
        yield name, traces
