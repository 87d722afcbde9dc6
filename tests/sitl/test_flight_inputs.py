"""The flight card in flight: enabled by hand, triggered, flown as written, given up in time."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from host.twin.recorder.sitl_library import TICKS_PER_S, Level, Port, Recorder
from host.wire.schema_text import packed_schema

from tests.protocol import oracle
from tests.protocol.log_writer import crc16
from tests.sitl import flight_cards as cards
from tests.sitl import input_faults
from tests.sitl.bench import Bench
from tests.sitl.input_faults import HELD_ROW, KINDS, ROWS, drawn_row, fly, nothing
from tests.sitl.input_flight import (
    AILERON,
    ARMED_S,
    ARMED_US,
    DIRECT_US,
    GROUND_S,
    MEGA_S,
    MEGA_US,
    PACKET_S,
    SIGN_S,
    SWITCH,
    TRIGGER_S,
    UP_S,
    InputFlight,
    input_flight,
)
from tests.sitl.input_judge import Trigger, deflected, wrong_pulses
from tests.sitl.input_shapes import deflection, shape_of

NUMBERS = packed_schema().enums
CARD_ENABLED, INPUT_START, INPUT_END, INPUT_REFUSED = (
    NUMBERS["event"][name] for name in ("card_enabled", "input_start", "input_end", "input_refused")
)
DONE, BUTTON, HEIGHT, ALPHA = (
    NUMBERS["input_end"][name] for name in ("done", "button", "height", "alpha")
)
SEED = 30_010


def flown(flight: InputFlight, eeprom: bytes | None, until_s: float | None = None) -> Bench:
    bench = Bench()
    if eeprom is not None:
        bench.sitl.set_eeprom(eeprom)
    flight.give(bench.sitl)
    bench.sitl.power_on()
    bench.sitl.run_until(round((until_s or flight.seconds) * TICKS_PER_S))
    return bench


def events(bench: Bench, folder: Path, code: int) -> list[tuple[float, int]]:
    rows = bench.log(folder).frames["event"]
    mine = rows[rows["code"] == code]
    return [(float(row["t_us"]) / 1e6, int(row["arg"])) for row in mine]


def calm(seconds_behind: float = 2.0) -> InputFlight:
    return input_flight(TRIGGER_S + seconds_behind, np.random.default_rng(SEED))


def test_a_row_is_flown_as_written_and_the_log_tells_it(tmp_path: Path) -> None:
    data = cards.card(ROWS)
    flight = calm()
    bench = flown(flight, cards.eeprom_with(data))
    log = bench.log(tmp_path)
    ((_, enabled),) = events(bench, tmp_path, CARD_ENABLED)
    assert enabled == cards.card_hash(data)
    ((start_s, start),) = events(bench, tmp_path, INPUT_START)
    assert start == (enabled << 8 & 0xFFFFFFFF)
    assert TRIGGER_S < start_s < TRIGGER_S + 0.05
    ((end_s, end),) = events(bench, tmp_path, INPUT_END)
    assert end & 0xFFFF == DONE << 8
    assert end >> 16 == round(1000 * (end_s - start_s)) == 1200
    # The card as it stands in the log, and the row once more where it begins.
    parts = log.frames["card"]
    whole = {int(row["part"]): bytes(row["bytes"]) for row in parts}
    assert b"".join(whole[n] for n in range(len(whole))) == data
    assert int(parts[-1]["part"]) == 3
    assert int(log.frames["input_config"][-1]["switch_armed_min_us"]) == 1850
    # Surface by surface, against what the servo pulses say of the sticks.
    ident = log.frames["ident"]
    at_ms = (ident["t_us"].astype(np.int64) - round(start_s * 1e6)) / 1000.0 - 200.0
    added = ident["servo_elevator"].astype(int) - ident["rc_elevator"].astype(int)
    shape = shape_of(ROWS[0])[:, 1]
    settled = [(ms, got) for ms, got in zip(at_ms, added, strict=True)
               if 70 < ms < 480 or 570 < ms < 980]  # fmt: skip
    assert len(settled) > 60
    assert all(abs(got - shape[int(ms)]) <= 2 for ms, got in settled)
    assert not added[(at_ms < 0) | (at_ms > 1000)].any()
    assert not (ident["servo_throttle"].astype(int) - ident["rc_throttle"].astype(int)).any()


def test_without_a_card_its_flight_is_the_plain_one(tmp_path: Path) -> None:
    """Not enabled, not valid, none at all: pulses and log are the same, byte for byte."""
    flight = calm()
    plain = flown(flight, None)
    pulses, image = plain.sitl.pulses(), bytes(plain.image)
    assert deflected(pulses, flight, 0.0).size == 0
    spoilt = bytearray(cards.eeprom_with(cards.card(ROWS)))
    spoilt[cards.CARD_AT + 60] ^= 1
    for eeprom in (cards.eeprom_with(cards.card(ROWS), valid=0xFF), bytes(spoilt)):
        other = flown(flight, eeprom)
        for mine, theirs in zip(pulses, other.sitl.pulses(), strict=True):
            assert np.array_equal(np.asarray(mine), np.asarray(theirs))
        assert bytes(other.image) == image
    assert not events(plain, tmp_path, CARD_ENABLED)


@pytest.mark.parametrize("what", ["no sign", "in the air", "switch", "stick not at its end"])
def test_no_input_without_the_sign_on_the_ground(what: str, tmp_path: Path) -> None:
    flight = calm()
    at_s = np.arange(len(flight.width_us)) * flight.frame_s
    sign = (at_s >= SIGN_S) & (at_s < UP_S)
    if what == "no sign":
        flight.width_us[sign, AILERON] = 1500
    elif what == "switch":
        flight.width_us[sign, SWITCH] = MEGA_US
    elif what == "stick not at its end":
        flight.width_us[sign, AILERON] = 1800
    else:
        flight.width_us[sign, :3] = 1500
        later = (at_s >= UP_S + 1.0) & (at_s < MEGA_S)
        flight.width_us[later, :3] = flight.width_us[sign][0, :3]
    bench = flown(flight, cards.eeprom_with(cards.card(ROWS)))
    assert not events(bench, tmp_path, CARD_ENABLED)
    assert deflected(bench.sitl.pulses(), flight, 0.0).size == 0


def test_two_rows_want_two_triggers(tmp_path: Path) -> None:
    flight = calm(7.0)
    at_s = np.arange(len(flight.width_us)) * flight.frame_s
    flight.width_us[(at_s > TRIGGER_S + 3.0) & (at_s < TRIGGER_S + 3.6), SWITCH] = MEGA_US
    bench = flown(flight, cards.eeprom_with(cards.card(ROWS)))
    assert [arg & 0xFF for _, arg in events(bench, tmp_path, INPUT_START)] == [0, 1]
    assert [arg & 0xFFFF for _, arg in events(bench, tmp_path, INPUT_END)] == [0, 1]


@pytest.mark.parametrize(
    ("limit", "why"),
    [({"height_min_pa": 2000, "height_max_pa": 2400}, HEIGHT), ({"alpha_max": 1900}, ALPHA)],
)
def test_a_trigger_outside_the_limits_is_refused(
    limit: dict[str, int], why: int, tmp_path: Path
) -> None:
    flight = calm()
    bench = flown(flight, cards.eeprom_with(cards.card(ROWS, (), (), **limit)))
    ((_, refused),) = events(bench, tmp_path, INPUT_REFUSED)
    assert refused == why << 8
    assert deflected(bench.sitl.pulses(), flight, 0.0).size == 0


def test_the_buttons_press_only_ends_the_input(tmp_path: Path) -> None:
    """2.5 s of it would end the recording, were the throttle idle; a short one would be a mark."""
    flight = calm(4.0)
    flight.button.append((TRIGGER_S + 0.5, 2.5))
    bench = flown(flight, cards.eeprom_with(cards.card(ROWS)))
    ((_, end),) = events(bench, tmp_path, INPUT_END)
    assert end & 0xFFFF == BUTTON << 8
    assert not events(bench, tmp_path, 24)  # mark
    assert not events(bench, tmp_path, 23)  # button
    assert Recorder(bench.sitl.state().recorder) == Recorder.RECORDING


def test_the_buzzer_says_each_end(tmp_path: Path) -> None:
    """One quick beep behind a row that was flown, two where the pilot ended it."""
    for moved, beeps in ((0, 1), (120, 2)):
        flight = calm(5.0)
        frame = int((TRIGGER_S + 0.6) / flight.frame_s)
        flight.width_us[frame:, AILERON] += moved
        bench = flown(flight, cards.eeprom_with(cards.card(ROWS)))
        ((end_s, _),) = events(bench, tmp_path, INPUT_END)
        at, level = bench.sitl.levels(Level.BUZZER)
        behind = (at > (end_s + 0.02) * TICKS_PER_S) & (level == 1)
        assert int(behind.sum()) == beeps
        running = (at > TRIGGER_S * TICKS_PER_S) & (at < end_s * TICKS_PER_S)
        assert int(running.sum()) >= 5


def test_receivers_that_hold_cannot_be_told_from_a_pilot() -> None:
    """Frozen pulses are a pilot who keeps still: the row's end is the bound, and it is kept."""
    number = KINDS.index(next(kind for kind in KINDS if kind.__name__ == "hold"))
    held = fly(number, SEED)
    assert held.started
    assert not held.wrong


