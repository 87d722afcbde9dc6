"""What an answer is written to: every place checked before the work, every file whole."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from host.errors import IdentificationError
from host.export.atomic_files import atomic_write, check_destination, file_names
from host.extras import install_hint
from host.sysid.answer.mat_file import labels, write_answers
from host.sysid.answer.settling_history import has_history, write_history
from host.sysid.answer.simulator_forms import CONTROL, FORMS, files_of, form_of, write_form
from host.sysid.checks.data_finding import Finding
from host.sysid.estimators.method_registry import all_methods

if TYPE_CHECKING:
    from host.arrays import Array
    from host.sysid.aerodynamics.coefficient import CoefficientTable
    from host.sysid.answer.marks import Verdict
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.linear.linear_answer import Answer

ENDINGS = {
    "mat": (".mat",),
    "save_model": (".toml", ".mat", ".xml", *FORMS),
    "save_aircraft": (".toml", ".xml"),
    "history": (".csv",),
}


@dataclass(frozen=True, slots=True)
class OutputPaths:
    """Paths of the files that the user wants, and the aircraft that the answer is made with.

    Attributes
    ----------
    plots : Path, optional
        Folder for pictures.
    mat, save_model, save_aircraft, history : Path, optional
        Files; their endings choose the format (`ENDINGS`).
    source : str, optional
        Aircraft by name or file: mass and geometry of what is saved.
    given : tuple of Path
        Files the answer is made from, which no output may replace.
    """

    plots: Path | None = None
    mat: Path | None = None
    save_model: Path | None = None
    save_aircraft: Path | None = None
    history: Path | None = None
    source: str | None = None
    given: tuple[Path, ...] = ()

    @property
    def files(self) -> dict[str, Path]:
        """Every file asked for, by its argument."""
        asked = {name: getattr(self, name) for name in ENDINGS}
        return {name: path for name, path in asked.items() if path is not None}


def check_outputs(places: OutputPaths, methods: Sequence[str] | None = None) -> None:
    """Refuse what cannot be written while it costs nothing: before the flight is read.

    Parameters
    ----------
    places : OutputPaths
    methods : sequence of str, optional
        That are asked for; without them a history may come of any.

    Raises
    ------
    IdentificationError
        A place that is none, an ending that says nothing, a file that would replace its own
        source, an aircraft without what it is made of, a history by methods that note none,
        pictures without matplotlib.
    """
    if places.history is not None and methods is not None and not {*_settling()} & {*methods}:
        raise _no_history(places.history)
    taken: dict[Path, str] = {}
    for name, path in places.files.items():
        _check_file(name, path, places.given)
        argument = f"argument {name}"
        other = taken.setdefault(path.absolute(), argument)
        if other != argument:
            raise IdentificationError(f"{other} and {argument} both name {path}; name two files")
    _check_aircraft(places)
    if places.plots is not None:
        check_destination("argument plots", places.plots, folder=True)
        if importlib.util.find_spec("matplotlib") is None:
            raise IdentificationError(f"pictures need matplotlib: {install_hint('matplotlib')}")


def _check_file(name: str, path: Path, given: Sequence[Path]) -> None:
    """Refuse an ending that says nothing, no place, a file that the answer is made from."""
    known, argument = ENDINGS[name], f"argument {name}"
    if not path.name.lower().endswith(known):
        raise IdentificationError(
            f"{argument} {path}: ends in '{path.suffix}', expected {' or '.join(known)}"
        )
    check_destination(argument, path, folder=False)
    for own in files_of(path):
        if any(own.exists() and g.exists() and own.samefile(g) for g in given):
            raise IdentificationError(
                f"{argument} {own} is what the answer is made from; name another file"
            )


def _check_aircraft(places: OutputPaths) -> None:
    """Refuse an aircraft to be saved without one that has mass, geometry and tables."""
    model = places.save_model
    whole = model if model is not None and _whole(model) else places.save_aircraft
    if whole is None:
        return
    if not places.source:
        raise IdentificationError(
            f"{whole}: an aircraft needs mass and geometry; give argument aircraft"
        )
    from host.aircraft import file as aircraft

    aircraft.load(places.source)  # one that was only measured has no tables to put answers in


def _whole(path: Path) -> bool:
    """Return whether a file to save a model in holds an aircraft: mass, sizes, coefficients."""
    form = form_of(path)
    return form != CONTROL if form else path.suffix.lower() == ".xml"


def write_outputs(
    places: OutputPaths,
    answers: Sequence[Answer],
    direct: CoefficientAnswer | None,
    verdicts: Sequence[Verdict],
    flights: Sequence[Mapping[str, Array]],
    truth: dict[str, Any] | None,
    findings: Sequence[Finding] = (),
) -> list[Path]:
    """Write everything asked for and return the files.

    Parameters
    ----------
    places : OutputPaths
        Looked at by `check_outputs` before.
    answers : sequence of Answer
        Linear models.
    direct : CoefficientAnswer or None
        A direct fit of coefficients.
    verdicts : sequence of Verdict
        Verdicts of all answers, linear ones first.
    flights : sequence of mapping
        Columns of each, whose surfaces give the spectrum of the inputs.
    truth : dict or None
        Truth of a simulated flight, for the pictures.
    findings : sequence of Finding
        Findings of the data, for the pictures.

    Raises
    ------
    UsageError
        If a file cannot be written, or holds nothing that is known.
    """
    written: list[Path] = []
    if places.mat is not None:
        write_answers(places.mat, answers, direct)
        written.append(places.mat)
    tables = list(direct.tables) if direct else [a.table for a in answers]
    if places.save_aircraft is not None:
        written.append(_write_aircraft(places.save_aircraft, tables, places.source, direct))
    if places.save_model is not None:
        written += _write_model(places.save_model, places, answers, direct, tables, written)
    if places.history is not None:
        written += _write_histories(places.history, answers, (*places.given, *written))
    if places.plots is not None:
        from host.export.pictures import save_all
        from host.sysid.answer.answer_figures import draw_all

        drawn = draw_all(answers, direct, verdicts, flights, truth, findings)
        written += save_all(drawn, places.plots)
    return written


def _write_model(
    path: Path,
    places: OutputPaths,
    answers: Sequence[Answer],
    direct: CoefficientAnswer | None,
    tables: Sequence[CoefficientTable],
    written: Sequence[Path],
) -> list[Path]:
    """Write the model in the format that its ending names.

    Coefficients alone are an aircraft, not a linear model.
    """
    if path.suffix.lower() == ".mat":
        write_answers(path, answers, direct)
        return [path]
    if form_of(path):
        condition = direct.fit.condition if direct else None
        return write_form(path, tables, answers, places.source, condition)
    if path.suffix.lower() == ".xml" or not answers:
        return [_write_aircraft(path, tables, places.source, direct)]
    return _write_models(path, answers, (*places.given, *written))


def _write_aircraft(
    path: Path,
    tables: Sequence[CoefficientTable],
    source: str | None,
    direct: CoefficientAnswer | None,
) -> Path:
    from host.sysid.answer.aircraft_export import save_aircraft

    if not source:
        raise IdentificationError(
            f"{path}: an aircraft needs mass and geometry; give argument aircraft"
        )
    save_aircraft(path, tables, source, direct.fit.condition if direct else None)
    return path


def _write_models(path: Path, answers: Sequence[Answer], kept: Sequence[Path]) -> list[Path]:
    from host.sysid.models.model_text import model_text

    named = _named("save_model", path, answers, kept)
    for own, answer in named.items():
        with atomic_write(own) as part:
            text = model_text(answer.model, answer.result, answer.trim, answer.thrust)
            part.write_text(text, encoding="utf-8")
    return list(named)


def _write_histories(path: Path, answers: Sequence[Answer], kept: Sequence[Path]) -> list[Path]:
    settled = [a for a in answers if has_history(a)]
    if not settled:
        raise _no_history(path)
    named = _named("history", path, settled, kept)
    for own, answer in named.items():
        write_history(own, answer)
    return list(named)


def _named(
    argument: str, path: Path, answers: Sequence[Answer], kept: Sequence[Path]
) -> dict[Path, Answer]:
    """Return the first answer under the name given, the others with theirs behind it.

    Those names are known only now: none may replace what the answer is made from or just wrote.
    """
    named: dict[Path, Answer] = {}
    called = labels(answers)
    each = zip(answers, called, file_names(called), strict=True)
    for number, (answer, label, behind) in enumerate(each):
        own = path.with_name(f"{path.stem}_{behind}{path.suffix}") if number else path
        if own.exists() and any(k.exists() and own.samefile(k) for k in kept):
            raise IdentificationError(
                f"argument {argument} {path}: the model {label} would replace {own};"
                " name another file"
            )
        named[own] = answer
    return named


def _settling() -> list[str]:
    """Return the methods that note how an estimate settles."""
    return [name for name, by in all_methods().items() if by.history]


def _no_history(path: Path) -> IdentificationError:
    return IdentificationError(
        f"argument history {path}: no method here notes how it settles; {', '.join(_settling())} do"
    )
