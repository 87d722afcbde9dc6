"""The samples of one maneuver, the data of every estimator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from host.arrays import Array, BoolArray
from host.errors import IdentificationError
from host.sysid.models.state_space_model import CONSTANT, LinearModel

if TYPE_CHECKING:
    import pandas as pd

LARGEST = 1e30  # in any unit: no quantity of flight is larger, and its powers overflow
JITTER_LIMIT = 0.02  # of one sample: a record with more is not on a uniform grid


@dataclass(frozen=True, slots=True)
class Maneuver:
    """One uniformly sampled test point.

    Parameters
    ----------
    dt_s : float
        Sample period, s.
    inputs : Array, shape (samples, n_inputs)
        Control inputs in the order of the model, SI.
    outputs : Array, shape (samples, n_outputs)
        Measured outputs in the order of the model, SI, angles unwrapped.
    rates : Array or None, shape (samples, n_states)
        State rates where they were measured; None lets a method differentiate.
    name : str
        What the report calls it.
    sampled : Array or None, shape (samples, n_outputs)
        At which samples each output was measured; between them a curve stands. None: at all,
        and what is given of such a maneuver becomes None.
    resolution : Array or None, shape (n_outputs,)
        Step of each output's numbers, 0 where none is known.
    least_noise : Array or None, shape (n_outputs,)
        Least deviation of each output's noise as a filter takes it, 0 where none is known: an error
        that lasts from sample to sample passes for a sensor without noise.

    Raises
    ------
    IdentificationError
        If the arrays do not match in length, are empty or hold a value that is not finite or
        absurd.
    """

    dt_s: float
    inputs: Array
    outputs: Array
    rates: Array | None = None
    name: str = "maneuver"
    sampled: BoolArray | None = None
    resolution: Array | None = None
    least_noise: Array | None = None

    def __post_init__(self) -> None:
        for label in ("inputs", "outputs", "rates"):
            value = getattr(self, label)
            if value is None:
                continue
            array = np.ascontiguousarray(value, dtype=np.float64)
            if array.ndim != 2:
                raise IdentificationError(
                    f"{self.name}: {label} has {array.ndim} dimensions, expected samples x columns"
                )
            if not np.isfinite(array).all():
                row, column = np.argwhere(~np.isfinite(array))[0]
                raise IdentificationError(
                    f"{self.name}: {label} column {column} is not a finite number at sample {row};"
                    " cut the gap out or fill it before fitting"
                )
            if np.max(np.abs(array), initial=0.0) > LARGEST:
                row, column = np.argwhere(np.abs(array) > LARGEST)[0]
                raise IdentificationError(
                    f"{self.name}: {label} column {column} is {array[row, column]:.3g} at sample"
                    f" {row}, which is no quantity of flight in any unit"
                )
            if len(array) != len(self.outputs):
                raise IdentificationError(
                    f"{self.name}: {len(array)} samples of {label}, {len(self.outputs)} of outputs"
                )
            object.__setattr__(self, label, array)
        if self.sampled is not None and self.sampled.shape != self.outputs.shape:
            raise IdentificationError(
                f"{self.name}: sampled is {self.sampled.shape}, outputs {self.outputs.shape}"
            )
        if self.sampled is not None and self.sampled.all():
            object.__setattr__(self, "sampled", None)
        if len(self.outputs) < 8:
            raise IdentificationError(
                f"{self.name}: {len(self.outputs)} samples, at least 8 are needed"
            )
        if not (np.isfinite(self.dt_s) and self.dt_s > 0.0):
            raise IdentificationError(f"{self.name}: sample period {self.dt_s} s is not positive")

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.outputs)

    @property
    def held(self) -> bool:
        """Whether an output was measured at some of the samples only."""
        return self.sampled is not None

    @property
    def seen(self) -> BoolArray:
        """At which samples each output was measured, (samples, n_outputs)."""
        whole = np.ones(self.outputs.shape, dtype=bool)
        return whole if self.sampled is None else np.ascontiguousarray(self.sampled)

    @property
    def time_s(self) -> Array:
        """Time from the first sample, s."""
        return np.arange(self.samples) * self.dt_s

    @classmethod
    def from_table(
        cls,
        table: pd.DataFrame,
        model: LinearModel,
        *,
        from_s: float = -np.inf,
        to_s: float = np.inf,
        name: str = "maneuver",
    ) -> Maneuver:
        """Cut one maneuver out of a flight table.

        Inputs are as the table has them: what `hold = "smooth"` of a model says of the motion
        between samples `host.identify` puts in.

        Parameters
        ----------
        table : DataFrame
            SI table with `t_s` and the columns the model names.
        model : LinearModel
            Gives the input and output columns.
        from_s, to_s : float
            Window in the time of the table, s, both ends included.
        name : str
            What the report calls it.

        Raises
        ------
        IdentificationError
            If a column is missing, the window is empty or time does not advance evenly.
        """
        if CONSTANT in model.inputs:
            table = table.assign(**{CONSTANT: 1.0})
        missing = [c for c in ("t_s", *model.inputs, *model.outputs) if c not in table.columns]
        if missing:
            raise IdentificationError(
                f"{name}: no column {', '.join(missing)}; the table has"
                f" {', '.join(str(c) for c in table.columns)}"
            )
        time_s = table["t_s"].to_numpy(dtype=np.float64)
        window = (time_s >= from_s) & (time_s <= to_s)
        time_s = time_s[window]
        if len(time_s) < 8:
            raise IdentificationError(
                f"{name}: {len(time_s)} samples between {from_s} and {to_s} s, at least 8 needed"
            )
        steps = np.diff(time_s)
        dt_s = float(np.median(steps))
        if dt_s <= 0.0 or float(np.max(np.abs(steps - dt_s))) > JITTER_LIMIT * dt_s:
            raise IdentificationError(
                f"{name}: time steps from {steps.min():.6g} to {steps.max():.6g} s, expected an"
                " even grid; resample the table first"
            )
        cut = table.loc[window]
        return cls(
            dt_s=float(time_s[-1] - time_s[0]) / (len(time_s) - 1),
            inputs=cut[list(model.inputs)].to_numpy(dtype=np.float64),
            outputs=cut[list(model.outputs)].to_numpy(dtype=np.float64),
            name=name,
        )


def measurements(maneuvers: Sequence[Maneuver]) -> int:
    """Return how many values of outputs were measured in all maneuvers."""
    return sum(m.outputs.size if m.sampled is None else int(m.sampled.sum()) for m in maneuvers)
