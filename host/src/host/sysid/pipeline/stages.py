"""`host.identify`: the stages of identification, in their order.

Estimators come by the face of their room, which imports what is asked for.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from host.aircraft.powerplant import without_propeller
from host.aircraft.prior.prior_file import read_prior
from host.errors import IdentificationError
from host.progress import stage
from host.sysid import answer, coefficients, linear
from host.sysid.checks.data_finding import accepted_in_vain
from host.sysid.estimators.method_options import check_options, options_of
from host.sysid.flight.estimator import answer_of
from host.sysid.pipeline.arguments import (
    path_of,
    paths_of,
)
from host.sysid.pipeline.flight_at_hand import FlightAtHand, listed_flights, read_flight
from host.sysid.pipeline.flight_preparation import (
    collected_findings,
    collected_notes,
    distinct_flights,
    prepare,
)
from host.sysid.pipeline.identification import Identification
from host.sysid.pipeline.known_aircraft import AircraftData, aircraft_data
from host.sysid.pipeline.reading_options import OfEach, joined_stretches, reading_options
from host.sysid.pipeline.requested_models import (
    Models,
    possible_models,
    requested_methods,
    requested_models,
)

if TYPE_CHECKING:
    from host.aircraft.prior.prior_table import PriorTable
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.flight.reconstructed_flight import ReconstructedFlight
    from host.sysid.linear.linear_answer import Answer
    from host.sysid.pipeline.flight_at_hand import Source
    from host.sysid.pipeline.requested_models import ModelName


def identify(
    flights: Source | Sequence[Source],
    *,
    aircraft: str | Path | None = None,
    models: ModelName | Iterable[ModelName] | None = None,
    methods: str | Iterable[str] | None = None,
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
    delays: bool = True,
    truth: str | Path | Sequence[str | Path] | None = None,
    prior: str | Path | None = None,
    method_options: Mapping[str, object] | None = None,
) -> Identification:
    """Find the maneuvers of flights, fit models to them jointly, check and judge the answer.

    Parameters
    ----------
    flights : path, FlightLog, DataFrame or list of them
        Log (ours, PX4's, ArduPilot's), folder or card, CSV, Parquet or MAT; what `host.read_log`
        returns, or its table. All maneuvers of several flights are fitted together, whatever their
        rates; each keeps its own biases and initial states, each flight its own sensor errors.
    aircraft : str or Path, optional
        Name or file; gives coefficients, places of the sensors and their deviations.
    models : str, Path or several, optional
        Templates by name, ``coefficients``, TOML files; ``longitudinal`` and ``lateral`` without.
    methods : str or several, optional
        Methods of linear models (`known_methods`); several are compared in one table.
    calibration : path, optional
        Counts to SI of a log, and standard deviations of the sensor errors. One for all flights, or
        a list with one (or None) of each.
    mapping : path, optional
        Foreign names, units and signs of a table; of several flights as `calibration`.
    maneuvers : int or several
        Only these of each flight, as `host maneuvers` counts them.
    stretches : list of (from, to), optional
        Spans of time, s, instead of the maneuvers found: ``[(10, 35), (60, 80)]``; of several
        flights a list of each, ``[[(10, 35), (60, 80)], [(5, 20)]]``. None stands for the end of
        the record, and in place of a flight's list for all maneuvers found in it. Each is fitted
        whatever moved in it, and none is held out; gaps of the data divide it.
    from_s, to_s : float, optional
        The same for one stretch of every flight.
    corrections : bool
        Remove sensor errors that the data determine from the columns.
    accept : str or several
        Checks of the data whose findings shall change nothing: columns are used as they are.
    sensors : mapping of str to int, optional
        Instance to use of a message in an autopilot's log: ``{"IMU": 1}``; and the surface that an
        output moves: ``{"output 2": "elevator"}``.
    row_rate_hz : float, optional
        Rows a second of original ASCII rows, which carry no time; estimated from GPS without it.
    delays : bool
        Estimate residual delays and places of sensors of linear models where nothing gives them.
    truth : path or several, optional
        Truth of simulated flights, one of each: compared with.
    prior : path, optional
        Coefficients to compare with: TOML, AVL, Datcom.
    method_options : mapping, optional
        Options by name of the methods that have some (`estimators.method_options.OPTIONS`).

    Raises
    ------
    IdentificationError
        If nothing can be identified, with every reason; if an argument is not what it should be.
    host.errors.HostError
        If a file cannot be read.
    """
    asked, by = requested_models(models), requested_methods(methods)
    options = dict(method_options or {})
    check_options(options, by)
    sources = listed_flights(flights)
    each = reading_options(
        len(sources),
        calibration=calibration,
        mapping=mapping,
        maneuvers=maneuvers,
        stretches=stretches,
        ends=(from_s, to_s),
        corrections=corrections,
        delays=delays,
        also=asked.signals,
        equations=asked.equations if aircraft is None else (),
        accept=accept,
        sensors=sensors,
        row_rate_hz=row_rate_hz,
    )
    kept, each = joined_stretches(sources, each)
    true_files = _truth_files(truth, len(sources), kept)
    sources = [sources[number] for number in kept]
    known = {
        made_by: aircraft_data(aircraft, made_by) if aircraft is not None else None
        for made_by in dict.fromkeys(how.calibration for how in each)
    }
    stage("reconstructing the flight")
    read = [
        read_flight(source, how, known[how.calibration])
        for source, how in zip(sources, each, strict=True)
    ]
    return identify_columns(
        read,
        models=asked,
        methods=by,
        truth=_truth(true_files, len(read)),
        prior=prior,
        method_options=options,
    )


def identify_columns(
    flights: FlightAtHand | Sequence[FlightAtHand],
    *,
    models: Models | ModelName | Iterable[ModelName] | None = None,
    methods: str | Iterable[str] | None = None,
    truth: dict[str, Any] | None = None,
    prior: str | Path | None = None,
    method_options: Mapping[str, object] | None = None,
) -> Identification:
    """Identify from columns that were read, or that a program has: what `host.identify` calls.

    Parameters
    ----------
    flights : FlightAtHand or several
        As `at_hand` or `read_flight` return them.
    truth : dict, optional
        Truth of simulated flights, as `host simulate` writes it.
    models, methods, prior, method_options
        As in `host.identify`.

    Raises
    ------
    IdentificationError
        If nothing can be identified, with every reason.
    """
    given = [flights] if isinstance(flights, FlightAtHand) else list(flights)
    asked = models if isinstance(models, Models) else requested_models(models)
    by, options = requested_methods(methods), dict(method_options or {})
    known, how = given[0].known, given[0].how
    ready = [prepare(flight) for flight in given]
    reading = known.doubts if known else ()
    findings = collected_findings(ready)
    more = accepted_in_vain(how.accept, findings)
    recorded = distinct_flights([one.flight for one in ready])
    expected = _prior(prior, recorded, known)
    asked, instead = possible_models(asked, [flight.recorded for flight in recorded])
    more += instead
    direct, doubts = _coefficients(asked, known, recorded)
    fitted, unfit = _linear(asked, by, options, known, recorded)
    if not fitted and direct is None:
        notes = [*collected_notes(ready, reading, unchecked=False), *more]
        raise IdentificationError("; ".join([*unfit, *doubts, *(f.line for f in findings), *notes]))
    return Identification(
        flights=tuple(recorded),
        agreements=tuple(one.agreement for one in ready),
        linear=tuple(fitted),
        coefficients=direct,
        notes=(*collected_notes(ready, reading), *more, *doubts, *unfit),
        methods=by,
        reading=how,
        aircraft=known,
        truth=truth,
        prior=expected,
        findings=findings,
    )


def _coefficients(
    asked: Models, known: AircraftData | None, flights: Sequence[ReconstructedFlight]
) -> tuple[CoefficientAnswer | None, list[str]]:
    """Fit coefficients directly; return None and a note if that fails."""
    if asked.coefficients is None:
        return None, []
    if known is None:
        raise IdentificationError(
            "argument models: coefficients need mass and sensors; give argument aircraft"
        )
    stage("coefficients")
    try:
        by = coefficients.CoefficientEstimator(
            known.airframe,
            known.powerplant or without_propeller(),
            known.instrument,
            asked.coefficients,
        )
        return answer_of(by, flights), []
    except IdentificationError as error:
        return None, [f"coefficients: {error}"]


def _linear(
    asked: Models,
    by: Sequence[str],
    options: Mapping[str, object],
    known: AircraftData | None,
    flights: Sequence[ReconstructedFlight],
) -> tuple[list[Answer], list[str]]:
    """Fit every linear model by every method; return answers, and a note for each failure."""
    answers: list[Answer] = []
    failed: dict[str, list[str]] = {}  # why, and of which models
    for method in by:
        for name, own in asked.linear:
            stage(f"{name} by {method}")
            estimator = linear.LinearEstimator(
                name,
                own,
                method,
                airframe=known.airframe if known else None,
                powerplant=known.powerplant if known else None,
                named=asked.named,
                options=options_of(method, options),
            )
            try:
                answers.append(answer_of(estimator, flights))
            except IdentificationError as error:
                label = name if len(by) == 1 else f"{name} by {method}"
                failed.setdefault(str(error), []).append(label)
    return answers, [f"{', '.join(labels)}: {error}" for error, labels in failed.items()]


def _truth_files(
    given: str | Path | Sequence[str | Path] | None, flights: int, kept: Sequence[int]
) -> list[Path]:
    """Return the files of truth; of a source that was given again one of its own may be given."""
    paths = paths_of("truth", given)
    return [paths[number] for number in kept] if len(paths) == flights else paths


def _truth(paths: Sequence[Path], flights: int) -> dict[str, Any] | None:
    """Return the truth of all flights as one, with the maneuvers of all."""
    if not paths:
        return None
    documents = [answer.read_truth(path) for path in paths]
    if len(documents) != flights:
        raise IdentificationError(
            f"{len(documents)} files of truth for {flights} flights; give one of each flight"
        )
    if len(documents) == 1:
        return documents[0]
    return {"maneuver": [m for document in documents for m in document["maneuver"]]}


def _prior(
    prior: str | Path | None, flights: Sequence[ReconstructedFlight], known: AircraftData | None
) -> PriorTable | None:
    """Return coefficients to compare with, read at the median airspeed of all flights."""
    source = path_of("prior", prior)
    if source is None:
        return None
    speeds = sorted(x for f in flights for x in f.recorded.get("airspeed_mps", ()))
    found = read_prior(source, speeds[len(speeds) // 2] if speeds else 0.0)
    if known is None:
        raise IdentificationError(
            "argument prior compares coefficients; they need argument aircraft"
        )
    return found