@pytest.mark.parametrize("number", range(len(KINDS)))
def test_random_flights(number: int) -> None:
    """One flight with each fault of `make input-flights`, at another instant of another row."""
    assert not fly(number, SEED + 1).wrong


def test_a_held_surface_beyond_its_authority_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """A row that holds, without a fault: within the card's authority, and beyond half of it."""
    every = range(KINDS.index(nothing), 1000, len(KINDS))
    number = next(n for n in every if drawn_row(np.random.default_rng([SEED, n])) is HELD_ROW)
    flown_one = fly(number, SEED)
    assert (flown_one.held, flown_one.started, flown_one.wrong) == (True, True, ())
    half = tuple(0.5 * ticks for ticks in input_faults.HELD_TICKS)
    monkeypatch.setattr(input_faults, "HELD_TICKS", half)
    assert any("deflected by none" in line for line in fly(number, SEED).wrong)


def test_the_judge_sees_a_pulse_of_nobody() -> None:
    """The same flight judged as if no card were in it, and as if another row were flown."""
    flight = calm()
    pulses = flown(flight, cards.eeprom_with(cards.card(ROWS))).sitl.pulses()
    assert wrong_pulses(pulses, flight, None)
    other = Trigger(TRIGGER_S, TRIGGER_S + 2.0, 0.2, shape_of(ROWS[1]))
    assert wrong_pulses(pulses, flight, other)


