"""A row that holds: proven on the ground, begun where it may, in one loop with an aircraft."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.aircraft.file import load
from host.log.flown_inputs import flown_inputs
from host.sysid.flight.log_columns import of_log
from host.wire.flight_card import card_faults, read_card
from host.wire.schema_text import packed_schema

from tests.sitl import flight_cards as cards
from tests.sitl import hold_faults
from tests.sitl.bench import Bench
from tests.sitl.hold_faults import (
    BANK_END,
    KINDS,
    MOST_BANK_DEG,
    ROWS,
    Draw,
    Flown,
    StoppedError,
    biased,
    fly,
    frozen,
    late,
    main,
    reversed_surface,
    silent,
    turned,
    turned_before,
)
from tests.sitl.hold_flight import (
    PITCHED_S,
    ROLLED_S,
    SHOWN_S,
    TILT,
    TRIGGER_S,
    Motion,
    World,
    fly_closed,
    hold_flight,
)
from tests.sitl.input_flight import (
    AILERON,
    ELEVATOR,
    LEAST_US,
    MOST_US,
    PACKET_S,
    THROTTLE,
    InputFlight,
)

ENUMS = packed_schema().enums
EVENT, END, FAULT = ENUMS["event"], ENUMS["input_end"], ENUMS["card_fault"]
SEED = 49_000
ROW = cards.row(shape=cards.THREE_TWO_ONE_ONE, axes=4 | 3 << 4, quiet_ms=200, duration_ms=3500,
                amplitude_us=(0, 0, 80))  # fmt: skip
CARD = cards.card([ROW], hold=cards.HOLD)
# Their tests say how the row ends.
NAMED = (reversed_surface, turned, turned_before, frozen, silent, late, biased)


def calm() -> InputFlight:
    return hold_flight(TRIGGER_S + 5.2, np.random.default_rng(SEED))


def world(bank_deg: float = 8.0, turbulence_mps: float = 0.0) -> World:
    return World(
        load("ultrastick25e").airframe(), turbulence_mps, bank_rad=math.radians(bank_deg), seed=3
    )


def flown(card: bytes, flight: InputFlight, around: World) -> tuple[Bench, Motion]:
    bench = Bench()
    bench.sitl.set_eeprom(cards.eeprom_with(card))
    return bench, fly_closed(bench, flight, around)


def events(bench: Bench, folder: Path) -> dict[int, list[int]]:
    found: dict[int, list[int]] = {}
    for event in bench.log(folder).frames["event"]:
        found.setdefault(int(event["code"]), []).append(int(event["arg"]))
    return found


def why_refused(said: dict[int, list[int]]) -> int:
    assert EVENT["input_start"] not in said
    (arg,) = said[EVENT["input_refused"]]
    return arg >> 8


def test_a_row_brings_the_wings_level_and_the_log_tells_it(tmp_path: Path) -> None:
    assert card_faults(CARD) == []
    bench, motion = flown(CARD, calm(), world())
    said = events(bench, tmp_path)
    # A longer pulse raises the bank angle and lowers the nose.
    assert said[EVENT["hold_sense"]] == [0 | 1 << 8, 1]
    assert said[EVENT["input_end"]][0] >> 8 & 255 == END["done"]
    log = bench.log(tmp_path)
    (one,) = flown_inputs(log)
    assert one.axes == ("rudder",)
    assert one.held == ("aileron", "elevator")
    notes = of_log(log, {}, []).notes
    assert notes == ["rows 1 of the card held bank and pitch: feedback, not input"]
    parts = {int(row["part"]): bytes(row["bytes"]) for row in log.frames["card"]}
    assert b"".join(parts[n] for n in range(len(parts))) == CARD
    hold = read_card(CARD).hold
    assert hold is not None
    assert hold["model_date"] == cards.HOLD["model_date"]
    row = (motion.t_s >= TRIGGER_S) & (motion.t_s <= TRIGGER_S + 3.7)
    plain = cards.row(shape=cards.THREE_TWO_ONE_ONE, axes=4, quiet_ms=200, duration_ms=3500,
                      amplitude_us=(0, 0, 80))  # fmt: skip
    _, alone = flown(cards.card([plain]), calm(), world())
    held_deg, alone_deg = (
        float(np.degrees(np.sqrt(np.mean(m.bank_rad[row] ** 2)))) for m in (motion, alone)
    )
    assert held_deg < 5.0
    assert alone_deg > 2.0 * held_deg


def test_a_held_surface_goes_no_further_than_its_authority(tmp_path: Path) -> None:
    """And no faster than the card's rate, but for the end."""
    bench, _ = flown(CARD, calm(), world(bank_deg=15.0, turbulence_mps=2.0))
    ident = bench.log(tmp_path).frames["ident"]
    for name in ("aileron", "elevator"):
        added = ident[f"servo_{name}"].astype(int) - ident[f"rc_{name}"].astype(int)
        assert np.abs(added).max() <= 2 * 100
        assert np.abs(added).max() > 20
        # 10 ms of 4000 us/s, and what a pulse of the receiver is older than the frame.
        assert np.abs(np.diff(added))[:-60].max() <= 2 * (40 + 20)


