"""`host identify`: from a flight to a model, its uncertainty, and what to trust of it."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from host.aircraft.powerplant import Powerplant
    from host.instrument.deviations import SensorErrorModel
    from host.sysid.answer.save import Places
    from host.sysid.coefficients.flight import CoefficientAnswer
    from host.sysid.coefficients.model import CoefficientModel
    from host.sysid.compatibility.reconstruction import Compatibility
    from host.sysid.flight.finder import Found
    from host.sysid.flight.linear import Answer


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "identify",
        help="estimate the aircraft's derivatives with their uncertainty",
        description="Find the maneuvers of a flight, fit a model to them jointly, check it on"
        " maneuvers it has not seen, and say what of it can be trusted.",
    )
    parser.add_argument("source", type=Path, nargs="?", help="log, CSV, Parquet or MAT file")
    parser.add_argument("--map", type=Path, metavar="TOML", help="foreign names, units and signs")
    parser.add_argument("--calibration", type=Path, metavar="TOML", help="calibration of a log")
    parser.add_argument(
        "--model",
        action="append",
        metavar="NAME",
        help="longitudinal, lateral, short-period, phugoid, roll, dutch-roll or a TOML file;"
        " 'coefficients' (with --aircraft) fits lift, drag, side force and moments directly,"
        " a TOML file of kind 'coefficients' with terms of its own;"
        " repeatable (default: longitudinal and lateral)",
    )
    parser.add_argument(
        "--method",
        action="append",
        metavar="NAME",
        help="estimator, repeatable for a side-by-side table; 'list' shows them",
    )
    parser.add_argument("--aircraft", metavar="NAME", help="aircraft file: mass, sizes, sensors;"
                        " gives coefficients")  # fmt: skip
    parser.add_argument("--truth", type=Path, metavar="TOML",
                        help="truth of a simulated flight: compare with it")  # fmt: skip
    parser.add_argument("--prior", type=Path, metavar="FILE",
                        help="coefficients to compare with: TOML, AVL, Datcom")  # fmt: skip
    parser.add_argument("--from", dest="from_s", type=float, metavar="S", help="start of the fit")
    parser.add_argument("--to", dest="to_s", type=float, metavar="S", help="end of the fit")
    parser.add_argument("--maneuver", type=int, action="append", metavar="N",
                        help="use only maneuver N of `host maneuvers`; repeatable")  # fmt: skip
    parser.add_argument("--no-corrections", action="store_true",
                        help="leave sensor errors that the flight tells in the data")  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--mat", type=Path, metavar="FILE", help="write a MAT file")
    parser.add_argument("--plots", type=Path, metavar="DIR", help="write pictures")
    parser.add_argument(
        "--save-model",
        type=Path,
        metavar="FILE",
        help="write the model as .toml or .mat, with --aircraft as .xml for JSBSim",
    )
    parser.add_argument(
        "--save-aircraft",
        type=Path,
        metavar="FILE",
        help="write the aircraft for `host simulate`, with --aircraft",
    )


def run(args: argparse.Namespace) -> int:
    """Identify and print the answer: words first, then numbers."""
    # The matrices are small: threads of BLAS only wait for each other (28 s against 5 measured).
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from host.errors import ExitCode
    from host.sysid.answer.save import check, write
    from host.sysid.answer.verdict import (
        coefficient_lines,
        coefficient_words,
        model_lines,
        taken_out,
        words,
    )
    from host.sysid.compatibility.reconstruction import document
    from host.sysid.compatibility.reconstruction import words as agreement_words
    from host.sysid.errors import IdentificationError
    from host.sysid.estimators.fit import methods as single_methods
    from host.sysid.flight.chosen import chosen
    from host.sysid.flight.linear import DEFAULT_METHOD, STAGED, identify
    from host.sysid.flight.tables import read_columns

    known = {**STAGED, **single_methods()}
    wanted = list(dict.fromkeys(args.method or [DEFAULT_METHOD]))
    if "list" in wanted:
        print("\n".join(f"{name:26s} {about}" for name, about in known.items()))
        return int(ExitCode.OK)
    if args.source is None:
        raise IdentificationError("name the flight: a log, CSV, Parquet or MAT file")
    unknown = [m for m in wanted if m not in known]
    if unknown:
        raise IdentificationError(f"unknown method {', '.join(unknown)}; known: {', '.join(known)}")
    models = _models(args.model)
    places = _places(args)
    check(places)
    own = {s for _, model in models if model for s in (*model.inputs, *model.outputs)}
    columns, notes = read_columns(
        args.source, args.map, calibration=args.calibration, also=sorted(own)
    )
    airframe = None
    if args.aircraft:
        from host.aircraft.file import load_measured
        from host.aircraft.mass_properties import airframe_data

        airframe = airframe_data(args.aircraft)
        notes += load_measured(args.aircraft).doubts
    truth = None
    if args.truth:
        from host.sysid.answer.truth import read_truth

        truth = read_truth(args.truth)
    prior = None
    if args.prior:
        from host.aircraft.prior.prior_file import read_prior

        speed = columns.get("airspeed_mps", ())
        prior = read_prior(args.prior, sorted(speed)[len(speed) // 2] if len(speed) else 0.0)
        if not args.aircraft:
            raise IdentificationError("--prior compares coefficients; they need --aircraft")
    windows = chosen(columns, from_s=args.from_s, to_s=args.to_s, numbers=args.maneuver or ())
    instrument = _instrument(args.aircraft, args.calibration)
    agreement = _agreement(columns, airframe, instrument, notes)
    # Without the places of the sensors a vane ahead of the CG passes for a late one.
    known_errors = agreement if airframe is not None and not args.no_corrections else None
    rotor = _rotor(args.aircraft)
    answers: list[Answer] = []
    terms = _coefficient_model(args.model)
    direct = _direct(args, columns, windows, instrument, notes, terms) if terms else None
    failed: dict[str, list[str]] = {}  # why, and of which models
    for method in wanted:
        for name, user_model in models:
            try:
                answers += identify(
                    columns,
                    names=(name,),
                    method=method,
                    airframe=airframe,
                    windows=windows,
                    user_model=user_model,
                    compatibility=known_errors,
                    powerplant=rotor,
                )
            except IdentificationError as error:
                label = name if len(wanted) == 1 else f"{name} by {method}"
                failed.setdefault(str(error), []).append(label)
    unfit = [f"{', '.join(labels)}: {error}" for error, labels in failed.items()]
    if not answers and direct is None:
        raise IdentificationError("; ".join([*unfit, *notes]))
    notes += unfit
    tables = list(direct.tables) if direct else [a.table for a in answers]
    if args.json:
        from host.sysid.answer.json import answer_document, coefficient_document, json_text
        from host.sysid.answer.prior_comparison import prior_document
        from host.sysid.answer.truth import truth_document

        documents = [answer_document(a, words([a], []) + taken_out([a])) for a in answers]
        if direct:
            documents.append(coefficient_document(direct, coefficient_words(direct)))
        text = json_text(
            {
                "source": str(args.source),
                "notes": notes,
                "data_compatibility": document(agreement) if agreement else None,
                "answers": documents,
                "truth": truth_document(answers, direct, truth) if truth else None,
                "prior": prior_document(tables, prior) if prior else None,
            }
        )
        # What was written is said before the answer, so that no answer follows an error.
        _say(write(places, answers, direct, columns, truth))
        print(text)
        return int(ExitCode.OK)
    lines = words(answers, notes)
    if direct:
        lines += coefficient_words(direct)
    lines += taken_out(answers)
    if len(wanted) > 1:
        from host.sysid.answer.side_by_side import side_by_side

        lines += ["", *side_by_side(answers, shutil.get_terminal_size().columns)]
    else:
        for answer in answers:
            lines += ["", *model_lines(answer)]
    if direct:
        lines += ["", *coefficient_lines(direct)]
    if agreement:
        lines += ["", *agreement_words(agreement)]
    if prior is not None:
        from host.sysid.answer.prior_comparison import prior_lines

        lines += ["", *prior_lines(tables, prior)]
    if truth is not None:
        from host.sysid.answer.truth import against_truth

        lines += ["", *against_truth(answers, direct, truth)]
    try:
        written = write(places, answers, direct, columns, truth)
    except IdentificationError:
        print("\n".join(lines))  # the answer is not lost with its file
        raise
    print("\n".join(lines))
    _say(written)
    return int(ExitCode.OK)


def _places(args: argparse.Namespace) -> Places:
    """Return where files go, and every file that the answer is made from."""
    from host.sysid.answer.save import Places

    given = [args.source, args.map, args.calibration, args.truth, args.prior]
    given += [Path(name) for name in (args.aircraft, *(args.model or ())) if name]
    return Places(
        plots=args.plots,
        mat=args.mat,
        model=args.save_model,
        aircraft=args.save_aircraft,
        source=args.aircraft,
        given=tuple(path for path in given if path is not None),
    )


def _say(written: list[Path]) -> None:
    """Say what was written, pictures by their number."""
    pictures = [path for path in written if path.suffix == ".svg"]
    parts = [str(path) for path in written if path not in pictures]
    if pictures:
        parts.append(f"{len(pictures)} pictures in {pictures[0].parent}")
    if parts:
        print(f"wrote {', '.join(parts)}", file=sys.stderr)


def _models(names: list[str] | None) -> list[tuple[str, Any]]:
    from host.sysid.coefficients.model import is_coefficient_model
    from host.sysid.errors import IdentificationError
    from host.sysid.flight.column_map import like
    from host.sysid.flight.linear import AXIS_OF
    from host.sysid.models.model_file import read_model

    result: list[tuple[str, Any]] = []
    for name in names or ["longitudinal", "lateral"]:
        if name == "coefficients" or is_coefficient_model(Path(name)):
            continue
        if name in AXIS_OF:
            result.append((name, None))
        elif Path(name).exists() or name.lower().endswith(".toml"):
            result.append((name, read_model(Path(name))))
        else:
            raise IdentificationError(
                f"no model '{name}'{like(name, tuple(AXIS_OF))}; there are {', '.join(AXIS_OF)},"
                " coefficients, or a TOML file"
            )
    return result


def _coefficient_model(names: list[str] | None) -> CoefficientModel | None:
    """Return the terms of the coefficients that were asked for; None if none were."""
    from host.sysid.coefficients.model import (
        is_coefficient_model,
        read_coefficient_model,
        standard_model,
    )
    from host.sysid.errors import IdentificationError

    own = [name for name in names or () if is_coefficient_model(Path(name))]
    if len(own) + ("coefficients" in (names or ())) > 1:
        raise IdentificationError("one model of the coefficients at a time; --model names several")
    if own:
        return read_coefficient_model(Path(own[0]))
    return standard_model() if "coefficients" in (names or ()) else None


def _rotor(aircraft: str | None) -> Powerplant | None:
    """Return the propeller; None where the file, if any, does not describe it."""
    from host.aircraft.powerplant import NoPropulsionError, powerplant

    try:
        return powerplant(aircraft) if aircraft else None
    except NoPropulsionError:
        return None


def _instrument(aircraft: str | None, path: Path | None) -> SensorErrorModel | None:
    """Return the sensors, and what the calibration says that they may be wrong by."""
    from host.instrument.deviations import sensor_error_model
    from host.physical.calibration import load_calibration

    return (
        sensor_error_model(aircraft, load_calibration(path) if path else None) if aircraft else None
    )


def _agreement(
    columns: dict[str, Any],
    airframe: Any,
    instrument: SensorErrorModel | None,
    notes: list[str],
) -> Compatibility | None:
    """Return what sensors are wrong by; None with a note where it cannot be told."""
    from host.sysid.compatibility.reconstruction import reconstruct
    from host.sysid.errors import IdentificationError

    try:
        return reconstruct(columns, airframe, instrument)
    except IdentificationError as error:
        notes.append(str(error))
        return None


def _direct(
    args: argparse.Namespace,
    columns: dict[str, Any],
    windows: list[Found] | None,
    instrument: SensorErrorModel | None,
    notes: list[str],
    terms: CoefficientModel,
) -> CoefficientAnswer | None:
    """Fit coefficients directly; None with a note if that cannot be done."""
    from host.sysid.errors import IdentificationError

    if not args.aircraft:
        raise IdentificationError("--model coefficients needs mass and sensors; give --aircraft")
    from host.sysid.coefficients.flight import identify_coefficients

    try:
        return identify_coefficients(
            columns, args.aircraft, windows=windows, model=terms, instrument=instrument
        )
    except IdentificationError as error:
        notes.append(f"coefficients: {error}")
        return None
