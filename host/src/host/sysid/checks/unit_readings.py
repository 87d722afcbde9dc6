"""Other readings of a column: in which unit, or with which sign, would it agree with all others?

A map that forgot a unit or a sign leaves a column that kinematics contradicts. Every unit that the
column could come in is tried, twice converted too, the other sign, and angles or rates all in
degrees; the likeliest is taken: that which breaks no identity and leaves the fewest findings. Those
that are as likely are named. A reading that agrees with nothing any more settles nothing: every
relation that the columns had must still be seen.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from host.arrays import Array
from host.constants import GRAVITY_MPS2, RAD_PER_DEG
from host.readers.column_map import UNITS
from host.sysid.checks.data_finding import Finding
from host.sysid.checks.driven_motion import CERTAIN
from host.sysid.checks.identity_factors import FACTOR_CORRELATION
from host.sysid.checks.kinematic_checks import CHECK_OF, misfit, related
from host.sysid.checks.unit_sign_checks import SURFACES, airborne, check

ANGLES = ("alpha_rad", "beta_rad", "phi_rad", "theta_rad", "psi_rad")
RATES = ("p_radps", "q_radps", "r_radps")
FORCES = ("ax_mps2", "ay_mps2", "az_mps2")
POSITIVE = ("airspeed_mps", "qbar_pa", "static_pa", "density_kgpm3", "throttle")
MOST_NAMED = 3  # readings: more tell nothing
ALIKE = 0.02  # factors that differ by less are one
KEPT_SHARE = 0.5  # of a correlation: one that hardly counted need not do so in another unit


@dataclass(frozen=True, slots=True)
class Reading:
    """Columns read in another way: each times `gain`, plus weight where it was left out."""

    channels: tuple[str, ...]
    words: str
    gain: float = 1.0
    weight: bool = False
    as_likely: tuple[str, ...] = ()  # words of other readings

    @property
    def line(self) -> str:
        """What was done, and what else it may be."""
        times = f" (times {self.gain:.4g})" if abs(self.gain) != 1.0 else ""
        first = f"read as {self.words}{times}"
        if not self.as_likely:
            return first
        others = " or ".join(self.as_likely)
        if len(self.as_likely) < MOST_NAMED:
            return f"{first}, or as likely {others}"
        return f"its unit is not known, {first}, as likely {others}"

    def read(self, columns: Mapping[str, Array]) -> dict[str, Array]:
        """Return all columns, these read in this way."""
        changed = {k: columns[k] * self.gain for k in self.channels if k in columns}
        if self.weight:
            weight = _weight(columns)
            changed = {k: values - weight[k] for k, values in changed.items()}
        return {**columns, **changed}


def reread(
    columns: Mapping[str, Array], findings: Sequence[Finding], kept: Collection[str] = ()
) -> tuple[Reading, list[Finding]] | None:
    """Return the reading that settles most findings, and what is found then; None if none does.

    Parameters
    ----------
    columns : mapping
        SI columns on an even grid.
    findings : sequence of Finding
        Those of `check` that ask for a reading.
    kept : collection of str
        Columns that are read as they are.
    """
    proven = [f for f in findings if f.wrong_unit or f.check == "gravity"]
    readings = [one for one in _readings(columns, proven) if not set(one.channels) & set(kept)]
    if not readings:  # of a right table: half of the time of its checks
        return None
    before, seen = check(columns), related(*airborne(columns))
    found: list[tuple[float, Reading, list[Finding]]] = []
    for reading in readings:
        trial = reading.read(columns)
        after = check(trial)
        if not _settles(proven, before, after):
            continue
        flown, dt_s = airborne(trial)
        lost = _lost(seen, related(flown, dt_s, least=0.0))
        if not any(_hidden(pair, reading, before) for pair in lost):
            score = round(misfit(flown, dt_s) + CERTAIN * len(after), 6)  # equal is equal
            found.append((score, reading, after))
    if not found:
        return None
    least, best, after = min(found, key=lambda one: one[0])
    near = sorted((one for one in found if one[0] - least < CERTAIN), key=lambda one: one[0])
    return replace(best, as_likely=tuple(one.words for _, one, _ in near[1:])), after


def _settles(
    proven: Sequence[Finding], before: Sequence[Finding], after: Sequence[Finding]
) -> bool:
    """Return whether a reading settles a finding that is proven, and leaves fewer of all."""
    had, asked, left = ({(f.check, f.channels) for f in some} for some in (before, proven, after))
    return bool((had - left) & asked) and len(after) < len(before)


def _lost(
    seen: Mapping[tuple[str, str], float], close: Mapping[tuple[str, str], float]
) -> list[tuple[str, str]]:
    """Return what moved with what, and does so no more."""
    return [
        pair
        for pair, was in seen.items()
        if close.get(pair, 0.0) < min(FACTOR_CORRELATION, KEPT_SHARE * was)
    ]


def _hidden(pair: tuple[str, str], reading: Reading, before: Sequence[Finding]) -> bool:
    """Return whether a reading hides a relation: it was right, or the column read is part of it."""
    right = CHECK_OF[pair] not in {f.check for f in before}
    return right or any(name in part for name in reading.channels for part in pair)


def _readings(columns: Mapping[str, Array], findings: Sequence[Finding]) -> Iterator[Reading]:
    """Return every way in which the columns of some findings could have been meant."""
    names = dict.fromkeys(k for f in findings for k in f.channels if k in columns)
    for name in names:
        yield from _of_column(name)
    groups: tuple[tuple[str, Callable[[str], bool]], ...] = (
        ("angles", ANGLES.__contains__),
        ("rates", RATES.__contains__),
        ("angles and rates", (*ANGLES, *RATES).__contains__),
        ("surfaces", SURFACES.__contains__),
        ("angles, rates and surfaces", (*ANGLES, *RATES, *SURFACES).__contains__),
    )
    for words, belongs in groups:
        joint = tuple(k for k in columns if belongs(k))
        if len(joint) > 1 and set(joint) & set(names):
            yield Reading(joint, f"{words} in degrees", RAD_PER_DEG)
    forces = tuple(k for k in FORCES if k in columns)
    if set(forces) & set(names):
        for unit, factor in UNITS["mps2"].items():
            yield Reading(forces, f"specific forces in {unit}", factor)
        if "theta_rad" in columns:
            yield Reading(forces, "accelerations without gravity", weight=True)


def _of_column(name: str) -> Iterator[Reading]:
    """Return the readings of one column: units, what was converted twice, the other sign."""
    units = UNITS.get(name.rsplit("_", 1)[-1], {})
    tried = [1.0]
    for twice in (False, True):
        for unit, factor in units.items():
            gain = 1.0 / factor if twice else factor
            if any(abs(gain / known - 1.0) < ALIKE for known in tried):
                continue
            tried.append(gain)
            yield Reading(
                (name,), f"{name} {'converted twice from' if twice else 'in'} {unit}", gain
            )
    if name not in POSITIVE or name == "airspeed_mps":
        yield Reading((name,), f"{name} with the other sign", -1.0)


def _weight(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Return gravity along the body axes, m/s2: what accelerations have and specific forces not."""
    theta = columns["theta_rad"]
    phi = columns.get("phi_rad", np.zeros(len(theta)))
    along = (-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi))
    return {k: GRAVITY_MPS2 * g for k, g in zip(FORCES, along, strict=True)}