@pytest.mark.parametrize("tilts", ["none", "roll alone"])
def test_without_the_proof_on_the_ground_no_row_holds(tilts: str, tmp_path: Path) -> None:
    flight = hold_flight(TRIGGER_S + 1.0, np.random.default_rng(SEED), tilted=tilts != "none")
    flight.imu[round(PITCHED_S / 0.005) : round((PITCHED_S + SHOWN_S) / 0.005), 7] = 0
    bench, _ = flown(CARD, flight, world())
    assert why_refused(events(bench, tmp_path)) == END["hold_sense"]
    # What was proven may be held.
    aileron = cards.row(axes=2 | 1 << 4, quiet_ms=200, duration_ms=500, amplitude_us=(0, 50, 0))
    bench, _ = flown(cards.card([aileron], hold=cards.HOLD), flight, world())
    said = events(bench, tmp_path)
    assert (EVENT["input_start"] in said) == (tilts != "none")


def test_a_tilt_that_is_too_short_or_too_small_proves_nothing(tmp_path: Path) -> None:
    for change in ("short", "small"):
        flight = calm()
        packets = slice(round(PITCHED_S / 0.005), round((PITCHED_S + SHOWN_S) / 0.005))
        if change == "short":
            flight.imu[packets.start + round(2.8 / 0.005) : packets.stop, 7] = 0
        else:
            flight.imu[packets, 7] = 1490
        bench, _ = flown(CARD, flight, world())
        assert why_refused(events(bench, tmp_path)) == END["hold_sense"]


def test_the_time_that_one_axis_is_shown_is_not_the_others(tmp_path: Path) -> None:
    """Tilted both ways, both sticks at their ends; the aileron's leaves it before its 3 s."""
    flight = calm()
    frame_s = flight.frame_s
    flight.imu[round(ROLLED_S / PACKET_S) : round((PITCHED_S + SHOWN_S) / PACKET_S), 6:8] = 0
    flight.imu[round(ROLLED_S / PACKET_S) : round((ROLLED_S + SHOWN_S) / PACKET_S), 6:8] = TILT
    rows = slice(round((ROLLED_S + 2.8) / frame_s), round((PITCHED_S + SHOWN_S) / frame_s))
    flight.width_us[rows, AILERON : ELEVATOR + 1] = 1500
    both = slice(round(ROLLED_S / frame_s), round((ROLLED_S + SHOWN_S) / frame_s))
    flight.width_us[both, ELEVATOR] = MOST_US
    bench, _ = flown(CARD, flight, world())
    said = events(bench, tmp_path)
    assert EVENT["hold_sense"] not in said
    assert why_refused(said) == END["hold_sense"]


@pytest.mark.parametrize("axis", [0, 1])
def test_a_card_against_the_proof_is_refused(axis: int, tmp_path: Path) -> None:
    turned = dict(cards.HOLD)
    for name in ("angle_gain", "integral_gain", "rate_gain"):
        turned[name] = tuple(-g if k == axis else g for k, g in enumerate(cards.HOLD[name]))
    bench, _ = flown(cards.card([ROW], hold=turned), calm(), world())
    said = events(bench, tmp_path)
    assert said[EVENT["card_refused"]] == [FAULT["hold"]]
    assert EVENT["input_start"] not in said
    assert EVENT["input_refused"] not in said  # it is not enabled any more


def test_the_pilots_wrong_stick_refuses_the_card(tmp_path: Path) -> None:
    flight = calm()
    frames = slice(round(PITCHED_S / flight.frame_s), round((PITCHED_S + SHOWN_S) / flight.frame_s))
    flight.width_us[frames, ELEVATOR] = LEAST_US
    bench, _ = flown(CARD, flight, world())
    assert events(bench, tmp_path)[EVENT["card_refused"]] == [FAULT["hold"]]


