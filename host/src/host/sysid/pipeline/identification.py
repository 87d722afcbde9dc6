"""The answer of `host.identify`: estimates, the data they rest on, and all forms of output.

A form that is asked for is imported then: pictures, files, pages, comparison with truth or prior.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from host.sysid.answer.answer_summary import AnswerSummary, sources_apart
from host.sysid.answer.method_comparison import method_table
from host.sysid.answer.summary_lines import COLUMNS, advice_lines, summary_lines
from host.sysid.answer.verdict import judge, removed_error_lines
from host.sysid.checks.data_finding import Finding
from host.sysid.pipeline.arguments import chosen_stretches, numbers_of, path_of
from host.sysid.pipeline.estimate_table import estimate_table, mode_table, shown_tables
from host.sysid.pipeline.flight_at_hand import listed_flights, read_flight
from host.sysid.pipeline.flight_preparation import prepare
from host.sysid.reconstruction.reconstruction import Compatibility

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from host.aircraft.prior.prior_table import PriorTable
    from host.export.pictures import Pictures
    from host.sysid.aerodynamics.coefficient import CoefficientTable
    from host.sysid.answer.autotune_opinion import Opinion
    from host.sysid.answer.marks import Verdict
    from host.sysid.answer.output_files import OutputPaths
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.flight.reconstructed_flight import ReconstructedFlight
    from host.sysid.linear.linear_answer import Answer
    from host.sysid.pipeline.flight_at_hand import Source
    from host.sysid.pipeline.known_aircraft import AircraftData
    from host.sysid.pipeline.reading_options import ReadingOptions
    from host.sysid.pipeline.simulation import Simulation


@dataclass(frozen=True, eq=False)
class Identification:
    """The result of one identification.

    Attributes
    ----------
    flights : tuple of ReconstructedFlight
        As recorded and corrected, with the maneuvers found.
    agreements : tuple of Compatibility or None
        Data-compatibility check of each flight.
    linear : tuple of Answer
        Answers of linear models, one of each model and method.
    coefficients : CoefficientAnswer or None
        Fitted directly.
    notes : tuple of str
        What was done to the data, and which models could not be fitted.
    findings : tuple of Finding
        What checks found in the columns, and what was done about it.
    """

    flights: tuple[ReconstructedFlight, ...]
    agreements: tuple[Compatibility | None, ...]
    linear: tuple[Answer, ...]
    coefficients: CoefficientAnswer | None
    notes: tuple[str, ...]
    methods: tuple[str, ...]
    reading: ReadingOptions
    aircraft: AircraftData | None = None
    truth: dict[str, Any] | None = None
    prior: PriorTable | None = None
    findings: tuple[Finding, ...] = ()

    @property
    def table(self) -> pd.DataFrame:
        """Every estimate by model and name: value, 95 % half-width, unit, verdict, main cause.

        A table of the caller's own: what is written into it changes no answer.
        """
        return estimate_table(self.linear, self.coefficients, self.verdicts)

    @property
    def modes(self) -> pd.DataFrame:
        """Every mode by model and name, with 95 % half-widths."""
        return mode_table(self.linear, self.coefficients, self.verdicts)

    @property
    def verdict(self) -> tuple[str, ...]:
        """Lines on what to trust, what not and why, what to fly again, what was corrected."""
        return (*self.judgement, *removed_error_lines(self.linear))

    @property
    def judgement(self) -> tuple[str, ...]:
        """Lines on what to trust, what not and why, and what to fly again."""
        # What the log lost is a note, and nothing that was read of it may be said before.
        said = (f"note: {note}" for note in self.notes)
        found = (finding.line for finding in self.findings)
        return (*said, *found, *(line for verdict in self.verdicts for line in verdict.lines))

    @cached_property
    def verdicts(self) -> tuple[Verdict, ...]:
        """The verdict on each of `answers`, made once for every form of output."""
        return judge(self.linear, self.coefficients, self.findings)

    @cached_property
    def summary(self) -> AnswerSummary:
        """What is said at first: how well each motion is known, and what to do next."""
        flown = tuple(maneuver for flight in self.flights for maneuver in flight.maneuvers)
        return AnswerSummary(
            self.linear, self.coefficients, self.verdicts, flown, self.findings, self.notes,
            self.aircraft is not None, len(self.flights),
        )  # fmt: skip

    @property
    def answers(self) -> tuple[Answer | CoefficientAnswer, ...]:
        """Every answer: linear models first, then the coefficients fitted directly."""
        return (*self.linear, self.coefficients) if self.coefficients else self.linear

    @property
    def coefficient_tables(self) -> list[CoefficientTable]:
        """Coefficients: fitted directly, else those of the linear models."""
        direct = self.coefficients
        return list(direct.tables) if direct else [a.table for a in self.linear]

    @property
    def opinion_lines(self) -> list[str]:
        """What autotunes say, in words."""
        both = zip(self.linear, self.opinions, strict=False)
        return [f"{answer.template}: {one.line}" for answer, every in both for one in every]

    def plot(self) -> Pictures:
        """Return all pictures: time histories, poles, intervals, spectra of the inputs.

        Raises
        ------
        IdentificationError
            If matplotlib is missing.
        """
        from host.export.pictures import Pictures
        from host.sysid.answer.answer_figures import draw_all

        recorded = [flight.recorded for flight in self.flights]
        made = self.linear, self.coefficients, self.verdicts
        return Pictures(draw_all(*made, recorded, self.truth, self.findings))

    def frequency(self) -> tuple[list[Figure], list[str]]:
        """Return one picture of the frequency responses of all linear models, and it in words.

        No picture, and why in a line, where records are too short.

        Raises
        ------
        IdentificationError
            If matplotlib is missing.
        """
        from host.sysid.answer.frequency_pictures import frequency_pictures

        return frequency_pictures(self.linear, self.findings, self.opinions)

    @cached_property
    def opinions(self) -> tuple[tuple[Opinion, ...], ...]:
        """What autotunes in the logs say of each linear answer's response."""
        if not any(flight.tuned for flight in self.flights):
            return ()
        from host.sysid.answer.autotune_opinion import opinions

        return tuple(opinions(answer, self.flights) for answer in self.linear)

    def simulate(
        self,
        flight: Source,
        *,
        calibration: str | Path | None = None,
        mapping: str | Path | None = None,
        maneuvers: int | Sequence[int] = (),
        stretches: Sequence[Any] | None = None,
        from_s: float | None = None,
        to_s: float | None = None,
        constants: bool = True,
    ) -> Simulation:
        """Fly every model over another flight by its measured surfaces, biases fitted to each.

        Parameters
        ----------
        flight : path, FlightLog or DataFrame
            Read and corrected as those identified from.
        calibration, mapping : path, optional
            Where they are not those of this identification.
        maneuvers, stretches, from_s, to_s
            As in `host.identify`; all maneuvers without.
        constants : bool
            Fit biases and start states; without they are those of the trim before each input.

        Raises
        ------
        host.errors.HostError
            If it cannot be read, or no model can be run over it.
        """
        from host.sysid.pipeline.simulation import identified_models, simulate

        how = replace(
            self.reading,
            calibration=path_of("calibration", calibration) or self.reading.calibration,
            mapping=path_of("mapping", mapping) or self.reading.mapping,
            maneuvers=numbers_of("maneuvers", maneuvers),
            stretches=chosen_stretches(stretches, from_s, to_s, 1)[0],
        )
        [source] = listed_flights([flight])
        found = prepare(read_flight(source, how, self.aircraft))
        models = identified_models(self.linear, self.coefficients)
        notes = (*found.notes, *found.unchecked)
        return simulate(models, found.flight, notes, constants=constants)

    def document(self) -> dict[str, Any]:
        """Return everything as plain lists, numbers and strings; several flights are lists."""
        from host.sysid.pipeline.whole_answer import whole_document

        return whole_document(self)

    def to_json(self) -> str:
        """Return the answer as JSON text; what is no finite number is null."""
        from host.sysid.answer.json_document import json_text

        return json_text(self.document())

    def to_text(self, width: int = 100, *, full: bool = True) -> str:
        """Return the answer as people read it: words first, then numbers.

        Parameters
        ----------
        width : int
            Characters of a line of the table of several methods.
        full : bool
            Everything; without it a summary of 25 lines, one more for each finding, and the
            comparison with a truth or a prior that was given.
        """
        pitots: list[str] = []
        if any(self.agreements):
            from host.sysid.answer.pitot_parameter import pitot_lines

            pitots = pitot_lines(self.flights, self.agreements)
        if full:
            known, advice = self.summary.known, advice_lines(self.summary)
            said = [*pitots, *self.opinion_lines]
            lines = [known, *self.verdict, *said, *advice, *self._numbers(width)]
        else:
            said = [*pitots, *(one.short for every in self.opinions for one in every)]
            lines = [*self.summary_lines(width), *said]
        if self.prior is not None or self.truth is not None:
            from host.sysid.pipeline.whole_answer import compared_lines

            lines += compared_lines(self)
        return "\n".join(lines)

    def summary_lines(self, width: int = COLUMNS) -> list[str]:
        """Return the summary on one screen: 25 lines for one flight, one more for each finding.

        Parameters
        ----------
        width : int
            Characters of a line of the table of several methods.
        """
        table = method_table(self.linear, width) if len(self.methods) > 1 else None
        sources = [flight.source for flight in self.flights]
        return summary_lines(self.summary, sources_apart(self.notes, sources), table)

    def _numbers(self, width: int) -> list[str]:
        from host.sysid.pipeline.whole_answer import number_lines

        return number_lines(self, width)

    def save(self, places: OutputPaths) -> list[Path]:
        """Write every requested file and return them.

        Raises
        ------
        UsageError
            If a place cannot be written to, or holds what the answer is made from.
        """
        from host.sysid.answer.output_files import check_outputs, write_outputs

        check_outputs(places)
        recorded = [flight.recorded for flight in self.flights]
        return write_outputs(
            places,
            self.linear,
            self.coefficients,
            self.verdicts,
            recorded,
            self.truth,
            self.findings,
        )

    def __str__(self) -> str:
        """Return the text that `host identify` prints."""
        return self.to_text(full=False)

    def __repr__(self) -> str:
        """Return in a line what was identified of what."""
        named = ", ".join(a.template for a in self.answers)
        return f"<Identification of {', '.join(f.source for f in self.flights)}: {named}>"

    def _repr_html_(self) -> str:
        from host.sysid.pipeline.notebook_html import answer_html

        sources = ", ".join(flight.source for flight in self.flights)
        tables = shown_tables(self.table, self.modes)
        return answer_html(f"identified from {sources}", self.summary_lines(), tables)