def test_shapes_agree_with_the_page_to_the_tick(tmp_path: Path) -> None:
    """Sweep and multisine as flown: the commands in the log are the page's, 25 ms old at most."""
    for row in (ROWS[3], ROWS[4]):
        flight = calm(3.0)
        bench = flown(flight, cards.eeprom_with(cards.card([row], rate_max_usps=60_000)))
        ((start_s, _),) = events(bench, tmp_path, INPUT_START)
        ident = bench.log(tmp_path).frames["ident"]
        axes = row[1]
        for axis, name in enumerate(("aileron", "elevator", "rudder")):
            if not axes >> axis & 1:
                continue
            added = ident[f"servo_{name}"].astype(int) - ident[f"rc_{name}"].astype(int)
            at_ms = (ident["t_us"].astype(np.int64) - round(start_s * 1e6)) / 1000.0 - 200.0
            inside = np.flatnonzero((at_ms > 40) & (at_ms < 1990))
            assert inside.size > 150
            exact = 0
            for i in inside:
                ms = int(at_ms[i])
                recent = {deflection(row, axis, t) for t in range(ms - 25, ms + 1)}
                exact += int(added[i]) in recent
            # The sticks tremble: where a pulse came in between, log and command differ.
            assert exact > 0.8 * inside.size


PLAIN_S, SENSE_S, SERVO_S, TURNS_S = 0.025, 0.045, 0.020, 0.005


@pytest.mark.parametrize("shift_us", range(3_000, 5_000, 200))
def test_the_first_plain_pulse_begins_25_ms_behind_a_packet_that_is_too_old(shift_us: int) -> None:
    """Not the last deflected one: a servo's pulses are 20 ms apart."""
    flight = calm()
    last = int((TRIGGER_S + 0.9) / PACKET_S)
    flight.imu_sent[last + 1 :] = False
    flight.packet_delay_s = shift_us * 1e-6
    known_s = float(flight.packets()[0][last]) / TICKS_PER_S + 0.030
    bench = flown(flight, cards.eeprom_with(cards.card([ROWS[4]])))
    late = deflected(bench.sitl.pulses(), flight, TRIGGER_S) / TICKS_PER_S
    assert late.size > 20
    assert late[-1] + SERVO_S <= known_s + PLAIN_S


