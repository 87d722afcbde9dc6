"""What overrules an interval, whatever estimated it: a closed list.

A rule returns doubts: estimates and a reason. A doubted one stands neither under "trust" nor under
"use with care", whatever its interval. Everything else that speaks against an estimate is in its
interval: noise, gusts, what a model lacks, what is open of instrument and aircraft.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from host.sysid.answer.doubt import Doubt, Evidence, doubt
from host.sysid.answer.feedback_pairs import feedback_of
from host.sysid.checks.data_finding import open_channels

if TYPE_CHECKING:
    from host.sysid.answer.estimate_view import EstimateView

Rule = Callable[[Any, Evidence], list[Doubt]]  # of a view
# Signs of derivatives in the house's convention, and what they say. Cm_alpha may have either: an
# unstable aircraft flies too. A canard's elevator is turned round by its map.
POSSIBLE: dict[str, tuple[float, str]] = {
    "Z_alpha": (-1.0, "lift must grow with the angle of attack"),
    "L_p": (-1.0, "rolling must be damped"),
    "M_de": (-1.0, "elevator down must pitch the nose down"),
    "N_dr": (-1.0, "rudder left must yaw the nose left"),
    "L_da": (1.0, "aileron must roll to the side where it is up"),
    "CL_alpha": (1.0, "lift must grow with the angle of attack"),
    "Cl_p": (-1.0, "rolling must be damped"),
    "Cm_de": (-1.0, "elevator down must pitch the nose down"),
    "Cn_dr": (-1.0, "rudder left must yaw the nose left"),
    "Cl_da": (1.0, "aileron must roll to the side where it is up"),
}


def own(rule: Rule) -> Rule:
    """Return a rule of a view from one that reads the answer itself."""
    return lambda view, evidence: rule(view.answer, evidence)


def open_finding(view: EstimateView, evidence: Evidence) -> list[Doubt]:
    """Doubt what leans on a channel with an open finding."""
    return [
        one
        for channel, check in open_channels(evidence.findings).items()
        for one in doubt(
            view.leaning_on(channel), view.names, f"{channel} has an open finding ({check})"
        )
    ]


def input_feedback(view: EstimateView, evidence: Evidence) -> list[Doubt]:
    """Doubt derivatives that a feedback law makes alike in one equation."""
    return [
        one
        for law in feedback_of(evidence.findings)
        for one in doubt(
            view.alike(law),
            view.names,
            f"{law.surface} follows {' and '.join(law.signals)}: not separable",
        )
    ]


def impossible_sign(view: EstimateView, evidence: Evidence) -> list[Doubt]:
    """Doubt a sign that no aircraft has, its row, and what correlates with it.

    A user's own model is doubted by its bounds alone.
    """
    impossible = {
        name: f"its sign is impossible: {POSSIBLE[name][1]}"
        for name, value in view.values.items()
        if name in POSSIBLE and value * POSSIBLE[name][0] < 0.0
    }
    return [
        one
        for name, reason in impossible.items()
        for one in (
            *doubt([name], view.names, reason),
            *doubt(
                set(view.entangled(name)) - {name}, view.names, f"{name} linked to it: {reason}"
            ),
        )
    ]


def doubts_of(view: EstimateView, evidence: Evidence) -> list[Doubt]:
    """Return every doubt about the estimates of an answer, in the order of the rules."""
    return [one for rule in view.rules for one in rule(view, evidence)]