@pytest.mark.parametrize(
    ("column", "raw"), [(6, 2050), (6, -2050), (7, 1550), (0, 2100), (2, -2100)]
)
def test_a_row_that_holds_begins_only_in_calm_flight(column: int, raw: int, tmp_path: Path) -> None:
    def beyond(_: float, row: np.ndarray) -> np.ndarray:
        row[column] = raw
        return row

    around = replace(world(bank_deg=0.0), imu=beyond)
    bench, _ = flown(CARD, replace(calm(), seconds=TRIGGER_S + 1.0), around)
    assert why_refused(events(bench, tmp_path)) == END["hold_attitude"]


def test_a_stick_that_moved_while_it_was_armed_refuses_the_row(tmp_path: Path) -> None:
    flight = replace(calm(), seconds=TRIGGER_S + 1.0)
    flight.width_us[math.ceil((TRIGGER_S - 0.15) / flight.frame_s) :, THROTTLE] += 60
    bench, _ = flown(CARD, flight, world())
    assert why_refused(events(bench, tmp_path)) == END["stick"]


def of_each_row(draw: Draw) -> list[Flown]:
    """Fly each shape with a fault; nothing may be wrong, as the campaign asks."""
    found = [fly(number, SEED, draw) for number in range(len(ROWS))]
    assert [f.wrong for f in found] == [()] * len(ROWS)
    return found


@pytest.mark.parametrize(
    "draw", [draw for draw in KINDS if draw not in NAMED], ids=lambda draw: draw.__name__
)
def test_a_drawn_flight_is_flown_as_the_campaign_asks(draw: Draw) -> None:
    of_each_row(draw)


@pytest.mark.parametrize("draw", [reversed_surface, turned], ids=lambda draw: draw.__name__)
def test_a_surface_or_imu_turned_round_behind_the_proof_ends_the_row(draw: Draw) -> None:
    for one in of_each_row(draw):
        assert one.begun
        assert one.reason in ("bank", "pitch", "hold_loses")
        assert one.bank_deg <= BANK_END / 100
        assert one.behind_deg <= MOST_BANK_DEG


def test_an_imu_turned_before_the_proof_starts_no_row() -> None:
    assert [(f.begun, f.reason) for f in of_each_row(turned_before)] == [(False, "hold_sense")] * 4


def test_an_imu_that_freezes_or_falls_silent_ends_the_row() -> None:
    assert {f.reason for f in of_each_row(frozen)} == {"sensor_still"}
    assert {f.reason for f in of_each_row(silent)} == {"sensor_lost"}


@pytest.mark.parametrize("draw", [late, biased], ids=lambda draw: draw.__name__)
def test_an_imu_late_or_off_by_5_deg_stays_within_the_holds_bounds(draw: Draw) -> None:
    """Nothing tells, so the row goes on."""
    for one in of_each_row(draw):
        assert one.reason == "done"
        assert max(one.bank_deg, one.behind_deg) < BANK_END / 100


def test_a_campaign_runs_in_pieces_and_keeps_what_it_had(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    flown_ones: list[tuple[str, int]] = []

    def flown_until_killed(number: int, seed: int, draw: Draw) -> Flown:
        if draw.__name__ == "late" and number == 9:
            raise StoppedError(15)
        flown_ones.append((draw.__name__, number))
        wrong = ("lost",) if number == 8 and draw.__name__ == "frozen" else ()
        return Flown(draw.__name__, wrong, True, "done", 10.0, 5.0, None)

    monkeypatch.setattr(hold_faults, "fly", flown_until_killed)
    monkeypatch.setattr("signal.signal", lambda *_: None)
    asked = "--kinds frozen,late,biased --each 3 --first 7"
    monkeypatch.setattr("sys.argv", ["hold_faults.py", *asked.split()])
    assert main() == 128 + 15
    assert flown_ones == [("frozen", n) for n in (7, 8, 9)] + [("late", n) for n in (7, 8)]
    said = capsys.readouterr()
    lines = said.out.splitlines()[2:]
    assert [line.split(" | ")[:3] for line in lines] == [
        ["| frozen", "3", "3"],
        ["| late", "2", "2"],
    ]
    assert lines[0].endswith("| 1 |")
    assert "frozen 8: lost" in said.err
    assert "--kinds late --first 9 goes on" in said.err
