"""Surfaces that a yaw damper, a stabiliser or an autopilot moves: found, named, and its price."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from host.arrays import Array
from host.sysid.flight.data_finding import Feedback, Finding
from host.sysid.flight.maneuver_detection import DetectedManeuver, runs_of
from host.sysid.flight.maneuver_selection import FEWEST
from host.sysid.numerics.state_feedback import FeedbackLaw, feedback_law

LATERAL = ("p_radps", "r_radps", "beta_rad", "phi_rad", "psi_rad")
# What a surface may follow, and by whose maneuvers it is judged.
FOLLOWED = {
    "elevator_rad": ("q_radps", "alpha_rad", "theta_rad", "airspeed_mps", "altitude_m"),
    "aileron_rad": LATERAL,
    "rudder_rad": LATERAL,
}
COUPLED_SURFACES = {"aileron_rad": ("rudder_rad",), "rudder_rad": ("aileron_rad",)}
# No force depends on these: what follows them alone is as good as a pilot's input.
ATTITUDE = ("phi_rad", "theta_rad", "psi_rad", "altitude_m")
# Which way a law moves a surface that is to hold the aircraft. An aircraft that answers slow inputs
# of a pilot moves the other way.
HOLDING = {
    ("elevator_rad", "q_radps"): 1, ("elevator_rad", "alpha_rad"): 1,
    ("aileron_rad", "p_radps"): -1, ("aileron_rad", "phi_rad"): -1,
    ("rudder_rad", "r_radps"): 1, ("rudder_rad", "beta_rad"): -1,
}  # fmt: skip
MOMENT = {"elevator_rad": "M", "aileron_rad": "L", "rudder_rad": "N"}
LABEL = {
    "elevator_rad": "de", "aileron_rad": "da", "rudder_rad": "dr", "airspeed_mps": "V",
    "alpha_rad": "alpha", "beta_rad": "beta", "p_radps": "p", "q_radps": "q", "r_radps": "r",
}  # fmt: skip
CAUSES = {"rudder_rad": ("a yaw damper", "an autopilot"), "": ("an autopilot", "a stabiliser")}
STILL_RAD = 1e-3  # a surface that moves less moves nothing
LEAST_LAG_S = 0.05  # a shorter one cannot be told from a delay


def feedback_findings(
    columns: Mapping[str, Array], maneuvers: Sequence[DetectedManeuver]
) -> list[Finding]:
    """Return a finding for each surface that is a function of the states in its maneuvers.

    Parameters
    ----------
    columns : mapping
        SI columns on an even grid.
    maneuvers : sequence of DetectedManeuver
        Those that are fitted.
    """
    return [
        finding
        for surface in FOLLOWED
        if surface in columns and (finding := _finding(columns, maneuvers, surface)) is not None
    ]


def _finding(
    columns: Mapping[str, Array], maneuvers: Sequence[DetectedManeuver], surface: str
) -> Finding | None:
    names = [n for n in FOLLOWED[surface] if n in columns]
    law = _law(columns, maneuvers, surface, names)
    if law is None:
        return None
    aerodynamic: FeedbackLaw | None = law
    if set(law.signals) & set(ATTITUDE):
        names = [n for n in names if n not in ATTITUDE]
        aerodynamic = _law(columns, maneuvers, surface, names)
    said = f"{surface} {law_words(law)}"
    causes = CAUSES.get(surface, CAUSES[""])
    if aerodynamic is None:
        done = "no force depends on attitude or height: its derivatives are told all the same"
        return Finding("feedback", (), said, causes, done)
    letter, own = MOMENT[surface], LABEL[surface]
    alike = [f"{letter}_{LABEL[n]}" for n in (surface, *aerodynamic.signals)]
    filtered = len(_filters(aerodynamic)) > 0
    sums = [
        f"{letter}_{LABEL[n]} {'-' if gain < 0.0 else '+'} {abs(gain):.2g} {letter}_{own}"
        for n, gain in zip(aerodynamic.signals, aerodynamic.gains, strict=True)
    ]
    determined = "what they do together" if filtered else " and ".join(sums)
    return Finding(
        "feedback",
        (),
        f"{said}: {', '.join(alike[:-1])} and {alike[-1]} cannot be told apart",
        causes,
        f"only {determined} is told of them; all others are judged as ever",
        feedback=Feedback(surface, aerodynamic.signals, aerodynamic.gains, filtered),
    )


def _law(
    columns: Mapping[str, Array],
    maneuvers: Sequence[DetectedManeuver],
    surface: str,
    names: Sequence[str],
) -> FeedbackLaw | None:
    t, moved = columns["t_s"], columns[surface]
    axes = (surface, *COUPLED_SURFACES.get(surface, ()))
    inside = np.zeros(len(t), dtype=bool)
    for item in maneuvers:
        if item.given or item.axis in axes:
            first, last = item.fit_window()
            inside |= (t >= first) & (t <= last)
    inside &= ~(columns.get("bridged", np.zeros(len(t))) > 0.0)
    windows = [w for w in runs_of(inside) if len(w) >= FEWEST]
    if not windows or float(np.std(moved[np.concatenate(windows)])) < STILL_RAD:
        return None
    law = feedback_law(float(t[1] - t[0]), moved, {n: columns[n] for n in names}, windows)
    if law is None or HOLDING.get((surface, law.signals[0]), 0) * law.gains[0] < 0.0:
        return None
    return law


def law_words(law: FeedbackLaw) -> str:
    """Return a feedback law in words: signals, delay, filters, R2."""
    late_s = law.delay_s + (0.0 if law.lag_s >= LEAST_LAG_S else law.lag_s)
    filters = _filters(law)
    through = f" through {' and '.join(filters)}" if filters else ""
    return f"follows {' and '.join(law.signals)} at {1e3 * late_s:.0f} ms{through}, R2 {law.r2:.2f}"


def _filters(law: FeedbackLaw) -> list[str]:
    lag = [f"a lag of {law.lag_s:.2g} s"] if law.lag_s >= LEAST_LAG_S else []
    return lag + ([f"a wash-out of {law.washout_s:.2g} s"] if np.isfinite(law.washout_s) else [])
