"""Which form of another simulator a file's name asks for, and who writes it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from host.aircraft.straight_lines import straight_coefficients
from host.errors import IdentificationError
from host.export.atomic_files import atomic_write
from host.export.simulators.aerosandbox_snippet import aerosandbox_text
from host.export.simulators.ardupilot_sitl import ardupilot_text
from host.export.simulators.avl_table import avl_text
from host.export.simulators.flightgear import set_text, with_controls
from host.export.simulators.gazebo import gazebo_text
from host.export.simulators.python_control import StateSpace, control_text
from host.export.simulators.straight_coefficients import SURFACES, StraightCoefficients
from host.sysid.answer.aircraft_export import identified_aircraft

if TYPE_CHECKING:
    from host.sysid.aerodynamics.coefficient import CoefficientTable
    from host.sysid.coefficients.coefficient_fit import MeanCondition
    from host.sysid.linear.linear_answer import Answer

FLIGHTGEAR, CONTROL = "-set.xml", ".control.py"
STRAIGHT: dict[str, Callable[[StraightCoefficients], str]] = {
    ".sdf": gazebo_text,
    ".h": ardupilot_text,
    ".st": avl_text,
    ".aerosandbox.py": aerosandbox_text,
}
# By how the name ends, in the order in which they are looked for.
FORMS = (FLIGHTGEAR, CONTROL, *STRAIGHT)


def form_of(path: Path) -> str:
    """Return the ending of a file's name that asks for a form; empty if none does."""
    return next((form for form in FORMS if path.name.lower().endswith(form)), "")


def files_of(path: Path) -> tuple[Path, ...]:
    """Return all files that are written under a name: FlightGear's are two."""
    if form_of(path) != FLIGHTGEAR:
        return (path,)
    return path, path.with_name(f"{path.name[: -len(FLIGHTGEAR)]}.xml")


def write_form(
    path: Path,
    tables: Sequence[CoefficientTable],
    answers: Sequence[Answer],
    source: str | None,
    condition: MeanCondition | None,
) -> list[Path]:
    """Write an answer in the form that a file's name asks for; return the files.

    Parameters
    ----------
    path : Path
    tables : sequence of CoefficientTable
        What was identified.
    answers : sequence of Answer
        Linear models, for python-control.
    source : str or None
        The aircraft that the answer was made with.
    condition : MeanCondition or None
        Condition of a direct fit of coefficients.

    Raises
    ------
    IdentificationError
        If the answer holds nothing for this form.
    """
    form = form_of(path)
    if form == CONTROL:
        if not answers:
            raise IdentificationError(
                f"{path}: python-control takes linear models; give one (longitudinal, lateral)"
            )
        return _written({path: control_text([_state_space(answer) for answer in answers])})
    if not source:
        raise IdentificationError(
            f"{path}: an aircraft needs mass and geometry; give argument aircraft"
        )
    made = identified_aircraft(tables, source, condition)
    if form == FLIGHTGEAR:
        name = path.name[: -len(FLIGHTGEAR)]
        flown = made.loaded
        limit_rad = {s: flown.scalar(f"surfaces.{s}_limit_rad") for s in SURFACES}
        texts = (
            set_text(name, flown.title, flown.scalar("trim.airspeed_mps")),
            with_controls(made.jsbsim_xml(), limit_rad),
        )
        return _written(dict(zip(files_of(path), texts, strict=True)))
    alpha_rad = tables[0].alpha_rad
    return _written(
        {path: STRAIGHT[form](straight_coefficients(made.loaded, alpha_rad, made.identified))}
    )


def _state_space(answer: Answer) -> StateSpace:
    """Return a linear answer as the plain values that a form holds."""
    model, result = answer.model, answer.result
    common = len(model.parameters)
    names = [p.name for p in model.parameters]
    values, halves = result.estimate[:common].tolist(), result.half_width()[:common].tolist()
    return StateSpace(
        answer.template,
        answer.method,
        answer.trim.airspeed_mps,
        list(zip(names, values, halves, strict=True)),
        tuple(d.name for d in model.delays),
        tuple(model.matrices(result.estimate)),
        model.states,
        model.inputs,
        model.outputs,
    )


def _written(files: dict[Path, str]) -> list[Path]:
    for path, text in files.items():
        with atomic_write(path) as part:
            part.write_text(text, encoding="utf-8")
    return list(files)