@pytest.mark.parametrize("behind_ms", range(2, 12))
def test_two_looks_at_an_open_contact_leave_time_for_the_servo(
    behind_ms: int, tmp_path: Path
) -> None:
    """Where no pulse calls for a look: all channels at once, and one frame is missing."""
    flight = input_flight(TRIGGER_S + 2.0, np.random.default_rng(SEED), 0.0225)
    flight.apart_us = 0
    missing = int((TRIGGER_S + 0.7) / flight.frame_s)
    flight.width_us[missing] = 0
    at_s = (missing - 1) * flight.frame_s + behind_ms * 0.001
    bench = flown(flight, cards.eeprom_with(cards.card(ROWS)), at_s)
    open_s = bench.sitl.now() / TICKS_PER_S
    bench.sitl.cut_relay()
    bench.sitl.run_until(round(flight.seconds * TICKS_PER_S))
    ((end_s, _),) = events(bench, tmp_path, INPUT_END)
    assert end_s - open_s <= SENSE_S - SERVO_S - TURNS_S


# ------------------------------------------------------------------------------ the card over USB
REQUEST, ANSWER = 240, 241
STATE, ERASE, WRITE, COMMIT, READ = (
    NUMBERS["card_command"][name] for name in ("state", "erase", "write", "commit", "read")
)
OK, MORE, NO_CARD, RECORDING, RELAY, AIRBORNE, DAMAGED, BAD_REQUEST = (
    NUMBERS["card_result"][name]
    for name in ("ok", "more", "no_card", "recording", "relay", "airborne", "damaged", "request")
)


def asked(bench: Bench, command: int, part: int = 0, data: bytes = b"") -> tuple[int, ...]:
    """Send a request byte by byte as flight-card.md says; return the answer's five fields."""
    body = bytes([3 + len(data), REQUEST, command, part]) + data
    return typed(bench, b"\xa5\x5a" + body + struct.pack("<H", crc16(body)))


def typed(bench: Bench, request: bytes) -> tuple[int, ...]:
    answer: tuple[int, ...] = ()
    for byte in request:
        before = len(bench.sitl.sent(Port.USB))
        bench.sitl.add_usb([bench.sitl.now() + 200], [byte])
        for _ in range(300):
            bench.sitl.run_for(0.004)
            frames = oracle.decode_stream(bench.sitl.sent(Port.USB)[before:]).frames
            found = [frame for frame in frames if frame[0] == ANSWER]
            if found:
                answer = struct.unpack_from("<3BIB", found[0], 1)
                break
        else:
            raise AssertionError(f"no answer behind byte {byte:#x}")
        if answer[1] != MORE:
            return answer
    return answer


def on_the_ground() -> Bench:
    flight = input_flight(90.0, np.random.default_rng(SEED))
    still = int(GROUND_S / flight.frame_s)
    flight.width_us[still:] = flight.width_us[still - 1]
    rest = int(GROUND_S / 0.005)
    flight.imu[rest:, :] = flight.imu[rest - 1]
    flight.analog[rest:, :] = 512.0
    flight.up[:] = flight.up[0]
    flight.place[:] = flight.place[0]
    flight.gps_sent[int(GROUND_S / 0.2) :] = False
    return flown(flight, None, GROUND_S)


def test_a_card_is_written_by_usb_read_back_and_kept(tmp_path: Path) -> None:
    bench = on_the_ground()
    data = cards.card(ROWS)
    parts = [data[i : i + 48] for i in range(0, len(data), 48)]
    assert asked(bench, STATE)[1:] == (NO_CARD, 0, 0, 14)
    for number, part in enumerate(parts):
        assert asked(bench, WRITE, number, part)[:4] == (WRITE, OK, number, 0)
    assert asked(bench, STATE)[1:4] == (NO_CARD, 0, 0)  # written is not valid
    assert bench.sitl.eeprom()[cards.VALID_AT] != cards.VALID
    assert asked(bench, COMMIT)[:4] == (COMMIT, OK, 0, cards.card_hash(data))
    assert bench.sitl.eeprom()[cards.CARD_AT :][: len(data)] == data
    assert asked(bench, STATE)[:4] == (STATE, OK, 0, cards.card_hash(data))
    bench.sitl.run_for(2.0)
    said = bench.sitl.sent(Port.USB)[-3000:]
    assert f"inputs {cards.card_hash(data):08x} rows 5 off".encode() in said
    # One spoilt bit, and the commit says which check failed; the card is none.
    spoilt = bytes([parts[3][0] ^ 3]) + parts[3][1:]
    assert asked(bench, WRITE, 3, spoilt)[1] == OK
    assert asked(bench, COMMIT)[1:5] == (DAMAGED, 0, 0, 4)
    bench.sitl.power_cut()
    bench.sitl.power_on()
    bench.sitl.run_for(GROUND_S)
    assert asked(bench, STATE)[1:4] == (NO_CARD, 0, 0)
    assert asked(bench, WRITE, 3, parts[3])[1] == OK
    assert asked(bench, COMMIT)[1] == OK
    assert asked(bench, ERASE)[:4] == (ERASE, OK, 0, 0)
    assert asked(bench, STATE)[1] == NO_CARD


