"""What moved between a frozen answer and a new one, line by line, beyond a tolerance.

The tolerance is a share of the 95 % half-width. Figures of fit and correlations have none and are
functions of many estimates: ten times the tolerance, of themselves or of one. Texts are equal in
their words; numbers in them may differ by a unit of their last digit.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from tests.answers.answer_record import Record

STRICT, DEFAULT = 1e-9, 1e-2
DERIVED = 10.0  # tolerances that a function of many estimates may move
ROUNDING = 1e-12  # of a value, where it has no width
# Half-width, in SI and radian, of what the data say nothing about: how wide it is, is rounding.
# Sideslip that no vane measured leaves the constants of a maneuver at 3e4 rad.
UNKNOWN = 1e3
MARK_LIMITS = (0.1, 0.12, 0.3)  # half-width over value, where marks change (IDENTIFY.md)
# A number, not a digit of a name (v2_rad) or of a kind of input (3-2-1-1).
NUMBER = re.compile(r"(?<![\w.-])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w-]|\.\d)")


def moved(old: Record, new: Record, tolerance: float) -> list[str]:
    """Return a line for everything that moved beyond the tolerance."""
    if "refused" in old or "refused" in new:
        was, now = (one.get("refused", ["answered"]) for one in (old, new))
        return list(_texts("refusal", was, now))
    lines = [
        *_texts("notes", old["notes"], new["notes"]),
        *_findings(old["findings"], new["findings"]),
    ]
    before, after = (
        {f"{a['template']}, {a['method']}": a for a in one["answers"]} for one in (old, new)
    )
    lines += _names("answers", before, after)
    near: set[str] = set()
    for label in before:
        if label in after:
            at_limit = _at_limit(before[label], tolerance)
            near |= {f"{before[label]['template']}/{name}" for name in at_limit}
            found = _of_answer(before[label], after[label], tolerance, at_limit)
            lines += (f"{label}: {line}" for line in found)
    lines += _marks("table", old["marks"], new["marks"], near)
    return lines


def _of_answer(
    old: Record, new: Record, tolerance: float, at_limit: Collection[str]
) -> Iterator[str]:
    estimates, others = old["estimates"], new["estimates"]
    yield from _names("estimates", estimates, others)
    unknown = {n for n, was in estimates.items() if _unknown(was) and _unknown(others.get(n, was))}
    for name in estimates:
        if name in others and name not in unknown:
            yield from _estimate(name, estimates[name], others[name], tolerance)
    yield from _names("modes", old["modes"], new["modes"])
    for name in old["modes"]:
        for what, was, now in zip(
            ("frequency", "damping"), old["modes"][name], new["modes"].get(name, ()), strict=False
        ):
            yield from _estimate(f"{name}, {what}", was, now, DERIVED * tolerance)
    yield from _names("figures", old["figures"], new["figures"])
    for name, was in old["figures"].items():
        now = new["figures"].get(name, was)
        if was is not None and now is not None:
            limit = max(DERIVED * tolerance, ROUNDING) * abs(was)
            if abs(now - was) > limit:
                yield f"{name} {was:.9g} -> {now:.9g}"
        elif was is not now:
            yield f"{name} {was} -> {now}"
    left_out = {k for k, name in enumerate(estimates) if name in unknown}
    yield from _correlations(old["correlation"], new["correlation"], tolerance, left_out)
    yield from _marks("marks", old["marks"], new["marks"], at_limit)
    for name in old["reasons"]:
        yield from _texts(f"reasons of {name}", old["reasons"][name], new["reasons"].get(name, []))
    # Places of CG and IMU move an arm alike: rounding says which of the two is the larger cause.
    for name in {*old["causes"], *new["causes"]} - unknown if tolerance <= STRICT else ():
        was, now = old["causes"].get(name), new["causes"].get(name)
        if was != now:
            yield f"cause of {name}: {was} -> {now}"
    for key in ("template", "model", "method", "converged", "residual_kind", "at_bound",
                "unpredicted", "constant_inputs", "maneuvers", "held_out", "refused"):  # fmt: skip
        if old.get(key) != new.get(key):
            yield f"{key}: {old.get(key)} -> {new.get(key)}"
    yield from _texts("warnings", old["warnings"], new["warnings"])
    changed = {name for name in at_limit if old["marks"].get(name) != new["marks"].get(name)}
    if not changed:  # the verdict names parameters by their marks
        yield from _texts("verdict", old["verdict"], new["verdict"])


def _estimate(name: str, old: list[Any], new: list[Any], tolerance: float) -> Iterator[str]:
    """Compare value and half-width, both by the half-width."""
    (was, half), (now, other) = old, new
    if None in (was, half, now, other):
        if old != new:
            yield f"{name} {old} -> {new}"
        return
    limit = tolerance * half + ROUNDING * abs(was)
    if abs(now - was) > limit:
        share = abs(now - was) / half if half else float("inf")
        yield f"{name} {was:.9g} -> {now:.9g}, by {share:.2g} half-widths"
    if abs(other - half) > tolerance * half + ROUNDING * half:
        share = abs(other / half - 1) if half else float("inf")  # one that was left out has none
        yield f"{name} half-width {half:.9g} -> {other:.9g}, by {share:.2g} of it"


def _unknown(estimate: list[Any]) -> bool:
    return estimate[1] is not None and estimate[1] > UNKNOWN


def _correlations(
    old: list[list[float]], new: list[list[float]], tolerance: float, left_out: set[int]
) -> Iterator[str]:
    """Compare the rows below the diagonal, but for those of parameters that are unknown."""
    if [len(row) for row in old] != [len(row) for row in new]:
        yield f"covariance of {len(old)} parameters -> {len(new)}"
        return
    off = [
        abs(a - b)
        for k, (was, now) in enumerate(zip(old, new, strict=True))
        for j, (a, b) in enumerate(zip(was, now, strict=True))
        if not {k, j} & left_out
    ]
    if max(off, default=0.0) > DERIVED * tolerance:
        yield f"correlations by {max(off):.2g}"


def _findings(old: list[Record], new: list[Record]) -> Iterator[str]:
    """Compare findings by check and flight: words and values apart."""
    was, now = ({(f["check"], *f["channels"], f["flight"]): f for f in one} for one in (old, new))
    yield from _names("findings", was, now)
    for key in was:
        if key in now:
            before, after = _words(was[key]), _words(now[key])
            yield from _texts(f"finding {key[0]}", before, after)


def _words(finding: Mapping[str, Any]) -> list[str]:
    return [f"{name}: {value}" for name, value in finding.items()]


def _marks(
    what: str, old: Mapping[str, str], new: Mapping[str, str], at_limit: Collection[str]
) -> Iterator[str]:
    """Compare marks; those of parameters at a limit may differ."""
    for name in {**old, **new}:
        was, now = old.get(name, "none"), new.get(name, "none")
        if was != now and name not in at_limit:
            yield f"{what}: {name} {was} -> {now}"


def _at_limit(answer: Record, tolerance: float) -> set[str]:
    """Return the parameters whose half-width over value is that near to where marks change.

    Value and half-width may each move by a tolerance.
    """
    shares = {
        name: half / abs(value)
        for name, (value, half) in answer["estimates"].items()
        if value and half is not None
    }
    return {
        name
        for name, share in shares.items()
        if any(abs(share / limit - 1.0) <= 2.0 * tolerance for limit in MARK_LIMITS)
    }


def _names(what: str, old: Mapping[Any, Any], new: Mapping[Any, Any]) -> Iterator[str]:
    gone, come = ([k for k in a if k not in b] for a, b in ((old, new), (new, old)))
    if gone:
        yield f"{what} gone: {gone}"
    if come:
        yield f"{what} new: {come}"


def _texts(what: str, old: list[str], new: list[str]) -> Iterator[str]:
    for k in range(max(len(old), len(new))):
        was, now = (lines[k] if k < len(lines) else "nothing" for lines in (old, new))
        if not same_text(was, now):
            yield f"{what}: {was!r} -> {now!r}"


def same_text(old: str, new: str) -> bool:
    """Return whether the words are equal, and numbers within a unit of their last digit."""
    if NUMBER.sub("#", old) != NUMBER.sub("#", new):
        return False
    pairs = zip(NUMBER.findall(old), NUMBER.findall(new), strict=True)
    return all(abs(float(a) - float(b)) <= 1.001 * max(_unit(a), _unit(b)) for a, b in pairs)


def _unit(number: str) -> float:
    """Return what a step of the last digit of a printed number is."""
    digits, _, power = number.partition("e")
    return float(10.0 ** (int(power or 0) - len(digits.partition(".")[2])))
