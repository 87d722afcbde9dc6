"""Discrete models that PX4's autotune identified of an axis, as the log has them.

    y[k] = -a1 y[k-1] - a2 y[k-2] + b0 u[k-1] + b1 u[k-2] + b2 u[k-3]

u is the normalised torque setpoint and y the body rate, rad/s, both behind the same filters, which
cancel: a low-pass, and a high-pass below which the model knows nothing. The topic does not name
the axis, and its numbers of states differ between releases: the axis is that whose rate moves as
the filtered output does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, BoolArray
from host.readers.autopilot_log import AutopilotLog, Messages
from host.readers.named_channels import numbers
from host.readers.signals import Signal

TOPIC = "autotune_attitude_control_status"
NAMES = tuple(f"coeff[{k}]" for k in range(5))  # a1, a2, b0, b1, b2
VARIANCES = tuple(f"coeff_var[{k}]" for k in range(5))
NEEDED = (*NAMES, *VARIANCES, "dt_model", "state", "y_filt")
RATES = ("p_radps", "q_radps", "r_radps")
HIGH_PASS_HZ = 0.5  # PX4's, of input and output
FEWEST = 10  # messages of an axis
MOVES_AS = 0.7  # correlation of the output with the rate of its axis, from message to message


@dataclass(frozen=True, slots=True, eq=False)
class TunedModel:
    """The model of one axis.

    Attributes
    ----------
    rate : str
        The output: ``p_radps``, ``q_radps`` or ``r_radps``.
    coefficients, variances : (5,) Array
        a1, a2, b0, b1, b2, in order.
    dt_s : float
        Its sample period.
    from_s, to_s : float
        When the axis was tuned.
    converged : bool
        Whether the autopilot took it for converged (a fitness below 1).
    torque : Signal
        The input, as it was logged meanwhile.
    """

    rate: str
    coefficients: Array
    variances: Array
    dt_s: float
    from_s: float
    to_s: float
    converged: bool
    torque: Signal


def tuned_models(
    log: AutopilotLog, rates: Mapping[str, Signal], torque: Mapping[str, Signal]
) -> tuple[TunedModel, ...]:
    """Return the last model of each axis that an autotune left in a log.

    Parameters
    ----------
    log : AutopilotLog
    rates : mapping of str to Signal
        Measured body rates by their names.
    torque : mapping of str to Signal
        The torque setpoint about the axis of each rate.
    """
    found: dict[str, TunedModel] = {}
    said = log.first(TOPIC)
    if said is None or any(name not in said.fields for name in NEEDED):
        return ()
    state = numbers(said.fields["state"])
    begins = np.flatnonzero(np.diff(state, prepend=np.nan) != 0.0)
    for first, end in zip(begins, np.append(begins[1:], len(state)), strict=True):
        if state[first] > 0.0 and (one := _model(said, slice(first, end), rates, torque)):
            found[one.rate] = one
    return tuple(found.values())


def _model(
    said: Messages, rows: slice, rates: Mapping[str, Signal], torque: Mapping[str, Signal]
) -> TunedModel | None:
    """Return the model at the end of some messages; None where they identify nothing."""
    values = np.column_stack([numbers(said.fields[name])[rows] for name in (*NAMES, *VARIANCES)])
    dt_s, t_s = numbers(said.fields["dt_model"])[rows], said.t_s[rows]
    usable = np.isfinite(values).all(axis=1) & (values[:, 5:] > 0.0).all(axis=1) & (dt_s > 0.0)
    changing = usable & np.append(False, np.any(np.diff(values[:, :5], axis=0) != 0.0, axis=1))
    if changing.sum() < FEWEST:
        return None
    rate = _axis(t_s[changing], numbers(said.fields["y_filt"])[rows][changing], rates)
    last = int(np.flatnonzero(usable)[-1])
    first_s, last_s = float(t_s[changing][0]), float(t_s[changing][-1])
    if rate is None or rate not in torque:
        return None
    own = torque[rate]
    during: BoolArray = (own.t_s >= first_s) & (own.t_s <= last_s)
    fitness = numbers(said.fields["fitness"])[rows][last] if "fitness" in said.fields else 0.0
    return TunedModel(
        rate,
        values[last, :5],
        values[last, 5:],
        float(dt_s[last]),
        first_s,
        last_s,
        bool(fitness < 1.0),
        Signal(own.t_s[during], own.values[during], own.source),
    )


def _axis(t_s: Array, output: Array, rates: Mapping[str, Signal]) -> str | None:
    """Return the rate that moves as a filtered output, and more so than the others."""
    alike = {}
    for name in RATES:
        if name not in rates or not len(rates[name].t_s):
            continue
        own = np.diff(np.interp(t_s, rates[name].t_s, rates[name].values))
        moved = np.diff(output)
        size = float(np.sqrt((own @ own) * (moved @ moved)))
        alike[name] = float(own @ moved) / size if size > 0.0 else 0.0
    best = max(alike, key=alike.__getitem__, default=None)
    return best if best is not None and alike[best] > MOVES_AS else None