def test_a_power_cut_in_any_part_leaves_no_card() -> None:
    bench = on_the_ground()
    data = cards.card(ROWS)
    bench.sitl.set_eeprom(cards.eeprom_with(data))
    bench.sitl.power_cut()
    bench.sitl.power_on()
    bench.sitl.run_for(GROUND_S)
    assert asked(bench, STATE)[1] == OK
    body = bytes([51, REQUEST, WRITE, 4]) + bytes(48)
    request = b"\xa5\x5a" + body + struct.pack("<H", crc16(body))
    assert typed(bench, request[:-1])[1] == MORE
    bench.sitl.add_usb([bench.sitl.now() + 200], [request[-1]])
    bench.sitl.run_for(0.05)  # some of its 49 bytes
    bench.sitl.power_cut()
    bench.sitl.power_on()
    bench.sitl.run_for(GROUND_S)
    assert asked(bench, STATE)[1:4] == (NO_CARD, 0, 0)


def test_the_card_is_not_written_while_it_might_matter() -> None:
    bench = on_the_ground()
    row = cards.row()
    bench.sitl.press(bench.sitl.now() + 2000, 0.2)
    bench.sitl.run_for(1.0)
    assert bench.state() == Recorder.RECORDING
    assert typed(bench, b"\xa5")[1] == RECORDING
    flight = calm()
    early = flown(flight, cards.eeprom_with(cards.card([row])), 2.0)
    assert asked(early, WRITE, 3, row)[1] == AIRBORNE  # nobody said yet that it is the ground
    assert asked(early, ERASE)[1] == AIRBORNE
    assert asked(early, STATE)[1] == OK
    assert asked(early, READ, 3)[1] == OK
    assert early.sitl.eeprom()[cards.VALID_AT] == cards.VALID
    engaged = calm()
    at_s = np.arange(len(engaged.width_us)) * engaged.frame_s
    engaged.width_us[(at_s > 6.0) & (at_s < SIGN_S), SWITCH] = ARMED_US
    relay = flown(engaged, cards.eeprom_with(cards.card([row])), GROUND_S)
    assert relay.sitl.state().relay
    assert asked(relay, WRITE, 3, row)[1] == RELAY


def test_garbage_on_the_line_is_answered_and_forgotten() -> None:
    bench = on_the_ground()
    assert typed(bench, b"x")[1] == BAD_REQUEST
    assert typed(bench, b"\xa5\x5a\x7f")[1] == BAD_REQUEST
    body = bytes([3, REQUEST, 9, 0])
    assert typed(bench, b"\xa5\x5a" + body + struct.pack("<H", crc16(body)))[1] == BAD_REQUEST
    assert typed(bench, b"\xa5\x5a" + body + b"\x00\x00")[1] == BAD_REQUEST
    assert typed(bench, b"\xa5\x5a\x03")[1] == MORE
    bench.sitl.run_for(0.7)  # it rests: forgotten
    assert asked(bench, STATE)[1] == NO_CARD


def test_a_reset_in_an_input_leaves_none_behind_it(tmp_path: Path) -> None:
    """The switch stays armed and is moved again: not enabled on the ground, nothing is flown."""
    flight = calm(8.0)
    at_s = np.arange(len(flight.width_us)) * flight.frame_s
    for start_s in (TRIGGER_S + 2.5, TRIGGER_S + 5.0):
        flight.width_us[(at_s > start_s) & (at_s < start_s + 0.4), SWITCH] = DIRECT_US
        flight.width_us[(at_s > start_s + 0.4) & (at_s < start_s + 1.1), SWITCH] = MEGA_US
    bench = flown(flight, cards.eeprom_with(cards.card(ROWS)), TRIGGER_S + 0.7)
    assert deflected(bench.sitl.pulses(), flight, ARMED_S).size > 0
    bench.sitl.reset(4)
    bench.sitl.run_until(round(flight.seconds * TICKS_PER_S))
    assert bench.sitl.state().drive == 5  # the Mega drives again, plainly
    assert deflected(bench.sitl.pulses(), flight, TRIGGER_S + 0.7).size == 0
