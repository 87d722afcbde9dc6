"""Entries of a linear model collected by the names of its signals."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from host.constants import CERTAIN_SD
from host.sysid.models.residual_delays import delays_of
from host.sysid.models.state_space_model import (
    AccelerometerOffset,
    DelayGroup,
    LinearModel,
    Parameter,
    Term,
)


@dataclass(slots=True)
class ModelBuilder:
    """Collector of the entries of a model by signal names."""

    name: str
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: dict[str, Parameter] = field(default_factory=dict)
    terms: list[Term] = field(default_factory=list)
    known: dict[tuple[str, str, str], float] = field(default_factory=dict)
    accelerometer_offsets: list[AccelerometerOffset] = field(default_factory=list)

    def add(self, name: str, start: float, places: Iterable[tuple[str, str, float]]) -> None:
        """Add a parameter to entries (row, column) with gains; unknown signals are left out."""
        found = []
        for row, column, gain in places:
            place = self._place(row, column)
            if place is not None and gain != 0.0:
                found.append(Term(*place, name, gain))
        if found:
            self.parameters[name] = Parameter(name, start)
            self.terms += found

    def add_row(self, axis: str, row: str, entries: Iterable[tuple[str, str, float]]) -> None:
        """Add a parameter to one row for each (label, column, start value)."""
        for label, column, start in entries:
            self.add(f"{axis}_{label}", start, [(row, column, 1.0)])

    def fix(self, row: str, column: str, value: float) -> None:
        """Set a known entry."""
        if self._place(row, column) is not None:
            kind = "rate" if row.endswith("'") else "output"
            self.known[kind, row.rstrip("'"), column] = value

    def _place(self, row: str, column: str) -> tuple[str, int, int] | None:
        rate = row.endswith("'")
        rows = self.states if rate else self.outputs
        label = row.rstrip("'")
        if label not in rows:
            return None
        if column in self.states:
            return "A" if rate else "C", rows.index(label), self.states.index(column)
        if column in self.inputs:
            return "B" if rate else "D", rows.index(label), self.inputs.index(column)
        return None

    def accelerometer_offset(
        self, output: str, state: str, name: str, gain: float, sd_m: float
    ) -> None:
        """Add an accelerometer's offset from its assumed place, with a prior."""
        if sd_m > 0.0 and output in self.outputs and state in self.states:
            self.parameters[name] = Parameter(
                name, 0.0, lower=-CERTAIN_SD * sd_m, upper=CERTAIN_SD * sd_m, prior_sd=sd_m
            )
            self.accelerometer_offsets.append(AccelerometerOffset(output, state, name, gain))

    def build(self, *, delays: tuple[DelayGroup, ...], hold: str) -> LinearModel:
        """Return the model; an output with the name of a state measures it."""
        n, m, p = len(self.states), len(self.inputs), len(self.outputs)
        matrices = {
            "A": np.zeros((n, n)),
            "B": np.zeros((n, m)),
            "C": np.zeros((p, n)),
            "D": np.zeros((p, m)),
        }
        for k, state in enumerate(self.states):
            if state in self.outputs:
                matrices["C"][self.outputs.index(state), k] = 1.0
        for (kind, row, column), value in self.known.items():
            place = self._place(row + ("'" if kind == "rate" else ""), column)
            if place is not None:
                matrices[place[0]][place[1], place[2]] = value
        return LinearModel(
            name=self.name,
            states=self.states,
            inputs=self.inputs,
            outputs=self.outputs,
            A=matrices["A"],
            B=matrices["B"],
            C=matrices["C"],
            D=matrices["D"],
            terms=tuple(self.terms),
            parameters=tuple(self.parameters.values()),
            state_biases=self.states,
            output_biases=tuple(y for y in self.outputs if y not in self.states),
            initial_states=self.states,
            delays=delays_of(self.outputs, delays),
            hold=hold,
            accelerometer_offsets=tuple(self.accelerometer_offsets),
        )
