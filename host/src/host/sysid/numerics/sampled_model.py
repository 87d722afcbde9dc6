"""A linear model over one sample: what simulation and filters run on, with slopes by unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, IntArray
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import EntryTable, LinearModel
from host.sysid.numerics.discretisation import discretise


@dataclass(frozen=True, slots=True)
class SampledModel:
    """Next state and outputs by state and drive, and their slopes by L unknowns.

    The drive is inputs, one, and with a first-order hold the increments of the inputs.

    Attributes
    ----------
    step, by_step : Array, shape (n, n + w), (n, n + w, L)
        [Phi Gamma]: the next state by state and drive.
    read, by_read : Array, shape (p, n + w), (p, n + w, L)
        Outputs by state and drive.
    start, by_start : Array, shape (n,), (n, L)
        State of the first sample.
    """

    step: Array
    by_step: Array
    read: Array
    by_read: Array
    start: Array
    by_start: Array

    @property
    def C(self) -> Array:
        """Outputs by state, (p, n)."""
        return self.read[:, : len(self.start)]

    def by(self, columns: IntArray) -> SampledModel:
        """Return the model with slopes by these unknowns alone, in this order."""
        slopes = (
            np.ascontiguousarray(x[..., columns])
            for x in (self.by_step, self.by_read, self.by_start)
        )
        by_step, by_read, by_start = slopes
        return SampledModel(self.step, by_step, self.read, by_read, self.start, by_start)

    def padded(self, more: int) -> SampledModel:
        """Return the model with so many unknowns more, which it does not depend on."""
        by_step, by_read, by_start = (
            np.concatenate([x, np.zeros((*x.shape[:-1], more))], axis=-1)
            for x in (self.by_step, self.by_read, self.by_start)
        )
        return SampledModel(self.step, by_step, self.read, by_read, self.start, by_start)


class Sampler:
    """A linear model over one sample of a maneuver, by values of that maneuver's unknowns.

    These are the common parameters and delays, then `LinearModel.local_names`. A zero stands behind
    them: an unknown of -1 reads it.

    Attributes
    ----------
    width : int
        Number of these unknowns, L.
    rate, offset, first : IntArray, shape (n,), (p,), (n,)
        Which unknown is the bias of each rate, of each output, and each initial state; -1: none.
    by_start : Array, shape (n, L)
        Slopes of the initial states.
    """

    def __init__(self, model: LinearModel) -> None:
        self.model = model
        n, m, p = len(model.states), len(model.inputs), len(model.outputs)
        common = len(model.parameter_names)
        self.width = common + len(model.local_names(1))
        self._wide = n + m + 1 + (m if model.hold == "foh" else 0)
        ends = common + np.cumsum([0, len(model.state_biases), len(model.output_biases)])
        self.rate = _places(model.states, model.state_biases, ends[0])
        self.offset = _places(model.outputs, model.output_biases, ends[1])
        self.first = _places(model.states, model.initial_states, ends[2])
        own = [x.name for x in model.parameters]
        for state, name in model.shared_starts:
            self.first[model.states.index(state)] = own.index(name)
        self._known_start = np.zeros(n)
        for state, value in model.known_starts:
            self._known_start[model.states.index(state)] = value
        self.by_start = np.zeros((n, self.width))
        started = np.flatnonzero(self.first >= 0)
        self.by_start[started, self.first[started]] = 1.0
        entries, biased = model.entries("AB"), np.flatnonzero(self.rate >= 0)
        self._entries = EntryTable(
            row=np.concatenate([entries.row, biased]),
            column=np.concatenate([entries.column, np.full(len(biased), n + m)]),
            parameter=np.concatenate([entries.parameter, self.rate[biased]]),
            gain=np.concatenate([entries.gain, np.ones(len(biased))]),
        )
        self._by_read = np.zeros((p, self._wide, self.width))
        entries = model.entries("CD")
        np.add.at(self._by_read, (entries.row, entries.column, entries.parameter), entries.gain)
        biased = np.flatnonzero(self.offset >= 0)
        self._by_read[biased, n + m, self.offset[biased]] = 1.0

    def drive(self, maneuver: Maneuver) -> Array:
        """Return what drives the model over a maneuver, (samples, w)."""
        columns = [maneuver.inputs, np.ones((maneuver.samples, 1))]
        if self.model.hold == "foh":
            columns.append(np.diff(maneuver.inputs, axis=0, append=maneuver.inputs[-1:]))
        return np.ascontiguousarray(np.hstack(columns))

    def at(self, local: Array, dt_s: float, *, slopes: bool = True) -> SampledModel:
        """Return the model at values of the unknowns, a zero behind them, (L + 1,).

        Parameters
        ----------
        local : Array, shape (L + 1,)
        dt_s : float
            Sample period, s.
        slopes : bool
            Without, there are slopes by no unknown.
        """
        model = self.model
        A, B, C, D = model.matrices(local)
        n, m = B.shape
        count = self.width if slopes else 0
        entries = self._entries if slopes else NO_ENTRIES
        step, by_step = discretise(
            np.column_stack([A, B, local[self.rate]]),
            n,
            m,
            model.hold == "foh",
            dt_s,
            entries.row,
            entries.column,
            entries.parameter,
            entries.gain,
            count,
        )
        read, by_read = self._reading(A, B, C, D, local)
        return SampledModel(
            step=step,
            by_step=by_step,
            read=read,
            by_read=by_read[:, :, :count],
            start=self.start(local),
            by_start=self.by_start[:, :count],
        )

    def reading(self, local: Array) -> tuple[Array, Array]:
        """Return outputs by state and drive at values of the unknowns, and their slopes."""
        return self._reading(*self.model.matrices(local), local)

    def _reading(self, A: Array, B: Array, C: Array, D: Array, local: Array) -> tuple[Array, Array]:
        n, m = B.shape
        read = np.zeros((len(C), self._wide))
        read[:, :n], read[:, n : n + m], read[:, n + m] = C, D, local[self.offset]
        return read, self._read_slopes(A, B, local)

    def start(self, local: Array) -> Array:
        """Return the state of the first sample, (n,)."""
        return np.asarray(self._known_start + local[self.first])

    def _read_slopes(self, A: Array, B: Array, local: Array) -> Array:
        """Return slopes of the outputs; the place of a sensor adds a state equation to its own."""
        model, slopes, entries = self.model, self._by_read, self._entries
        if model.accelerometer_offsets:
            slopes = slopes.copy()
        names = [x.name for x in model.parameters]
        n, width = len(A), len(A) + B.shape[1]
        for lever in model.accelerometer_offsets:
            row, state = model.outputs.index(lever.output), model.states.index(lever.state)
            arm = names.index(lever.parameter)
            slopes[row, :n, arm] += lever.gain * A[state]
            slopes[row, n:width, arm] += lever.gain * B[state]
            for t in np.flatnonzero((entries.row == state) & (entries.column < width)):
                place = row, entries.column[t], entries.parameter[t]
                slopes[place] += lever.gain * local[arm] * entries.gain[t]
        return slopes


NONE = np.zeros(0, dtype=np.int64)
NO_ENTRIES = EntryTable(NONE, NONE, NONE, np.zeros(0))


def _places(every: Sequence[str], own: Sequence[str], begin: int) -> IntArray:
    """Return which unknown belongs to each name, those of `own` counted from `begin`; -1: none."""
    found = np.full(len(every), -1, dtype=np.int64)
    for k, name in enumerate(own, start=begin):
        found[every.index(name)] = k
    return found
