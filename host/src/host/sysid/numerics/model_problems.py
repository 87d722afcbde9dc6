"""The problem of a model: of constant matrices, or of equations, whose code comes with them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from host.compiled import has_compiler
from host.extras import install_hint
from host.sysid.models.state_space_model import LinearModel, has_equations
from host.sysid.numerics.filter_problem import FilterProblem
from host.sysid.numerics.output_error_problem import OutputProblem

if TYPE_CHECKING:
    from host.sysid.models.maneuver import Maneuver
    from host.sysid.numerics.innovation_problem import InnovationProblem

SAMPLES_WITHOUT_COMPILER = 500  # of a filter that Python runs in minutes


def output_problem(model: LinearModel, maneuvers: Sequence[Maneuver]) -> OutputProblem:
    """Return the problem of output error of a linear model, or of a user's equations."""
    if has_equations(model):
        from host.sysid.numerics.nonlinear_problem import NonlinearProblem

        return NonlinearProblem(model, maneuvers)
    return OutputProblem(model, maneuvers)


def innovation_problem(
    model: LinearModel, maneuvers: Sequence[Maneuver], process: tuple[str, ...]
) -> InnovationProblem:
    """Return the problem of filter error of a linear model, or of a user's equations."""
    if has_equations(model):
        from host.sysid.numerics.equation_filter_problem import EquationFilterProblem

        return EquationFilterProblem(model, maneuvers, process)
    return FilterProblem(model, maneuvers, process)


def needs_compiler(model: LinearModel, maneuvers: Sequence[Maneuver]) -> str:
    """Return why a filter takes hours over these maneuvers; empty where it does not."""
    own = has_equations(model)
    samples = sum(m.samples for m in maneuvers if own or m.held)
    if has_compiler() or samples <= SAMPLES_WITHOUT_COMPILER:
        return ""
    what = "of equations" if own else "of columns with missing rows"
    return f"a filter {what} takes hours without numba: {install_hint('numba')}"
