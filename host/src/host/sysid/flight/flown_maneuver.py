"""A maneuver in its flight: its columns, cut for a model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, BoolArray
from host.errors import IdentificationError
from host.near_names import like
from host.physical.recording import SURFACES
from host.readers.column_sampling import sampled_name
from host.sysid.flight.input_kinks import with_means_of_motion
from host.sysid.flight.reconstructed_flight import ReconstructedFlight, maneuver_name
from host.sysid.maneuvers.maneuver_detection import DetectedManeuver
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import CONSTANT, LinearModel
from host.sysid.numerics.between_samples import with_means_of_smooth_motion


@dataclass(frozen=True, slots=True)
class FlownManeuver:
    """A maneuver in its flight; `label` is what an answer calls it, `block` how many samples are
    averaged to one. `surfaces_move` between samples as `input_kinks` says, else along lines."""

    found: DetectedManeuver
    flight: ReconstructedFlight
    label: str
    block: int = 1
    surfaces_move: bool = False

    @property
    def dt_s(self) -> float:
        """Step of the recorded samples."""
        t = self.flight.corrected["t_s"]
        return float(t[1] - t[0])

    @property
    def begins_its_record(self) -> bool:
        """Whether it has the first sample."""
        return self.found.fit_window()[0] <= float(self.flight.corrected["t_s"][0])

    def inside(self) -> dict[str, Array]:
        """Return all corrected columns of it, a moment of trim before the input included."""
        return self._inside(self.flight.corrected)

    def departing(self) -> dict[str, Array]:
        """Return the same with the angles that no vane measured."""
        columns, angles = self.flight.corrected, self.flight.angles
        return self._inside(columns if angles is None else {**angles.hidden(columns), **columns})

    def _inside(self, columns: Mapping[str, Array]) -> dict[str, Array]:
        t = self.flight.corrected["t_s"]
        first, last = self.found.fit_window()
        begin, end = np.searchsorted(t, first), np.searchsorted(t, last, side="right")
        at = slice(begin, begin + (end - begin) // self.block * self.block)
        cut = {
            name: values[at].reshape(-1, self.block).mean(axis=1)
            for name, values in columns.items()
        }
        moving = [f"{name}_rad" for name in SURFACES if self.surfaces_move]
        return cut | {name: with_means_of_motion(cut[name]) for name in moving if name in cut}

    def cut(self, model: LinearModel) -> Maneuver:
        """Return inputs and outputs of a model over it.

        Raises
        ------
        IdentificationError
            If the flight lacks one of them.
        """
        columns = self.flight.corrected
        needed = (*model.inputs, *model.outputs)
        missing = [c for c in needed if c not in columns and c != CONSTANT]
        if missing:
            meant = like(missing[0], tuple(columns))
            raise IdentificationError(
                f"model {model.name} needs {', '.join(missing)}{meant}, which the data do not have"
            )
        cut = self.inside()
        cut[CONSTANT] = np.ones(len(cut["t_s"]))
        cut |= {c: with_means_of_smooth_motion(cut[c]) for c in model.smooth_inputs()}
        return Maneuver(
            dt_s=float(cut["t_s"][1] - cut["t_s"][0]),
            inputs=np.column_stack([cut[c] for c in model.inputs]),
            outputs=np.column_stack([cut[c] for c in model.outputs]),
            name=self.label,
            sampled=self._sampled(cut, model.outputs),
            resolution=np.array([self.flight.resolution.get(c, 0.0) for c in model.outputs]),
            least_noise=np.array([self.flight.least_noise.get(c, 0.0) for c in model.outputs]),
        )

    def _sampled(self, cut: Mapping[str, Array], outputs: Sequence[str]) -> BoolArray | None:
        """Return at which samples each output was measured; None where all are at every one."""
        if not any(sampled_name(c) in cut for c in outputs):
            return None
        every = np.ones(len(cut["t_s"]))
        return np.column_stack([cut.get(sampled_name(c), every) > 0.0 for c in outputs])


def flown_maneuvers(
    flights: Sequence[ReconstructedFlight], found: Sequence[Sequence[DetectedManeuver]]
) -> list[FlownManeuver]:
    """Return the maneuvers of several flights one behind the other, each by its own name."""
    return [
        FlownManeuver(
            item,
            flight,
            maneuver_name(item) + (f" of flight {number}" if len(flights) > 1 else ""),
        )
        for number, (flight, items) in enumerate(zip(flights, found, strict=True), start=1)
        for item in items
    ]
