"""The unit of a parameter, from the names of the state it drives and of what it multiplies."""

from __future__ import annotations

from host.sysid.models.state_space_model import CONSTANT, LinearModel

# Metres and seconds of a signal's unit; a radian is a number.
POWERS = {"mps": (1, -1), "mps2": (1, -2), "radps": (0, -1), "rad": (0, 0), "m": (1, 0),
          "s": (0, 1)}  # fmt: skip


def parameter_unit(model: LinearModel, name: str) -> str:
    """Return a unit such as ``1/s2`` or ``m``; nothing where the names do not tell it.

    Parameters
    ----------
    model : LinearModel
    name : str
        A parameter of the model, or of a fit of it (``initial.alpha_rad@1``).
    """
    stated = model.stated_units().get(name.partition("@")[0], "")
    if stated:
        return stated
    kind, _, signal = name.partition("@")[0].partition(".")
    if signal:
        own = _powers(signal)
        if own is None or kind not in ("initial", "bias", "bias_rate"):
            return ""
        return _words(own[0], own[1] - (kind == "bias_rate"))
    if name.endswith(("_m", "_s")):
        return name.rpartition("_")[2]
    for term in model.terms:
        if term.parameter != name or term.matrix not in "AB" or abs(term.gain) != 1.0:
            continue
        row = _powers(model.states[term.row])
        column = _powers((model.states if term.matrix == "A" else model.inputs)[term.column])
        if row is not None and column is not None:
            return _words(row[0] - column[0], row[1] - 1 - column[1])
    return ""


def _powers(signal: str) -> tuple[int, int] | None:
    if signal == CONSTANT:
        return 0, 0
    return POWERS.get(signal.rpartition("_")[2])


def _words(metres: int, seconds: int) -> str:
    powers = {"m": metres, "s": seconds}
    over = [_power(unit, p) for unit, p in powers.items() if p > 0]
    under = [_power(unit, -p) for unit, p in powers.items() if p < 0]
    above = " ".join(over) or "1"
    if not under:
        return above
    below = " ".join(under)
    return f"{above}/({below})" if len(under) > 1 else f"{above}/{below}"


def _power(unit: str, power: int) -> str:
    return unit if power == 1 else f"{unit}{power}"
