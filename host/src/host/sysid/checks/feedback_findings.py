"""Surfaces that a yaw damper, a stabiliser or an autopilot moves: found, named, and its price."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.integrate import cumulative_trapezoid

from host.arrays import Array, IntArray
from host.sysid.checks.data_finding import Feedback, Finding
from host.sysid.maneuvers.maneuver_detection import LEAD_S, STILL_RAD, DetectedManeuver, runs_of
from host.sysid.maneuvers.maneuver_selection import FEWEST
from host.sysid.numerics.feedback_fast import fast_feedback
from host.sysid.numerics.feedback_legs import feedback_legs
from host.sysid.numerics.state_feedback import FeedbackLaw, feedback_law
from host.sysid.numerics.white_noise import white_deviation

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
    ("elevator_rad", "theta_rad"): 1,
    ("aileron_rad", "p_radps"): -1, ("aileron_rad", "phi_rad"): -1,
    ("aileron_rad", "psi_rad"): -1,
    ("rudder_rad", "r_radps"): 1, ("rudder_rad", "beta_rad"): -1,
}  # fmt: skip
# What a waypoint tracker's bank loop follows in every leg, and what in some.
BANK_LOOP, HEADING = ("p_radps", "phi_rad"), "psi_rad"
# What holds an attitude whose command is not in the table: rate, attitude, and what may be beside.
INNER_LOOP: dict[str, tuple[str, ...]] = {
    "aileron_rad": ("p_radps", "phi_rad", "psi_rad"),
    "elevator_rad": ("q_radps", "theta_rad", "alpha_rad"),
}
TURNING = ("p_radps", "q_radps", "r_radps", "phi_rad", "theta_rad")  # tell how angles change
MOMENT = {"elevator_rad": "M", "aileron_rad": "L", "rudder_rad": "N"}
LABEL = {
    "elevator_rad": "de", "aileron_rad": "da", "rudder_rad": "dr", "airspeed_mps": "V",
    "alpha_rad": "alpha", "beta_rad": "beta", "p_radps": "p", "q_radps": "q", "r_radps": "r",
}  # fmt: skip
CAUSES = {"rudder_rad": ("a yaw damper", "an autopilot"), "": ("an autopilot", "a stabiliser")}
# Of all windows: several times the memory of a law (a delay of 0.4 s, a lag of 0.3 s). In 2.5 s of
# hand flying a stick is a function of some state by chance.
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
    law, jumps = _law(columns, windows, surface, names), ""
    if law is None and surface == "aileron_rad":
        law, jumps = _tracker(columns, windows)
    if law is None:
        law, jumps = _inner_loop(columns, windows, surface)
    if law is None:
        return None
    aerodynamic: FeedbackLaw | None = law
    if set(law.signals) & set(ATTITUDE):
        names = [n for n in names if n not in ATTITUDE]
        aerodynamic = _law(columns, windows, surface, names)
    said = f"{surface} {law_words(law)}{jumps}"
    causes = CAUSES.get(surface, CAUSES[""])
    if aerodynamic is None:
        done = "derivatives keep their marks: no force depends on attitude or height"
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
        f"{said}: {', '.join(alike[:-1])} and {alike[-1]} are not separable",
        causes,
        f"only {determined} is known of them; other derivatives keep their marks",
        feedback=Feedback(surface, aerodynamic.signals, aerodynamic.gains, filtered),
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


def _tracker(
    columns: Mapping[str, Array], windows: Sequence[IntArray]
) -> tuple[FeedbackLaw | None, str]:
    """Return the law of ailerons whose command jumps from leg to leg, and that in words.

    Bank is among its signals, and each acts as it does where an aircraft is held: constants of the
    legs leave little of a pilot's inputs but what the aircraft answers, and that moves the other
    way.
    """
    if not windows or any(name not in columns for name in BANK_LOOP):
        return None, ""
    dt_s, moved = _period_s(columns), columns["aileron_rad"]
    signals = {n: columns[n] for n in BANK_LOOP}
    inner, heading = np.column_stack(list(signals.values())), _heading(columns)
    legs, followed = feedback_legs(dt_s, moved, inner, heading, windows)
    if followed is not None:
        signals[HEADING] = followed
    noise = _noise({**columns, **signals}, windows, "aileron_rad", list(signals))
    law = feedback_law(dt_s, moved, signals, legs, noise)
    if law is None or "phi_rad" not in law.signals:
        return None, ""
    gains = zip(law.signals, law.gains, strict=True)
    if any(HOLDING["aileron_rad", name] * gain < 0.0 for name, gain in gains):
        return None, ""
    by_rates = ", heading by rates" if HEADING in law.signals and HEADING not in columns else ""
    return law, f" within {len(legs)} legs of constant command{by_rates}"


def _inner_loop(
    columns: Mapping[str, Array], windows: Sequence[IntArray], surface: str
) -> tuple[FeedbackLaw | None, str]:
    """Return the law of a surface whose command no column tells, and that in words.

    A guidance by the distance from a line or by a waypoint moves it slowly. What an aircraft
    answers to a pilot has the other sign. Bank and heading are those by rates where these are
    there: noise of a measured angle hides most of its quick part.
    """
    names = INNER_LOOP.get(surface, ())
    if not names or not windows or any(name not in columns for name in names[:2]):
        return None, ""
    signals = {n: columns[n] for n in names if n in columns}
    if surface == "aileron_rad":
        signals |= _angles_by_rates(columns)
    noise = _noise({**columns, **signals}, windows, surface, list(signals))
    law = fast_feedback(_period_s(columns), columns[surface], signals, windows, noise)
    if law is None or not set(ATTITUDE) & set(law.signals):
        return None, ""
    gains = zip(law.signals, law.gains, strict=True)
    if any(HOLDING[surface, name] * gain < 0.0 for name, gain in gains):
        return None, ""
    by_rates = ", heading by rates" if HEADING in law.signals and HEADING not in columns else ""
    return law, f", about a command that changes slowly{by_rates}"


def _heading(columns: Mapping[str, Array]) -> Array | None:
    """Return heading; where no column has it, by rates: its drift is little within a leg."""
    return columns[HEADING] if HEADING in columns else _angles_by_rates(columns).get(HEADING)


def _angles_by_rates(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Return bank and heading by the integrals of the body rates; empty where one is missing."""
    if any(name not in columns for name in TURNING):
        return {}
    p, q, r, phi, theta = (columns[name] for name in TURNING)
    heading_rate = (q * np.sin(phi) + r * np.cos(phi)) / np.cos(theta)
    rates = {"phi_rad": p + np.sin(theta) * heading_rate, HEADING: heading_rate}
    dt_s = _period_s(columns)
    return {n: cumulative_trapezoid(v, dx=dt_s, initial=0) for n, v in rates.items()}


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
