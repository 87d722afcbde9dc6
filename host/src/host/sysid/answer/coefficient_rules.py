"""What must hold before a coefficient fitted directly is trusted: one short rule for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from host.sysid.answer.doubt import Doubt, doubt
from host.sysid.answer.impossible_signs import impossible_signs
from host.sysid.answer.trust_rules import percent
from host.sysid.checks.data_finding import Feedback
from host.sysid.coefficients.coefficient_model import standard_model

if TYPE_CHECKING:
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer

WORSE = 1.25  # NRMSE of unseen over fitted maneuvers: more is a model that does not carry over
FAILS = 1.0  # NRMSE below 4.5 Hz, gusts in it: the mean would do better
FORCES = ("CL", "CD", "CX", "CZ")
# Channel to the equations whose response it makes, and to the labels it multiplies; "" is all.
LEANING: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "airspeed_mps": (("",), ()),
    "qbar_pa": (("",), ()),
    "ax_mps2": (FORCES, ()),
    "az_mps2": (FORCES, ()),
    "ay_mps2": (("CY",), ()),
    "alpha_rad": (("CL", "CD"), ("alpha",)),
    "beta_rad": ((), ("beta",)),
    "p_radps": (("Cl",), ("p",)),
    "q_radps": (("Cm",), ("q",)),
    "r_radps": (("Cn",), ("r",)),
    "elevator_rad": ((), ("de",)),
    "aileron_rad": ((), ("da",)),
    "rudder_rad": ((), ("dr",)),
    "throttle": (("CD", "CX"), ()),
}

Channels = Mapping[str, str]


def coefficient_doubts(
    answer: CoefficientAnswer, open_channels: Channels, laws: Sequence[Feedback] = ()
) -> list[Doubt]:
    """Return every doubt about the coefficients, in the order of the rules.

    Parameters
    ----------
    answer : CoefficientAnswer
    open_channels : mapping
        Column with an open finding of the data checks to the check.
    laws : sequence of Feedback
        Of surfaces that follow states.
    """
    return [
        *(one for law in laws for one in input_feedback(answer, law)),
        *(one for rule in RULES for one in rule(answer, open_channels)),
    ]


def input_feedback(answer: CoefficientAnswer, law: Feedback) -> list[Doubt]:
    """A surface is a function of states: in one equation their coefficients are alike."""
    own = LEANING[law.surface][1]
    others = [label for s in law.signals for label in LEANING.get(s, ((), ()))[1]]
    names = [n.split("_") for n in _names(answer) if "_" in n]
    equations = {n[0] for n in names if n[-1] in own} & {n[0] for n in names if n[-1] in others}
    alike = ["_".join(n) for n in names if n[0] in equations and n[-1] in (*own, *others)]
    reason = f"{law.surface} follows {' and '.join(law.signals)}: they cannot be told apart"
    return doubt(alike, _names(answer), reason)


def open_finding(answer: CoefficientAnswer, open_channels: Channels) -> list[Doubt]:
    """The data checks found something in that channel, and nothing has closed it."""
    found = []
    for channel, check in open_channels.items():
        equations, labels = LEANING.get(channel, ((), ()))
        names = [n for n in _names(answer) if n.startswith(equations) or n.split("_")[-1] in labels]
        found += doubt(names, _names(answer), f"{channel} has an open finding ({check})")
    return found


def fit_fails(answer: CoefficientAnswer, open_channels: Channels) -> list[Doubt]:
    """The fitted data themselves are not explained."""
    shares = answer.fit.prediction.fitted if answer.fit.prediction else {}
    return [
        one
        for equation, nrmse in shares.items()
        if not nrmse < FAILS
        for one in _about(answer, equation, f"the fit fails in {equation} (NRMSE {percent(nrmse)})")
    ]


def not_predicted(answer: CoefficientAnswer, open_channels: Channels) -> list[Doubt]:
    """A maneuver that was left out is predicted worse than those that were fitted."""
    return [
        one
        for equation, words in unpredicted(answer).items()
        for one in _about(answer, equation, f"{equation} is not predicted ({words})")
    ]


def impossible_sign(answer: CoefficientAnswer, open_channels: Channels) -> list[Doubt]:
    """A sign that no aircraft has; of a user's own terms nothing is known."""
    if answer.model != standard_model():
        return []
    values = {d.name: d.value for d in answer.fit.derivatives}
    return [
        one
        for name, reason in impossible_signs(values).items()
        for one in doubt([name], _names(answer), reason)
    ]


def lag_beside(answer: CoefficientAnswer, open_channels: Channels) -> list[Doubt]:
    """Surfaces seem to lag behind their columns, and that moves a moment beyond its intervals."""
    return [
        one
        for equation, far in answer.lagging.items()
        for one in _about(
            answer,
            equation,
            f"surfaces seem to lag behind their columns, which moves {equation} by {far:.1f}"
            " half-widths",
        )
    ]


RULES: tuple[Callable[[CoefficientAnswer, Channels], list[Doubt]], ...] = (
    open_finding, fit_fails, not_predicted, impossible_sign, lag_beside,
)  # fmt: skip


def unpredicted(answer: CoefficientAnswer) -> dict[str, str]:
    """Return the equations that do not carry over to unseen maneuvers, with both figures."""
    found = answer.fit.prediction
    if found is None:
        return {}
    return {
        name: f"NRMSE {100.0 * held_out:.1f} %, fitted {100.0 * found.fitted[name]:.1f} %"
        for name, held_out in found.left_out.items()
        if held_out > WORSE * found.fitted[name]
    }


def _about(answer: CoefficientAnswer, equation: str, reason: str) -> list[Doubt]:
    names = [n for n in _names(answer) if n.split("_")[0] == equation]
    return doubt(names, _names(answer), reason)


def _names(answer: CoefficientAnswer) -> list[str]:
    return [d.name for d in answer.fit.derivatives]
