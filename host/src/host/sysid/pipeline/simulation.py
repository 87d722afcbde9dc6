"""Models over another flight, by its measured surfaces: free simulation, one step, windows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from host.errors import IdentificationError
from host.export.pictures import Pictures
from host.sysid.answer.figure_kinds import Trace, histories
from host.sysid.answer.mat_file import labels
from host.sysid.checks.small_inputs import free_motion
from host.sysid.flight.flown_maneuver import flown_maneuvers
from host.sysid.flight.reconstructed_flight import ReconstructedFlight
from host.sysid.maneuvers.maneuver_selection import excited_axes, merge_overlapping
from host.sysid.models.state_space_model import CONSTANT, LinearModel
from host.sysid.models.theil_inequality import TheilInequality, theil_inequality
from host.sysid.pipeline.notebook_html import answer_html
from host.sysid.validation.free_simulation import FreeRun, fits_of, free_runs, frozen_model
from host.sysid.validation.window_prediction import WINDOWS_S, WindowErrors, window_errors

if TYPE_CHECKING:
    import pandas as pd

    from host.arrays import Array
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.linear.linear_answer import Answer
    from host.sysid.models.diagnostics import SignalFit
    from host.sysid.models.maneuver import Maneuver

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
    columns : tuple of mapping of Array
        All columns of each maneuver.
    runs : tuple of FreeRun
        Free simulation of each.
    """

    label: str
    model: LinearModel
    maneuvers: tuple[Maneuver, ...]
    columns: tuple[Mapping[str, Array], ...]
    runs: tuple[FreeRun, ...]

    @property
    def simulated(self) -> tuple[Array, ...]:
        """Outputs of the free simulation of each maneuver, (n, outputs) each."""
        return tuple(run.outputs for run in self.runs)

    @property
    def spread(self) -> Array:
        """Rms of each measured output about its mean in every maneuver, (p,)."""
        about = np.concatenate([m.outputs - m.outputs.mean(axis=0) for m in self.maneuvers])
        return np.asarray(np.sqrt(np.mean(about**2, axis=0)), dtype=np.float64)

    @property
    def fits(self) -> tuple[SignalFit, ...]:
        """Figures of each output in free simulation, all maneuvers together."""
        return fits_of(self.model, self.maneuvers, self.simulated)

    @property
    def theil(self) -> tuple[TheilInequality, ...]:
        """Theil's coefficient of each output in free simulation, and its parts."""
        measured = [m.outputs for m in self.maneuvers]
        return theil_inequality(self.model.outputs, measured, self.simulated)

    @property
    def one_step(self) -> WindowErrors | None:
        """Errors one sample ahead of measured states."""
        return self.window(None)

    @property
    def windows(self) -> tuple[WindowErrors, ...]:
        """Errors over windows of 0.1, 0.5, 1 and 2 s from measured states, those that fit."""
        found = [self.window(length_s) for length_s in WINDOWS_S]
        return tuple(w for w in found if w is not None)

    def window(self, length_s: float | None) -> WindowErrors | None:
        """Return the errors over windows of one length, or of one sample."""
        biases = [run.biases for run in self.runs]
        states = [run.states for run in self.runs]
        return window_errors(self.model, self.maneuvers, self.columns, biases, states, length_s)


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
        """Return measured and simulated outputs of each model, its inputs beneath."""
        return Pictures(
            {
                f"{m.label}_simulated": histories(
                    dict(_traces(m)),
                    f"{m.label}: measured (grey), free simulation (red), unseen",
                    dict(_inputs(m)),
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
    models: Iterable[tuple[str, LinearModel]],
    flight: ReconstructedFlight,
    notes: Sequence[str],
    *,
    constants: bool = True,
) -> Simulation:
    """Run every model freely over the maneuvers of its axes.

    Parameters
    ----------
    models : iterable of (str, LinearModel)
        Labels, and models without free parameters.
    flight : ReconstructedFlight
    notes : sequence of str
    constants : bool
        Fit biases and start states to each maneuver; without they are those of the trim before it.

    Raises
    ------
    IdentificationError
        If no model can be run over the flight.
    """
    found: list[SimulatedModel] = []
    not_simulated: list[str] = []
    for label, model in models:
        axes = excited_axes(model.inputs)
        there = flight.maneuvers or free_motion(flight.corrected)
        own = [merge_overlapping([f for f in there if f.axis in axes or f.given])]
        flown = flown_maneuvers([flight], own)
        try:
            data = [m.cut(model) for m in flown]
        except IdentificationError as error:
            not_simulated.append(f"{label}: {error}")
            continue
        if data:
            columns = tuple(m.inside() for m in flown)
            runs = free_runs(model, data, constants=constants)
            found.append(SimulatedModel(label, model, tuple(data), columns, tuple(runs)))
        else:
            not_simulated.append(f"{label}: {_without_maneuver(flight, axes)}")
    if not found:
        raise IdentificationError("; ".join([*not_simulated, *notes]))
    return Simulation(flight.source, tuple(found), (*notes, *not_simulated))


def _without_maneuver(flight: ReconstructedFlight, axes: Sequence[str]) -> str:
    there = ", ".join(sorted({f.axis for f in flight.maneuvers}))
    return (
        f"no maneuver of {', '.join(axes)}; found {f'only {there}' if there else 'none'};"
        " argument from_s and argument to_s take any stretch"
    )


def identified_models(
    linear: Sequence[Answer], direct: CoefficientAnswer | None
) -> Iterator[tuple[str, LinearModel]]:
    """Return every identified model with fixed parameters, by its label."""
    for answer, label in zip(linear, labels(linear), strict=True):
        yield label, frozen_model(answer.model, answer.result)
    if direct:
        for name, system in direct.systems.items():
            yield (
                f"{direct.template}_{name}",
                motion_model(name, system.states, system.inputs, system.A, system.B),
            )


def motion_model(
    name: str, states: tuple[str, ...], inputs: tuple[str, ...], A: Array, B: Array
) -> LinearModel:
    """Return linear motion as a model; every state is an output, kinematics have no bias."""
    n, m = len(states), len(inputs)
    return LinearModel(
        name=name,
        states=states,
        inputs=inputs,
        outputs=states,
        A=A,
        B=B,
        C=np.eye(n),
        D=np.zeros((n, m)),
        state_biases=tuple(s for s in states if s not in KINEMATIC),
        initial_states=states,
        hold="foh",
    )


def _inputs(m: SimulatedModel) -> Iterator[tuple[str, list[tuple[Array, Array]]]]:
    """Return every input as pieces of time and value, maneuvers one behind the other."""
    for k, name in enumerate(m.model.inputs):
        if name != CONSTANT:
            yield name, [(t, u.inputs[:, k]) for t, u in zip(_times(m), m.maneuvers, strict=True)]


def _times(m: SimulatedModel) -> Iterator[Array]:
    """Return the time of each maneuver, one behind the other, s."""
    begin = 0.0
    for maneuver in m.maneuvers:
        t = begin + maneuver.time_s
        begin = float(t[-1]) + GAP_S
        yield t


def _traces(m: SimulatedModel) -> Iterator[tuple[str, list[Trace]]]:
    for k, name in enumerate(m.model.outputs):
        traces = []
        for t, maneuver, y in zip(_times(m), m.maneuvers, m.simulated, strict=True):
            title = maneuver.name if k == 0 else ""
            traces.append(Trace(t, maneuver.outputs[:, k], y[:, k], title))
        yield name, traces
