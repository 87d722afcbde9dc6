"""Inputs that were moved as one, by a mixer or a habit: their derivatives cannot be separated."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from host.sysid.linear.linear_answer import Answer

MIXED = 0.98  # correlation of two inputs


def correlated_inputs(answer: Answer) -> list[tuple[str, str]]:
    """Return pairs of inputs whose motions correlate by `MIXED` or more."""
    moved = np.concatenate([m.inputs - m.inputs.mean(axis=0) for m in answer.maneuvers])
    power = moved.T @ moved
    pairs = itertools.combinations(range(len(answer.model.inputs)), 2)
    return [
        (answer.model.inputs[i], answer.model.inputs[j])
        for i, j in pairs
        if power[i, j] ** 2 > MIXED**2 * power[i, i] * power[j, j] > 0.0
    ]


def derivatives_of_both(answer: Answer) -> set[str]:
    """Return derivatives that stand for two inputs, where a regression left one input out."""
    model, result = answer.model, answer.result
    left_out = {
        p.name for k, p in enumerate(model.parameters)
        if result.estimate[k] == 0.0 and result.half_width()[k] == 0.0
    }  # fmt: skip
    found: set[str] = set()
    for pair in correlated_inputs(answer):
        own = {
            t.parameter for t in model.terms if t.matrix in "BD" and model.inputs[t.column] in pair
        }
        found |= own - left_out if own & left_out else set()
    return found
