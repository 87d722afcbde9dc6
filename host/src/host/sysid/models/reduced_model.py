"""A linear model without some of its inputs or outputs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal

from host.sysid.models.residual_delays import delays_of
from host.sysid.models.state_space_model import LinearModel, Term


def _kept(
    terms: Sequence[Term], matrices: str, along: Literal["row", "column"], keep: Sequence[int]
) -> Iterator[Term]:
    """Return the entries that stay where of two matrices these rows or columns are kept."""
    for term in terms:
        old = term.row if along == "row" else term.column
        if term.matrix not in matrices:
            yield term
        elif old in keep:
            new = keep.index(old)
            yield replace(term, row=new) if along == "row" else replace(term, column=new)


def without_outputs(model: LinearModel, names: Sequence[str]) -> LinearModel:
    """Return a model without some of its outputs; delays without outputs are removed too."""
    keep = [k for k, y in enumerate(model.outputs) if y not in names]
    placed = tuple(x for x in model.accelerometer_offsets if x.output not in names)
    lost = {x.parameter for x in model.accelerometer_offsets} - {x.parameter for x in placed}
    return replace(
        model,
        outputs=tuple(model.outputs[k] for k in keep),
        C=model.C[keep],
        D=model.D[keep],
        terms=tuple(_kept(model.terms, "CD", "row", keep)),
        parameters=tuple(p for p in model.parameters if p.name not in lost),
        output_biases=tuple(y for y in model.output_biases if y not in names),
        known_noise=tuple((y, sd) for y, sd in model.known_noise if y not in names),
        delays=delays_of(set(model.delayed_signals()) - set(names), model.delays),
        accelerometer_offsets=placed,
    )


def without_inputs(model: LinearModel, names: Sequence[str]) -> LinearModel:
    """Return a model without some of its inputs and the parameters that only these have."""
    keep = [k for k, u in enumerate(model.inputs) if u not in names]
    terms = tuple(_kept(model.terms, "BD", "column", keep))
    left = {t.parameter for t in terms} | {x.parameter for x in model.accelerometer_offsets}
    left |= {parameter for _, parameter in model.shared_starts}
    return replace(
        model,
        inputs=tuple(model.inputs[k] for k in keep),
        B=model.B[:, keep],
        D=model.D[:, keep],
        terms=terms,
        parameters=tuple(p for p in model.parameters if p.name in left),
    )
