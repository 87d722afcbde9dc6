"""Inputs that the logger flew: their events are the finder's windows, exact."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.arrays import Array
from host.log import FlightLog
from host.log.flown_inputs import FlownInput, flown_inputs
from host.log.quality import judge
from host.sysid.flight import read_columns
from host.sysid.maneuvers import detect_maneuvers
from host.sysid.maneuvers.logged_inputs import input_columns
from host.wire.flight_card import card_bytes, parts
from host.wire.schema_text import packed_schema

from tests.host.logs import START_US, even, flight, read, written
from tests.host.test_flight_card import DOUBLET, HEAD, MULTISINE
from tests.protocol.log_writer import Timed, number, rows

CODES = {name: number("event", name) for name in ("input_start", "input_end")}


def _events(*events: tuple[str, int, int]) -> Timed:
    made = rows(
        "event", len(events),
        code=[CODES[name] for name, _, _ in events],
        t_us=[START_US + at_us for _, at_us, _ in events],
        arg=[arg for _, _, arg in events],
    )  # fmt: skip
    return Timed(made, made["t_us"].astype(np.int64) + 100)


def _parts(card: bytes) -> Timed:
    each = parts(card)
    made = rows("card", len(each), part=np.arange(len(each)), t_us=START_US + 500)
    made["bytes"] = np.array([np.frombuffer(one, dtype=np.uint8) for one in each])
    return Timed(made, np.full(len(each), START_US + 600, dtype=np.int64))


def _end(row: int, reason: str, after_ms: int) -> int:
    return row + 256 * number("input_end", reason) + 65536 * after_ms


def _log(tmp_path: Path, *streams: Timed) -> FlightLog:
    flown = flight(12.0)
    even(flown[0])
    return read(tmp_path, written(*flown, *streams))


def test_events_are_the_windows_to_the_microsecond(tmp_path: Path) -> None:
    log = _log(
        tmp_path,
        _parts(card_bytes(HEAD, [DOUBLET, MULTISINE])),
        _events(
            ("input_start", 1_000_123, 0),
            ("input_end", 2_800_123, _end(0, "done", 1800)),
            ("input_start", 4_000_000, 1),
            ("input_end", 7_250_000, _end(1, "stick", 3250)),
            ("input_start", 9_000_000, 0),
            ("input_end", 9_500_000, _end(0, "switch", 500)),  # within its quiet time: no input
        ),
    )
    first, second = flown_inputs(log)
    assert (first.row, first.shape, first.reason) == (0, "doublet", "done")
    assert first.axes == ("elevator",)
    assert (first.start_s, first.end_s) == pytest.approx((2.000123, 2.800123), abs=1e-6)
    assert (second.shape, second.reason) == ("multisine", "stick")
    assert second.axes == ("aileron", "elevator")
    columns, _ = read_columns(log)
    found = [m for m in detect_maneuvers(columns) if m.kind in ("doublet", "multisine")]
    named = {(m.axis, m.kind): (m.start_s, m.input_end_s) for m in found}
    assert named["elevator_rad", "doublet"] == pytest.approx((2.000123, 2.800123), abs=1e-6)
    assert named["aileron_rad", "multisine"] == pytest.approx((4.0, 7.25), abs=1e-6)
    assert named["elevator_rad", "multisine"] == named["aileron_rad", "multisine"]


def test_a_log_without_such_events_is_read_as_before(tmp_path: Path) -> None:
    log = _log(tmp_path)
    assert flown_inputs(log) == []
    assert not any(name.startswith("input_") for name in read_columns(log)[0])


def test_what_the_log_lost_of_an_input_is_made_up_for(tmp_path: Path) -> None:
    card = _parts(card_bytes(HEAD, [DOUBLET]))
    [lost_end] = flown_inputs(_log(tmp_path, card, _events(("input_start", 1_000_000, 0))))
    assert (lost_end.start_s, lost_end.end_s) == pytest.approx((2.0, 2.8), abs=1e-6)
    assert lost_end.reason == "unknown"
    events = _events(("input_start", 1_000_000, 7), ("input_end", 3_000_000, _end(7, "done", 2)))
    [lost_row] = flown_inputs(_log(tmp_path, events))
    assert (lost_row.shape, lost_row.axes) == ("unknown", ())
    assert (lost_row.start_s, lost_row.end_s) == pytest.approx((1.0, 3.0), abs=1e-6)


def _smooth(t_s: Array, start_s: float, end_s: float) -> Array:
    """An input too slow and small for any finder."""
    inside = (t_s >= start_s) & (t_s <= end_s)
    return np.where(inside, 0.004 * np.sin(np.pi * (t_s - start_s) / (end_s - start_s)), 0.0)


def test_an_input_too_small_to_be_found_is_told_beside_one_of_the_pilots() -> None:
    t_s = np.arange(0.0, 30.0, 0.01)
    surface = _smooth(t_s, 5.0, 9.0)
    pulse = np.where((t_s >= 20.0) & (t_s < 20.5), 0.06, 0.0)
    columns = {"t_s": t_s, "elevator_rad": surface, "aileron_rad": pulse, "rudder_rad": 0.0 * t_s}
    assert [m.axis for m in detect_maneuvers(columns)] == ["aileron_rad"]
    flown = FlownInput(0, 5.0, 9.0, "multisine", "done", (0.0, 20.0, 0.0))
    told = detect_maneuvers(columns | input_columns(t_s, [flown]))
    assert [(m.axis, m.kind) for m in told] == [
        ("elevator_rad", "multisine"), ("aileron_rad", "pulse"),
    ]  # fmt: skip
    assert (told[0].start_s, told[0].input_end_s, told[0].end_s) == (5.0, 9.0, 12.0)


def test_what_a_row_holds_in_its_quiet_time_is_feedback_and_no_input() -> None:
    t_s = np.arange(0.0, 30.0, 0.01)

    def pulse(start_s: float, size: float) -> Array:
        return np.where((t_s >= start_s) & (t_s < start_s + 0.5), size, 0.0)

    # The pilot's pulse, then wings brought level at the trigger, then the row.
    columns = {"t_s": t_s, "elevator_rad": pulse(15.0, 0.06), "rudder_rad": 0.0 * t_s,
               "aileron_rad": pulse(5.0, 0.06) + pulse(12.2, 0.05)}  # fmt: skip
    row = FlownInput(0, 15.0, 15.5, "pulse", "done", (0.0, 20.0, 0.0), (), 12.0)
    told = detect_maneuvers(columns | input_columns(t_s, [row]))
    assert [m.axis[:4] for m in told] == ["aile", "aile", "elev"]
    told = detect_maneuvers(columns | input_columns(t_s, [replace(row, held=("aileron",))]))
    assert [m.axis[:4] for m in told] == ["aile", "elev"]
    assert told[0].start_s < 6.0


def test_a_lost_row_is_given_to_the_surfaces_that_moved() -> None:
    t_s = np.arange(0.0, 20.0, 0.01)
    still = 0.0 * t_s
    columns = {"t_s": t_s, "elevator_rad": still, "aileron_rad": 0.1 * _smooth(t_s, 5.0, 9.0),
               "rudder_rad": _smooth(t_s, 5.0, 9.0)}  # fmt: skip
    lost = FlownInput(3, 5.0, 9.0, "unknown", "unknown", (0.0, 0.0, 0.0))
    [found] = detect_maneuvers(columns | input_columns(t_s, [lost]))
    assert (found.axis, found.kind) == ("rudder_rad", "multistep")


def test_what_an_input_moves_is_no_jump_of_a_servo(tmp_path: Path) -> None:
    """A pulse that leaves for 50 ms while the stick rests, in a row and behind it."""
    flown = flight(12.0)
    even(flown[0])
    ident = flown[0].rows
    ident["rc_elevator"] = ident["servo_elevator"] = 3000
    ident["valid"] |= 1 << packed_schema().bits["valid"].index("mega_drives")
    for at_s in (4.5, 9.0):
        ident["servo_elevator"][round(100 * at_s) : round(100 * at_s) + 5] += 100
    events = _events(("input_start", 4_000_000, 1), ("input_end", 7_250_000, _end(1, "done", 3250)))
    card = _parts(card_bytes(HEAD, [DOUBLET, MULTISINE]))
    [session] = read(tmp_path, written(*flown, card, events)).sessions
    assert judge(session).servo_jumps == {"elevator": [pytest.approx(8.99, abs=0.02)]}
