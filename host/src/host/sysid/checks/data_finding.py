"""A finding: what a check of the data found, what may have caused it, what was done about it.

A finding ends no work; only what cannot be fitted does. Each check has a short, stable name, which
`--accept` takes: the column is then used as it is. A finding that changed no column has nothing to
override, and its line says so.

How a verdict reads findings: `open_channels` names the columns of ours that are in doubt. What an
answer takes from one of them is never under "trust": the derivatives in the equation of such a
state, those it is multiplied by, those of such an input, and those of an output only that output
tells. Leaving the column out, estimating its scale and `--accept` do not close a finding; `closed`
is set only where the samples themselves are in no fit.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from host.errors import IdentificationError

# Every check and what it compares.
CHECKS = {
    "angle-size": "angles in flight are below pi",
    "surface-size": "surfaces stay within 90 deg",
    "surface-idle": "a surface moves by more than the width of a line",
    "surface-exchanged": "a surface drives its own rate more than another's",
    "surface-sign": "a surface turns the aircraft the way our signs say",
    "gravity": "specific force is about 9.8 m/s2, and az points down",
    "airspeed-sign": "airspeed is above zero",
    "static-pressure": "static pressure is one of air",
    "density": "density is one of air",
    "throttle": "throttle is a share of full",
    "airspeed-against-pressure": "airspeed against dynamic pressure",
    "theta-against-q": "pitch against pitch rate",
    "phi-against-p": "bank against roll rate",
    "psi-against-r": "heading against yaw rate",
    "alpha-against-q": "angle of attack against pitch rate",
    "beta-against-r": "sideslip against yaw rate",
    "alpha-against-az": "angle of attack against lift over airspeed",
    "beta-against-ay": "sideslip against side force over airspeed",
    "airspeed-against-ax": "airspeed against forward force and weight",
    "altitude-against-climb": "altitude against vertical speed",
    "stuck-sensor": "a sensor moves where kinematics says that it must",
    "time-digits": "the time has a digit for every row",
    "surface-rate": "outputs are logged as often as servos take them",
    "instrument-errors": "errors of sensors and servos are in the intervals",
    "flow-angles": "vanes measured angle of attack and sideslip",
    "small-inputs": "a surface moves enough for a maneuver to be found",
    "calibration": "sensor errors are as small as their file says",
    "feedback": "a surface moves by itself, and is no function of what the aircraft does",
}
AS_IT_IS = "used as it is"
HINT = "give its unit or sign in the map (argument mapping)"


@dataclass(frozen=True, slots=True)
class Feedback:
    """A surface that is a function of signals: in one equation their derivatives are alike.

    Attributes
    ----------
    surface : str
    signals : tuple of str
    gains : tuple of float
        Surface over each signal.
    filtered : bool
        Whether a lag or a wash-out is between them.
    """

    surface: str
    signals: tuple[str, ...]
    gains: tuple[float, ...]
    filtered: bool = False


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding about the columns of a flight.

    Attributes
    ----------
    check : str
        One of `CHECKS`.
    channels : tuple of str
        Columns of ours that are in doubt; empty where none is.
    text : str
        What was found, in one sentence.
    causes : tuple of str
        What it may come from, the likeliest first.
    done : str
        What was done about it.
    wrong_unit : bool
        Whether kinematics proves that the unit or sign of a channel is wrong.
    accepted : bool
        Whether the user accepted it.
    closed : bool
        Whether the samples in doubt are in no fit.
    flight : str
        Its source, where there are several.
    feedback : Feedback or None
        Whose derivatives cannot be separated.
    """

    check: str
    channels: tuple[str, ...]
    text: str
    causes: tuple[str, ...] = ()
    done: str = AS_IT_IS
    wrong_unit: bool = False
    accepted: bool = False
    closed: bool = False
    flight: str = ""
    feedback: Feedback | None = None

    @property
    def line(self) -> str:
        """The finding in one line."""
        where = f"{self.flight}: " if self.flight else ""
        causes = f"; likely {' or '.join(self.causes)}" if self.causes else ""
        return f"{where}finding {self.check}: {self.text}{causes}; {self.done}"

    def accepted_if(self, checks: Collection[str]) -> Finding:
        """Return the finding as the user accepted it if its check is one of these."""
        return self.accept() if self.check in checks and not self.accepted else self

    def accept(self) -> Finding:
        """Return the finding as the user accepted it: what it left out is used as it is."""
        used = self.closed or self.done.startswith(AS_IT_IS)
        done = AS_IT_IS if used else f"which overrides nothing: {self.done}"
        return replace(self, accepted=True, closed=False, done=f"accepted, {done}")


def open_channels(findings: Sequence[Finding]) -> dict[str, str]:
    """Return the columns in doubt, of which nothing may be under "trust", by the first check."""
    return {name: f.check for f in reversed(findings) if not f.closed for name in f.channels}


def finding_document(finding: Finding) -> dict[str, Any]:
    """Return a finding for JSON."""
    return {
        "check": finding.check,
        "channels": list(finding.channels),
        "text": finding.text,
        "causes": list(finding.causes),
        "done": finding.done,
        "wrong_unit": finding.wrong_unit,
        "accepted": finding.accepted,
        "open": not finding.closed,
        "flight": finding.flight or None,
        "feedback": asdict(finding.feedback) if finding.feedback else None,
    }


def check_lines() -> list[str]:
    """Return what `--accept list` prints: every check, and what holds where it finds nothing."""
    return [f"{name:26s} {right}" for name, right in CHECKS.items()]


def accepted_in_vain(accept: Collection[str], findings: Sequence[Finding]) -> list[str]:
    """Return a note on each accepted check that found nothing."""
    found = {f.check for f in findings}
    return [
        f"accepted check {name} found nothing in these data"
        for name in CHECKS
        if name in accept and name not in found
    ]


def accepted_checks(given: Sequence[str]) -> frozenset[str]:
    """Return the names of checks that a user accepts.

    Raises
    ------
    IdentificationError
        If there is no such check.
    """
    for name in given:
        if name not in CHECKS:
            near = difflib.get_close_matches(str(name), CHECKS, n=1)
            meant = f" (did you mean {near[0]}?)" if near else ""
            raise IdentificationError(
                f"argument accept: no check '{name}'{meant}; there are {', '.join(CHECKS)}"
            )
    return frozenset(given)
