"""The answer: what was estimated, what it rests on, and every form it is given in."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from host.aircraft.prior.prior_table import PriorTable
from host.sysid.aerodynamics.coefficient_table import CoefficientTable
from host.sysid.answer.json import answer_document, coefficient_document, json_text
from host.sysid.answer.prior_comparison import prior_document, prior_lines
from host.sysid.answer.save import Places, write
from host.sysid.answer.side_by_side import side_by_side
from host.sysid.answer.truth import against_truth, truth_document
from host.sysid.answer.verdict import (
    coefficient_lines,
    coefficient_words,
    model_lines,
    taken_out,
    words,
)
from host.sysid.coefficients.flight import CoefficientAnswer
from host.sysid.compatibility.reconstruction import Compatibility, document
from host.sysid.compatibility.reconstruction import words as agreement_words
from host.sysid.flight.linear import Answer
from host.sysid.flight.reconstructed import ReconstructedFlight
from host.sysid.pipeline.aircraft_known import AircraftKnown


@dataclass(frozen=True)
class Identification:
    """What one identification found."""

    flights: tuple[ReconstructedFlight, ...]
    agreement: Compatibility | None
    aircraft: AircraftKnown | None
    methods: tuple[str, ...]
    notes: tuple[str, ...]
    linear: tuple[Answer, ...]
    coefficients: CoefficientAnswer | None
    truth: dict[str, Any] | None
    prior: PriorTable | None

    @property
    def tables(self) -> list[CoefficientTable]:
        """Coefficients: fitted directly, else those of the linear models."""
        direct = self.coefficients
        return list(direct.tables) if direct else [a.table for a in self.linear]

    def document(self) -> dict[str, Any]:
        """Return everything as plain lists, numbers and strings."""
        direct, agreement = self.coefficients, self.agreement
        documents = [answer_document(a, words([a], []) + taken_out([a])) for a in self.linear]
        if direct:
            documents.append(coefficient_document(direct, coefficient_words(direct)))
        return {
            "source": self.flights[0].source,
            "notes": list(self.notes),
            "data_compatibility": document(agreement) if agreement else None,
            "answers": documents,
            "truth": truth_document(self.linear, direct, self.truth) if self.truth else None,
            "prior": prior_document(self.tables, self.prior) if self.prior else None,
        }

    def to_json(self) -> str:
        """Return the answer as JSON text; what is no finite number is null."""
        return json_text(self.document())

    def to_text(self, width: int = 100) -> str:
        """Return the answer as people read it: words first, then numbers.

        Parameters
        ----------
        width : int
            Characters of a line of the table of several methods.
        """
        lines = words(self.linear, self.notes)
        if self.coefficients:
            lines += coefficient_words(self.coefficients)
        lines += taken_out(self.linear)
        if len(self.methods) > 1:
            lines += ["", *side_by_side(self.linear, width)]
        else:
            for answer in self.linear:
                lines += ["", *model_lines(answer)]
        if self.coefficients:
            lines += ["", *coefficient_lines(self.coefficients)]
        if self.agreement:
            lines += ["", *agreement_words(self.agreement)]
        if self.prior is not None:
            lines += ["", *prior_lines(self.tables, self.prior)]
        if self.truth is not None:
            lines += ["", *against_truth(self.linear, self.coefficients, self.truth)]
        return "\n".join(lines)

    def write(self, places: Places) -> list[Path]:
        """Write every file asked for and return them."""
        return write(places, self.linear, self.coefficients, self.flights[0].recorded, self.truth)
