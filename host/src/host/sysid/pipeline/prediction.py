"""`host predict`: a saved model against another record, derivatives held."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.export.pictures import Pictures
from host.files.user_text import read_toml
from host.sysid.answer.json_document import json_text
from host.sysid.flight.reconstructed_flight import ReconstructedFlight
from host.sysid.models.equation_file import KIND as EQUATIONS
from host.sysid.models.model_file import read_model
from host.sysid.models.named_models import model_path
from host.sysid.models.state_space_model import CONSTANT, LinearModel
from host.sysid.models.thrust_column import (
    THRUST,
    THRUST_COLUMNS,
    ThrustColumn,
    read_thrust_column,
)
from host.sysid.pipeline.aircraft_motion import aircraft_models
from host.sysid.pipeline.arguments import (
    path_of,
)
from host.sysid.pipeline.flight_at_hand import listed_flights, read_flight
from host.sysid.pipeline.flight_preparation import prepare
from host.sysid.pipeline.known_aircraft import aircraft_data
from host.sysid.pipeline.prediction_text import simulation_document, simulation_lines
from host.sysid.pipeline.reading_options import OfEach, joined_stretches, reading_options
from host.sysid.pipeline.simulation import Simulation, simulate
from host.sysid.validation.free_simulation import frozen_at

THRUST_HELD = "the model was fitted with thrust that changed; none is measured here: taken as held"

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from host.sysid.pipeline.flight_at_hand import Source


@dataclass(frozen=True, eq=False)
class Prediction:
    """A saved model over every record given.

    Attributes
    ----------
    model : str
        The file.
    simulations : tuple of Simulation
        One of each record.
    constants : bool
        Whether biases and start states were fitted.
    """

    model: str
    simulations: tuple[Simulation, ...]
    constants: bool

    def to_text(self) -> str:
        """Return the figures as people read them."""
        lines = []
        for one in self.simulations:
            lines += [*simulation_lines(one, self.model, constants=self.constants), ""]
        return "\n".join(lines[:-1])

    def document(self) -> dict[str, Any]:
        """Return the figures as plain lists, numbers and strings."""
        return {
            "model": self.model,
            "constants_fitted": self.constants,
            "records": [simulation_document(one) for one in self.simulations],
        }

    def to_json(self) -> str:
        """Return the figures as JSON text; what is no finite number is null."""
        return json_text(self.document())

    def plot(self) -> Pictures:
        """Return measured and simulated outputs with the inputs, a picture of each record."""
        if len(self.simulations) == 1:
            return self.simulations[0].plot()
        figures: dict[str, Figure] = {}
        for number, one in enumerate(self.simulations, start=1):
            figures |= {f"{name}_{number}": figure for name, figure in one.plot().items()}
        return Pictures(figures)


def predict(
    model: str | Path,
    flights: Source | Sequence[Source],
    *,
    aircraft: str | Path | None = None,
    calibration: OfEach = None,
    mapping: OfEach = None,
    maneuvers: int | Sequence[int] = (),
    stretches: Sequence[Any] | None = None,
    from_s: float | None = None,
    to_s: float | None = None,
    corrections: bool = True,
    accept: str | Iterable[str] = (),
    sensors: Mapping[str, int | str] | None = None,
    row_rate_hz: float | None = None,
    constants: bool = True,
) -> Prediction:
    """Run a saved model over other records: derivatives held, only constants fitted.

    Parameters
    ----------
    model : path
        File of `host identify --save-model`, or a model file, whose start values are held; for
        coefficients the aircraft file, linearised at its trim.
    flights : path, FlightLog, DataFrame or list of them
    aircraft, calibration, mapping, maneuvers, stretches, from_s, to_s, corrections, accept, sensors
        As in `host.identify`.
    constants : bool
        Fit biases and start states to each maneuver. Without they are those of equilibrium in the
        first 0.3 s, at rest before the input.

    Raises
    ------
    host.errors.HostError
        If a file cannot be read, or the model cannot be run over a record.
    """
    path = path_of("model", model)
    assert path is not None
    saved = _read_saved(model_path(path))
    sources = listed_flights(flights)
    each = reading_options(
        len(sources),
        calibration=calibration,
        mapping=mapping,
        maneuvers=maneuvers,
        stretches=stretches,
        ends=(from_s, to_s),
        corrections=corrections,
        also=saved.signals,
        accept=accept,
        sensors=sensors,
        row_rate_hz=row_rate_hz,
    )
    kept, each = joined_stretches(sources, each)
    found = []
    for source, how in zip([sources[number] for number in kept], each, strict=True):
        known = aircraft_data(aircraft, how.calibration) if aircraft is not None else None
        ready = prepare(read_flight(source, how, known))
        models, notes = saved.driven(ready.flight)
        said = (*(f.line for f in ready.flight.findings), *ready.notes, *ready.unchecked, *notes)
        flight = replace(
            ready.flight,
            recorded=_as_delayed(ready.flight.recorded, saved.late_s),
            corrected=_as_delayed(ready.flight.corrected, saved.late_s),
        )
        found.append(simulate(models, flight, said, constants=constants))
    return Prediction(str(saved.path), tuple(found), constants)


@dataclass(frozen=True, slots=True)
class _Saved:
    """A model file without free parameters.

    Attributes
    ----------
    path : Path
    models : list of (str, LinearModel)
        One, or both axes of an aircraft.
    doubts : list of str
        Notes on parameters that nobody estimated.
    late_s : dict
        By how much each input is late.
    thrust : ThrustColumn or None
        What measured thrust adds to the model.
    """

    path: Path
    models: list[tuple[str, LinearModel]]
    doubts: list[str]
    late_s: dict[str, float]
    thrust: ThrustColumn | None

    @property
    def signals(self) -> tuple[str, ...]:
        """Columns that the models need."""
        own = {name for _, m in self.models for name in (*m.inputs, *m.outputs)} - {CONSTANT}
        return tuple(sorted(own | set(THRUST_COLUMNS if self.thrust is not None else ())))

    def driven(
        self, flight: ReconstructedFlight
    ) -> tuple[list[tuple[str, LinearModel]], tuple[str, ...]]:
        """Return the models with the thrust of a flight added where it has one, and notes."""
        notes = tuple(self.doubts)
        if self.thrust is None:
            return self.models, notes
        if THRUST not in flight.corrected:
            return self.models, (*notes, THRUST_HELD)
        return [(label, self.thrust.added_to(m)) for label, m in self.models], notes


def _read_saved(path: Path) -> _Saved:
    models, doubts = _saved_models(path)
    return _Saved(path, models, doubts, _late_inputs(path), _thrust(path, models))


def _saved_models(path: Path) -> tuple[list[tuple[str, LinearModel]], list[str]]:
    """Return the models of a file without free parameters: one, or both axes of an aircraft.

    Notes are of parameters that nobody estimated.
    """
    try:
        kind = read_toml(path, IdentificationError).get("kind")
    except IdentificationError as error:
        if path.suffix.lower() == ".toml":
            raise
        raise IdentificationError(
            f"{error}; the saved model is named first, behind it the records"
        ) from error
    if kind == "nonlinear":
        return aircraft_models(path), []
    if kind not in (None, EQUATIONS):
        raise IdentificationError(
            f"{path}: of kind '{kind}', expected a linear model, equations or an aircraft, as"
            " `host identify --save-model` writes them"
        )
    own = read_model(path)
    zero = _without_start(read_toml(path, IdentificationError), own)
    names = ", ".join(zero)
    doubts = [f"held at zero, for {path.name} gives no start of them: {names}"] if zero else []
    return [(own.name, replace(frozen_at(own, own.start), delays=()))], doubts


def _without_start(document: Mapping[str, object], model: LinearModel) -> list[str]:
    """Return the parameters that are zero because a file says nothing else."""
    given = document.get("parameters")
    stated = given if isinstance(given, dict) else {}
    said = {n for n, v in stated.items() if not isinstance(v, dict) or "start" in v}
    return [p.name for p in model.parameters if p.start == 0.0 and p.name not in said]


def _thrust(path: Path, models: Sequence[tuple[str, LinearModel]]) -> ThrustColumn | None:
    """Return what measured thrust adds to a saved linear model; None where nothing is known."""
    if read_toml(path, IdentificationError).get("kind") is not None:
        return None
    [(_, model)] = models
    return read_thrust_column(path, model)


def _late_inputs(path: Path) -> dict[str, float]:
    """Return by how much each input is late, s, as the fit that a file keeps has found."""
    document = read_toml(path, IdentificationError)
    if document.get("kind") not in (None, EQUATIONS):
        return {}
    own, fitted = read_model(path), document.get("fit", {})
    return {
        column: float(fitted[delay.name][0])
        for delay in own.delays
        if isinstance(fitted.get(delay.name), list)
        for column in delay.outputs
        if column in own.inputs
    }


def _as_delayed(columns: Mapping[str, Array], late_s: Mapping[str, float]) -> dict[str, Array]:
    """Return the columns, inputs as late as the model has them.

    Without a servo of 40 ms q_radps of the record fitted differs by 25 in place of 4 %.
    """
    t_s = columns["t_s"]
    late = {n: np.interp(t_s - s, t_s, columns[n]) for n, s in late_s.items() if n in columns}
    return {**columns, **late}
