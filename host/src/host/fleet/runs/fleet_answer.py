"""Rows of flights -> models of their types, on disk and in words."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from host.export.atomic_files import atomic_write, file_names
from host.fleet.dataset.row_flights import reference_cg, type_flights
from host.fleet.flight_task import IDENTIFIED
from host.fleet.pages.aircraft_changes import AircraftHistory, change_lines, histories
from host.fleet.pages.fleet_page import fleet_page
from host.fleet.pages.type_prior import type_prior
from host.fleet.pages.type_text import type_document, type_lines
from host.fleet.statistics.type_model import TypeModel, type_model

if TYPE_CHECKING:
    import pandas as pd


@dataclass(slots=True)
class FleetAnswer:
    """The models of all types of a fleet, with the changes of its aircraft.

    Attributes
    ----------
    models : list of TypeModel
    changes : list of list of AircraftHistory
        Histories of each type's aircraft.
    written : list of Path
    """

    models: list[TypeModel] = field(default_factory=list)
    changes: list[list[AircraftHistory]] = field(default_factory=list)
    written: list[Path] = field(default_factory=list)

    def lines(self) -> list[str]:
        """Return the answer in words."""
        found: list[str] = []
        for model, each in zip(self.models, self.changes, strict=True):
            found += ["", *type_lines(model), *change_lines(each)]
        return found[1:]

    def document(self) -> dict[str, Any]:
        """Return the answer as plain values."""
        return {
            "types": [
                {**type_document(model), "changes": change_lines(each)}
                for model, each in zip(self.models, self.changes, strict=True)
            ]
        }


def fleet_answer(rows: pd.DataFrame, output: Path) -> FleetAnswer:
    """Return the model of every type, and write it as JSON, and as a prior, to `output`.

    Parameters
    ----------
    rows : pandas.DataFrame
        Rows of `FlightStore.rows`.
    output : Path
    """
    answer = FleetAnswer()
    for name, own in rows[rows["state"] == IDENTIFIED].groupby("type", sort=True):
        answer.models.append(type_model(str(name), type_flights(own), reference_cg(own)))
        answer.changes.append(histories(answer.models[-1]))
    stems = file_names(m.name for m in answer.models)
    for model, each, stem in zip(answer.models, answer.changes, stems, strict=True):
        own = rows[rows["type"] == model.name]
        document = json.dumps(type_document(model), indent=2, allow_nan=False)
        texts = {output / f"{stem}.json": document}
        texts[output / f"{stem}.html"] = fleet_page(model, each, own)
        if model.effects:
            texts[output / f"{stem}.prior.toml"] = type_prior(model)
        for path, text in texts.items():
            with atomic_write(path) as part:
                part.write_text(text, encoding="utf-8")
            answer.written.append(path)
    return answer
