"""`host.identify`: the stages of identification, in their order."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from host.aircraft.prior.prior_file import read_prior
from host.aircraft.prior.prior_table import PriorTable
from host.sysid.answer.truth import read_truth
from host.sysid.coefficients.flight import CoefficientAnswer, coefficient_estimator
from host.sysid.compatibility.reconstruction import Compatibility, reconstruct
from host.sysid.errors import IdentificationError
from host.sysid.flight.chosen import chosen
from host.sysid.flight.linear import Answer, LinearEstimator
from host.sysid.flight.reconstructed import ReconstructedFlight, reconstructed
from host.sysid.flight.tables import read_columns
from host.sysid.pipeline.aircraft_known import AircraftKnown, aircraft_known
from host.sysid.pipeline.estimator import answer_of
from host.sysid.pipeline.identification import Identification
from host.sysid.pipeline.wanted import ModelName, Models, wanted_methods, wanted_models

Source = str | Path


def identify(
    flights: Source,
    *,
    aircraft: str | Path | None = None,
    models: ModelName | Iterable[ModelName] | None = None,
    methods: str | Iterable[str] | None = None,
    calibration: str | Path | None = None,
    mapping: str | Path | None = None,
    maneuvers: Sequence[int] = (),
    from_s: float | None = None,
    to_s: float | None = None,
    corrections: bool = True,
    truth: str | Path | None = None,
    prior: str | Path | None = None,
) -> Identification:
    """Find the maneuvers of a flight, fit models to them jointly, check and judge the answer.

    Parameters
    ----------
    flights : str or Path
        Log, folder or card, CSV, Parquet or MAT.
    aircraft : str or Path, optional
        Name or file; gives coefficients, places of the sensors and their deviations.
    models : str, Path or several, optional
        Templates by name, ``coefficients``, TOML files; ``longitudinal`` and ``lateral`` without.
    methods : str or several, optional
        Methods of linear models (`known_methods`); several are held against each other.
    calibration : path, optional
        Counts to SI of a log, and what the instrument may be wrong by.
    mapping : path, optional
        Foreign names, units and signs of a table.
    maneuvers : sequence of int
        Only these, as `host maneuvers` counts them.
    from_s, to_s : float, optional
        One stretch of time in place of the maneuvers found.
    corrections : bool
        Take sensor errors that the flight tells out of the data.
    truth : path, optional
        Of a simulated flight: compared with.
    prior : path, optional
        Coefficients to compare with: TOML, AVL, Datcom.

    Raises
    ------
    IdentificationError
        If nothing can be identified, with every reason.
    host.errors.HostError
        If a file cannot be read.
    """
    asked, by = wanted_models(models), wanted_methods(methods)
    columns, notes = read_columns(
        Path(flights),
        _path(mapping),
        calibration=_path(calibration),
        also=asked.signals,
    )
    known = aircraft_known(aircraft, calibration) if aircraft is not None else None
    notes += known.doubts if known else ()
    true = read_truth(Path(truth)) if truth is not None else None
    expected = _prior(prior, columns, known)
    found = chosen(columns, from_s=from_s, to_s=to_s, numbers=maneuvers)
    agreement = _agreement(columns, known, notes)
    flight = reconstructed(
        columns,
        found,
        source=str(flights),
        airframe=known.airframe if known else None,
        # Without the places of the sensors a vane ahead of the CG passes for a late one.
        compatibility=agreement if known is not None and corrections else None,
    )
    direct, doubts = _coefficients(asked, known, flight)
    linear, unfit = _linear(asked, by, known, flight)
    notes += doubts
    if not linear and direct is None:
        raise IdentificationError("; ".join([*unfit, *notes]))
    return Identification(
        flights=(flight,),
        agreement=agreement,
        aircraft=known,
        methods=by,
        notes=(*notes, *unfit),
        linear=tuple(linear),
        coefficients=direct,
        truth=true,
        prior=expected,
    )


def _coefficients(
    asked: Models, known: AircraftKnown | None, flight: ReconstructedFlight
) -> tuple[CoefficientAnswer | None, list[str]]:
    """Fit coefficients directly; None with a note if that cannot be done."""
    if asked.coefficients is None:
        return None, []
    if known is None:
        raise IdentificationError("--model coefficients needs mass and sensors; give --aircraft")
    try:
        by = coefficient_estimator(
            known.source, model=asked.coefficients, instrument=known.instrument
        )
        return answer_of(by, [flight]), []
    except IdentificationError as error:
        return None, [f"coefficients: {error}"]


def _linear(
    asked: Models, by: Sequence[str], known: AircraftKnown | None, flight: ReconstructedFlight
) -> tuple[list[Answer], list[str]]:
    """Fit every linear model by every method; a note for each reason why one was not."""
    answers: list[Answer] = []
    failed: dict[str, list[str]] = {}  # why, and of which models
    for method in by:
        for name, own in asked.linear:
            estimator = LinearEstimator(
                name,
                own,
                method,
                airframe=known.airframe if known else None,
                powerplant=known.powerplant if known else None,
            )
            try:
                answers.append(answer_of(estimator, [flight]))
            except IdentificationError as error:
                label = name if len(by) == 1 else f"{name} by {method}"
                failed.setdefault(str(error), []).append(label)
    return answers, [f"{', '.join(labels)}: {error}" for error, labels in failed.items()]


def _path(given: str | Path | None) -> Path | None:
    return None if given is None else Path(given)


def _prior(
    prior: str | Path | None, columns: dict[str, Any], known: AircraftKnown | None
) -> PriorTable | None:
    """Return coefficients to compare with, read at the flight's median airspeed."""
    if prior is None:
        return None
    speed = columns.get("airspeed_mps", ())
    found = read_prior(Path(prior), sorted(speed)[len(speed) // 2] if len(speed) else 0.0)
    if known is None:
        raise IdentificationError("--prior compares coefficients; they need --aircraft")
    return found


def _agreement(
    columns: dict[str, Any], known: AircraftKnown | None, notes: list[str]
) -> Compatibility | None:
    """Return what sensors are wrong by; None with a note where it cannot be told."""
    try:
        return reconstruct(
            columns, known.airframe if known else None, known.instrument if known else None
        )
    except IdentificationError as error:
        notes.append(str(error))
        return None
