"""What `host tune` prints: gains, margins, why, and how to fly them first."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from host.control.axis_tuning import AxisTuning, YawTuning, changes_of
from host.control.verification import UNSEEN

if TYPE_CHECKING:
    from host.control.tuning import Tuning

FIRST_FLIGHT = (
    "First flight",
    "  1. Load half of {halve}; {keep} whole. Keep the other file at hand.",
    "  2. Check on the ground in {level}: nose up by hand, the elevator goes down; right wing down,"
    " the right aileron goes down.",
    "  3. Take off in {manual}. Switch to {level} at a safe height, level, at trim speed.",
    "  4. Look for a surface that buzzes or an aircraft that rocks: back to {manual}, land, halve"
    " again.",
    "  5. Load the whole gains when this flew well. Fly banks of 30 degrees at both ends of the"
    " speed range.",
)


def tuning_lines(found: Tuning) -> Iterator[str]:
    """Return the answer line by line."""
    yield f"{found.aircraft}, gains for {found.named}"
    yield from (f"  note: {one}" for one in found.notes)
    for axis in found.axes:
        yield ""
        yield from _axis_lines(axis)
    if found.yaw is not None:
        yield ""
        yield from _yaw_lines(found.yaw)
    if found.outer:
        yield ""
        yield "around these, not tuned:"
        yield from (f"  {one.line}" for one in found.outer)
    if not found.changes:
        return
    yield ""
    if found.autopilot.words:
        words = dict(found.autopilot.words)
        if found.yaw is not None and found.yaw.design.gains:
            words["halve"] += f" and {found.yaw.settings[found.yaw.problem.yaw.damper].name}"
        yield from (line.format(**words) for line in FIRST_FLIGHT)
    else:
        yield "The logger flies them in rows of a flight card: host plan --card FILE --hold GAINS."


def _axis_lines(one: AxisTuning) -> Iterator[str]:
    problem, proven = one.problem, one.design.verification
    speeds = ", ".join(f"{v:.1f}" for v in problem.airspeeds_mps)
    if one.design.gains is None:
        yield f"{one.axis}: no gains"
        yield (
            f"  the softest gains of the documented range leave {proven.worst_gain_db:.1f} dB and"
            f" {proven.worst_phase_deg:.0f} deg in the worst of {UNSEEN} aircraft; 6 dB and 45 deg"
            " are asked"
        )
        yield f"  least known: {_widest(one)}; fly more inputs of the {problem.actuator.surface}"
        return
    yield f"{one.axis}: at {speeds} m/s"
    yield from _gain_lines(one)
    for name, loop in (("at the surface", proven.actuator), ("attitude", proven.attitude)):
        yield (
            f"  {name + ' loop:':22s} at least {loop.gain_db.min():.1f} dB,"
            f" {loop.phase_deg.min():.0f} deg, disk {loop.disk.min():.2f}"
        )
    if one.worst is not None:
        yield f"  {one.worst.line}"
    low, middle, _ = proven.crossover_radps
    yield f"  crossover {middle:.1f} rad/s, slowest aircraft {low:.1f}"
    if one.costs:
        name, share = one.costs[0]
        yield (
            f"  {name} known exactly would allow {100.0 * share:.0f} % more crossover:"
            f" fly more inputs of the {problem.actuator.surface}"
        )
    yield f"  surface in gusts of 1 m/s: {proven.surface_rate_radps:.2f} rad/s rms at most"
    yield (
        f"  {UNSEEN} unseen aircraft hold: 95 % of all do, with 99.9 % confidence"
        f" ({one.design.rounds} design{'s' * (one.design.rounds > 1)})"
    )


def _gain_lines(one: AxisTuning | YawTuning) -> Iterator[str]:
    changed = {change.name: change for change in changes_of(one)}
    for role, value in (one.design.gains or {}).items():
        setting = one.settings[role]
        change = changed.get(setting.name)
        old = "as before" if change is None else change.before
        yield f"  {setting.name:20s} {value:8.4g} {setting.unit:13s} {old}"


def _yaw_lines(one: YawTuning) -> Iterator[str]:
    proven = one.design.margins
    if one.design.gains is None:
        yield "yaw: no damper holds 6 dB and 45 deg with these roll gains: the rudder's stay"
        return
    yield "yaw: around these roll gains"
    yield from _gain_lines(one)
    for name, (gain_db, phase_deg) in (("rudder", proven.rudder), ("aileron", proven.aileron)):
        yield f"  {'at the ' + name + ':':22s} at least {gain_db:.1f} dB, {phase_deg:.0f} deg"
    yield f"  both at once:          disk {proven.joint_disk:.2f}"
    yield (
        f"  yaw in side gusts of 1 m/s: {np.degrees(proven.yaw_radps):.1f} deg/s rms at most,"
        f" {np.degrees(proven.before_yaw_radps):.1f} with the rudder at rest"
    )
    yield (
        f"  sideslip in a roll: {100.0 * proven.sideslip:.1f} % of the bank,"
        f" {100.0 * proven.before_sideslip:.1f} % with the rudder at rest"
    )


def _widest(one: AxisTuning) -> str:
    """Return the derivatives with the widest shares of their row's main ones."""
    axis = one.problem.axis
    main = ("p", "q", "da", "de", "alpha")
    moments = [n for n in axis.names if n[0] in "LM" and n.split("_")[1] in main]
    value = dict(zip(axis.names, axis.mean.tolist(), strict=True))
    shares = sorted(((axis.half_width(n) / abs(value[n]), n) for n in moments), reverse=True)
    return ", ".join(f"{n} +- {100 * share:.0f} %" for share, n in shares[:2])
