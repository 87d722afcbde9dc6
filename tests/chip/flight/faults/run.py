"""Flies on with a fault and judges what came of it."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from flight.cut_flight import FILE_BLOCKS, place_of_file
from flight.faults.during_input import how_it_ended, judge_input
from flight.faults.model import CLOCK_LATE_US, Event, Fault, Outcome, Seen, event_names, valid_bit
from flight.flown_row import FlownRow
from flight.rig import FlightRig, check_card, make_card, take_log
from flight.servos import LONGEST_GAP_MS, SERVOS, cuts_allowed, nobodys, spoiled, worst_gap_ms
from flight.settings import reference_image
from host.log import read_log  # here: each child of in_fork would load it anew
from simavr_bench.card_journal import CardJournal

# Bits that say who drives or what started the frame, not what may be used of it.
NOT_HEALTH = ("mega_drives", "imu_triggered", "imu_original")
RESUMED_S = 2.0


def ready_rig(
    elf: Path, folder: Path, *, threshold_volt: float | None = None
) -> tuple[FlightRig, CardJournal]:
    """Bring a rig into flight, its card in private pages and journalled."""
    card = make_card(folder / "empty.img")
    rig = FlightRig(elf, card, in_place=False, threshold_volt=threshold_volt)
    rig.chip.load(reference_image(1100))  # the model's: without it 4.4 V may be a good board's
    journal = CardJournal(rig.card)
    rig.take_off()
    rig.chip.run_s(2.0)
    return rig, journal


def run_fault(
    rig: FlightRig, journal: CardJournal, fault: Fault, folder: Path, row: FlownRow | None = None
) -> Outcome:
    """Fly on from the state of the rig with a fault; only in a child of in_fork.

    With the row of a card that is being flown, its input is judged too.
    """
    begin = rig.chip.cycle
    fault.begin(rig)
    rig.chip.run_until(max(begin + round(fault.fault_s * 16e6), rig.chip.cycle))
    fault.end(rig)
    end = rig.chip.cycle
    rig.chip.run_s(fault.after_s)
    over = rig.chip.cycle
    gap_ms = worst_gap_ms(rig, begin, servos=fault.servos) if fault.servos else float("nan")
    wrong = _judge_pilot(rig, fault, begin, gap_ms, row)
    beats = rig.beats(may_stop=fault.may_stop)
    wrong += beats.wrong()
    rig.chip.power_off()
    image = rig.save_card(folder / "card.img")
    wrong += _judge_card(journal, image, begin)
    log = read_log(take_log(image, folder / "flight.bin"))
    names = event_names()
    events = [
        Event(int(e["t_us"]), names.get(int(e["code"]), str(int(e["code"]))), int(e["arg"]))
        for e in log.frames["event"]
    ]
    seen = Seen(rig, log, begin, end, over, _since(events, fault, begin), journal.records())
    recovered_s = _recovered_s(seen, fault)
    lost = int(log.loss.frames or 0)
    missing = [name for name in fault.events if not seen.events_of(name)]
    wrong += [f"no event {name}" for name in missing]
    if fault.lossless and lost:
        wrong.append(f"{lost} frames lost")
    if fault.recovers and not recovered_s < fault.after_s - 0.2:
        wrong.append("not recovered")
    wrong += fault.check(seen)
    if row is not None:
        wrong += judge_input(seen, fault, row)
    said = ([] if row is None else [f"input: {how_it_ended(seen, row)}"]) + _said(seen)
    return Outcome(gap_ms, lost, recovered_s, beats, wrong, said)


def _judge_pilot(
    rig: FlightRig, fault: Fault, begin: int, gap_ms: float, row: FlownRow | None
) -> list[str]:
    wrong = []
    if fault.servos and not gap_ms <= LONGEST_GAP_MS:
        wrong.append(f"gap of {gap_ms:.0f} ms")
    allowed = cuts_allowed(rig, begin)
    for servo in fault.servos:
        made = nobodys if row is None else partial(row.made, SERVOS.index(servo))
        count = spoiled(rig, begin, servo, made)
        if count > allowed:
            wrong.append(f"{count} spoilt pulses at {servo}, allowed {allowed}")
    engaged = rig.relay.engaged
    if fault.engaged is not None and engaged != fault.engaged:
        wrong.append("the Mega drives" if engaged else "the receiver drives")
    return wrong


def _judge_card(journal: CardJournal, image: Path, begin: int) -> list[str]:
    """Look for anything but blocks of the flight's file since the fault began."""
    check_card(image)
    rows = journal.records()
    place = rows["block"].astype(np.int64) - place_of_file(rows)
    beside = (rows["begun"] > begin) & ~((place >= 0) & (place < FILE_BLOCKS))
    return [f"{np.count_nonzero(beside)} blocks of metadata in flight"] if np.any(beside) else []


def _since(events: list[Event], fault: Fault, begin: int) -> list[Event]:
    """Events since the fault: behind its begin, or of a later boot."""
    begin_us = begin // 16 - CLOCK_LATE_US
    if fault.resets:
        starts = [k for k, event in enumerate(events) if event.name == "session_start"]
        early = [e for e in events[: starts[-1]] if e.t_us > begin_us]
        return early + events[starts[-1] :] if len(starts) > 1 else early
    return [event for event in events if event.t_us > begin_us]


def _recovered_s(seen: Seen, fault: Fault) -> float:
    """Time from the fault's end until everything is as it was; nan if it never is."""
    if fault.resets:
        # From the chip's start until a block is on the card.
        rows = seen.journal
        later = rows["ended"][rows["begun"] > seen.begin + 0.05 * 16e6]
        started = seen.rig.started[-1] if seen.rig.started else seen.begin
        later = later[later > started]
        return (int(later[0]) - started) / 16e6 if len(later) else float("nan")
    written = seen.journal["ended"]
    if not np.any((written > seen.over - 16e6) & (written < seen.over)):
        return float("nan")
    ident = seen.ident
    time_us = ident["t_us"].astype(np.int64)
    begin_us, end_us, over_us = (c // 16 for c in (seen.begin, seen.end, seen.over))
    healthy = ident["valid"] & np.uint16(0xFFFF - sum(valid_bit(name) for name in NOT_HEALTH))
    usual = np.bitwise_and.reduce(healthy[(time_us > begin_us - 1_000_000) & (time_us < begin_us)])
    later = time_us > end_us
    unwell = later & ((healthy & usual) != usual)
    gaps = np.flatnonzero(later[1:] & (np.diff(time_us) > 25_000)) + 1
    ends = [end_us, *time_us[np.flatnonzero(unwell)], *time_us[gaps]]
    ends += [e.t_us for e in seen.events if e.name.endswith("_found") and e.t_us > end_us]
    last_us = max(ends)
    return float("nan") if last_us > over_us - 200_000 else (last_us - end_us) / 1e6


def _said(seen: Seen) -> list[str]:
    """Events since the fault, each once with its number."""
    names: dict[str, int] = {}
    for event in seen.events:
        names[event.name] = names.get(event.name, 0) + 1
    return [name if count == 1 else f"{name} x{count}" for name, count in names.items()]
