"""Summary of a virtual flight: lines for people, a document for programs, the check of its log."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from host.errors import CheckError
from host.people_units import people_name
from host.twin.faults import without_recorder
from host.twin.outcome.compare import Deviation
from host.twin.outcome.flight_outcome import Outcome
from host.twin.recorder import sitl
from host.twin.testcard import cards

HARMLESS = ("motor_cut", "card_busy")  # faults that leave every decoded value right
APART = ("load", "picture")  # stages that are not the flight


def document(outcome: Outcome, firmware: str) -> dict[str, Any]:
    """Return the summary for programs."""
    record = outcome.record
    return {
        "card": record.card.name,
        "aircraft": record.aircraft.name,
        "seed": record.seed,
        "firmware": firmware,
        "duration_s": _duration_s(outcome),
        "ended_on_ground": record.touched_ground,
        "maneuvers": _maneuvers(outcome),
        "files": [str(path) for path in outcome.files],
        "wall_s": outcome.wall_s,
        "processor_s": outcome.processor_s,
        "times_real_time": _times_real_time(outcome, firmware),
        "deviations": {
            d.column: [d.mean, d.spread, d.mean_limit, d.spread_limit] for d in outcome.deviations
        },
    }


def lines(outcome: Outcome, firmware: str) -> list[str]:
    """Return the summary for people: what was flown and how fast, the outcome, the files."""
    record, duration_s = outcome.record, _duration_s(outcome)
    card = record.card
    found = [
        card.title,
        f"  {record.aircraft.title}, {duration_s:.1f} s, {_maneuvers(outcome)} maneuvers,"
        f" seed {record.seed}, simulated",
    ]
    if record.touched_ground:
        found.append(
            f"  on the ground after {duration_s:.1f} s, sinking at {record.sink_mps:.1f} m/s:"
            f" the flight ends there, {card.name} asked for {cards.duration_s(card):.1f} s"
        )
    spent = _spent_s(outcome, firmware)
    stages = ", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in spent.items())
    found.append(
        f"  {_times_real_time(outcome, firmware):.0f} times real time on one core, loading and"
        f" picture apart ({stages})"
    )
    return [*found, *_recorded(outcome), *deviation_lines(outcome.deviations)] + [
        f"  wrote {path}" for path in outcome.files
    ]


def check(outcome: Outcome) -> None:
    """Compare the decoded log with the truth, unless a fault makes it wrong.

    Raises
    ------
    CheckError
        If a column is further off than its sensors explain.
    """
    broken = any(fault.kind not in HARMLESS for fault in outcome.record.card.faults)
    beyond = [d.column for d in outcome.deviations if not d.within]
    if beyond and not broken:
        raise CheckError(f"{', '.join(beyond)}: decoded values are beyond what the sensors explain")


def _recorded(outcome: Outcome) -> list[str]:
    """Return the lines about the recorder."""
    card = outcome.record.card
    if outcome.recording is None:
        left = without_recorder(card.faults)
        named = ", ".join(fault.kind for fault in left)
        return [f"  without the recorder nothing comes of {named}"] if left else []
    found, rate_hz = [], card.flight.rate_hz
    if rate_hz not in sitl.RATES_HZ:
        found.append(
            f"  recorded at {sitl.recorder_rate_hz(rate_hz)} Hz: {rate_hz:g} Hz of the card is"
            f" none of {', '.join(map(str, sitl.RATES_HZ))}"
        )
    if not outcome.recording.log:
        found.append(f"  nothing was recorded: the recorder found {outcome.recording.name}")
    return found


def deviation_lines(deviations: Sequence[Deviation]) -> list[str]:
    """Return how far the decoded log is from the truth, angles in degrees; nothing of none."""
    if not deviations:
        return []
    lines = ["  decoded log against the truth, in flight (mean and spread of the error, limits):"]
    for d in deviations:
        name, scale = people_name(d.column)
        lines.append(
            f"    {name:14s} {scale * d.mean:+9.4f} {scale * d.spread:8.4f}"
            f"   {scale * d.mean_limit:8.4f} {scale * d.spread_limit:8.4f}"
            + ("" if d.within else "  BEYOND ITS ERROR MODEL")
        )
    return lines


def _duration_s(outcome: Outcome) -> float:
    return float(outcome.record.t_s[-1])


def _maneuvers(outcome: Outcome) -> int:
    """Return how many maneuvers were flown to their end."""
    duration_s = _duration_s(outcome)
    return sum(bool(w.end_s <= duration_s) for w in outcome.record.schedule.windows)


def _spent_s(outcome: Outcome, firmware: str) -> dict[str, float]:
    """Return the time of each stage; of the chip simulator, another process, only on the wall."""
    return outcome.wall_s if firmware == "avr" else outcome.processor_s


def _times_real_time(outcome: Outcome, firmware: str) -> float:
    busy_s = sum(s for stage, s in _spent_s(outcome, firmware).items() if stage not in APART)
    return _duration_s(outcome) / busy_s
