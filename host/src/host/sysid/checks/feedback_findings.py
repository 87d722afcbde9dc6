"""Surfaces that a yaw damper, a stabiliser or an autopilot moves: found, named, and its price."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from host.arrays import Array, IntArray
from host.sysid.checks.data_finding import Feedback, Finding
from host.sysid.maneuvers.maneuver_detection import (
    FEWEST,
    LEAD_S,
    STILL_RAD,
    DetectedManeuver,
    runs_of,
)
from host.sysid.numerics.state_feedback import FeedbackLaw, feedback_law
from host.sysid.numerics.white_noise import white_deviation

# What a surface may follow of what forces depend on: one that follows attitude or height is as good
# as a pilot's input.
LATERAL = ("p_radps", "r_radps", "beta_rad")
FOLLOWED = {
    "elevator_rad": ("q_radps", "alpha_rad", "airspeed_mps"),
    "aileron_rad": LATERAL,
    "rudder_rad": LATERAL,
}
# By whose maneuvers it is judged.
COUPLED_SURFACES = {"aileron_rad": ("rudder_rad",), "rudder_rad": ("aileron_rad",)}
# Which way a law moves a surface that is to hold the aircraft. An aircraft that answers slow inputs
# of a pilot moves the other way.
HOLDING = {
    ("elevator_rad", "q_radps"): 1, ("elevator_rad", "alpha_rad"): 1,
    ("aileron_rad", "p_radps"): -1, ("rudder_rad", "r_radps"): 1, ("rudder_rad", "beta_rad"): -1,
}  # fmt: skip
MOMENT = {"elevator_rad": "M", "aileron_rad": "L", "rudder_rad": "N"}
LABEL = {
    "elevator_rad": "de", "aileron_rad": "da", "rudder_rad": "dr", "airspeed_mps": "V",
    "alpha_rad": "alpha", "beta_rad": "beta", "p_radps": "p", "q_radps": "q", "r_radps": "r",
}  # fmt: skip
CAUSES = {"rudder_rad": ("a yaw damper", "an autopilot"), "": ("an autopilot", "a stabiliser")}
# Least length of all windows: several times the memory of a law (a delay of 0.4 s, a lag of 0.3 s).
# In 2.5 s of hand flying a stick is a function of some state by chance.
LEAST_S = 4.0
LEAST_LAG_S = 0.05  # a shorter one looks like a delay


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
    windows = _windows(columns, maneuvers, surface)
    law = _law(columns, windows, surface, names)
    if law is None:
        return None
    said = f"{surface} {law_words(law)}"
    causes = CAUSES.get(surface, CAUSES[""])
    letter, own = MOMENT[surface], LABEL[surface]
    alike = [f"{letter}_{LABEL[n]}" for n in (surface, *law.signals)]
    filtered = len(_filters(law)) > 0
    sums = [
        f"{letter}_{LABEL[n]} {'-' if gain < 0.0 else '+'} {abs(gain):.2g} {letter}_{own}"
        for n, gain in zip(law.signals, law.gains, strict=True)
    ]
    determined = "what they do together" if filtered else " and ".join(sums)
    return Finding(
        "feedback",
        (),
        f"{said}: {', '.join(alike[:-1])} and {alike[-1]} are not separable",
        causes,
        f"only {determined} is known of them; other derivatives keep their marks",
        feedback=Feedback(surface, law.signals, law.gains, filtered),
    )


def _windows(
    columns: Mapping[str, Array], maneuvers: Sequence[DetectedManeuver], surface: str
) -> list[IntArray]:
    """Return the samples by which a surface is judged; none if it rests there."""
    t = columns["t_s"]
    axes = (surface, *COUPLED_SURFACES.get(surface, ()))
    inside = np.zeros(len(t), dtype=bool)
    for item in maneuvers:
        if item.given or item.axis in axes:
            # In the rest before an input an autopilot may not have been engaged yet.
            first = item.start_s - min(item.lead_s, LEAD_S)
            inside |= (t >= first) & (t <= item.fit_window()[1])
    inside &= ~(columns.get("bridged", np.zeros(len(t))) > 0.0)
    windows = [w for w in runs_of(inside) if len(w) >= FEWEST]
    if sum(map(len, windows)) * _period_s(columns) < LEAST_S:
        return []
    if float(np.std(columns[surface][np.concatenate(windows)])) < STILL_RAD:
        return []
    return windows


def _law(
    columns: Mapping[str, Array], windows: Sequence[IntArray], surface: str, names: Sequence[str]
) -> FeedbackLaw | None:
    if not windows:
        return None
    signals = {n: columns[n] for n in names}
    noise = _noise(columns, windows, surface, names)
    law = feedback_law(_period_s(columns), columns[surface], signals, windows, noise)
    if law is None or HOLDING.get((surface, law.signals[0]), 0) * law.gains[0] < 0.0:
        return None
    return law


def _noise(
    columns: Mapping[str, Array], windows: Sequence[IntArray], surface: str, names: Sequence[str]
) -> list[float]:
    """Return the deviation of the white noise of a surface and of what it may follow."""
    every = np.column_stack([columns[name] for name in (surface, *names)])
    return [float(v) for v in white_deviation([every[rows] for rows in windows])]


def _period_s(columns: Mapping[str, Array]) -> float:
    return float(columns["t_s"][1] - columns["t_s"][0])


def law_words(law: FeedbackLaw) -> str:
    """Return a feedback law in words: signals, delay, filters, R2."""
    late_s = law.delay_s + (0.0 if law.lag_s >= LEAST_LAG_S else law.lag_s)
    filters = _filters(law)
    through = f" through {' and '.join(filters)}" if filters else ""
    return f"follows {' and '.join(law.signals)} at {1e3 * late_s:.0f} ms{through}, R2 {law.r2:.2f}"


def _filters(law: FeedbackLaw) -> list[str]:
    lag = [f"a lag of {law.lag_s:.2g} s"] if law.lag_s >= LEAST_LAG_S else []
    return lag + ([f"a wash-out of {law.washout_s:.2g} s"] if np.isfinite(law.washout_s) else [])
