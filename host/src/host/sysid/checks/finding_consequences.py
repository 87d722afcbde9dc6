"""What is done about findings: a unit read otherwise, a column left out, or nothing."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from host.arrays import Array
from host.sysid.checks.data_finding import Finding
from host.sysid.checks.unit_readings import Reading, reread
from host.sysid.checks.unit_sign_checks import check

MOST_READINGS = 4  # a map with more wrong lines is no map
# Without these columns everything can still be fitted.
LEFT_OUT = {
    "airspeed-against-ax": "ax_mps2",
    "psi-against-r": "psi_rad",
    "altitude-against-climb": "altitude_m",
    "airspeed-against-pressure": "qbar_pa",
    "static-pressure": "static_pa",
    "density": "density_kgpm3",
    "throttle": "throttle",
}


def checked(
    columns: Mapping[str, Array], accept: Collection[str] = ()
) -> tuple[dict[str, Array], list[Finding]]:
    """Return the columns as they are used, and all findings with what was done.

    Parameters
    ----------
    columns : mapping
        SI columns on an even grid.
    accept : collection of str
        Checks whose findings change nothing; no other finding changes a column of theirs either.
    """
    result = dict(columns)
    findings = check(result)
    accepted = [f.accept() for f in findings if f.check in accept]
    kept = {name for f in accepted for name in f.channels}
    settled: list[Finding] = []
    for _ in range(MOST_READINGS):
        asked = [f for f in findings if f.check not in accept]
        if not (found := reread(result, asked, kept)):
            break
        reading, findings = found
        result = reading.read(result)
        settled += _settled(asked, reading, findings)
    for f in findings:
        if f.check in accept:
            continue
        out = LEFT_OUT.get(f.check)
        if out in result and out not in kept:
            del result[out]
            settled.append(replace(f, done=f"{out} left out"))
        else:
            settled.append(f)
    return result, [*settled, *accepted]


def blamed(
    findings: Sequence[Finding], equations: Collection[str]
) -> tuple[list[Finding], list[str]]:
    """Return the findings about columns that a model reads, and notes on those that it does not.

    Parameters
    ----------
    findings : sequence of Finding
    equations : collection of str
        Columns that a model reads; empty: it may be any.
    """
    kept, notes = [], []
    for f in findings:
        own = tuple(name for name in f.channels if name in equations)
        surface = f.feedback.surface if f.feedback else ""
        if not equations or (not f.channels and (not surface or surface in equations)):
            kept.append(f)
        elif own:
            kept.append(replace(f, channels=own))
        else:
            notes.append(f"no equation uses {', '.join(f.channels) or surface}: {f.text}")
    return kept, notes


def _settled(asked: Sequence[Finding], reading: Reading, left: Sequence[Finding]) -> list[Finding]:
    """Return the findings that a reading settles, with what was done."""
    remain = {(f.check, f.channels) for f in left}
    # A doubt about a column that is read as it is: the wrong unit of another made it.
    return [
        replace(f, done=reading.line, wrong_unit=f.wrong_unit or not reading.weight)
        for f in asked
        if (f.check, f.channels) not in remain
        and (f.wrong_unit or set(f.channels) & set(reading.channels))
    ]
