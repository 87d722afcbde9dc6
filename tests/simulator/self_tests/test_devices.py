"""Receiver, barometers, GPS, relay and supply against small programs."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from simavr_bench import (
    Bmp085,
    Bmp280,
    ChargePumpRelay,
    Chip,
    GpsUart,
    Receiver,
    ResetCause,
    Supply,
    XBee,
    cycles,
)
from simavr_bench.charge_pump import ChargePump
from simavr_bench.gps import POSLLH, PVT, SOL, VELNED, ubx
from simavr_bench.heartbeat import Beats, all_corners, judge_beats
from simavr_bench.log import LogKind, pulses, select
from simavr_bench.testing import MakeChip

# ---- receiver -----------------------------------------------------------------------------------


@pytest.mark.parametrize("sequential", [True, False])
@pytest.mark.parametrize("frame_ms", [14.0, 20.0, 22.5])
def test_receiver_sends_its_frames(make_chip: MakeChip, sequential: bool, frame_ms: float) -> None:
    chip = make_chip("pulses")
    pins = ["PK0", "PK1", "PK2", "PK3", "PK4"]
    chip.watch(*pins)
    receiver = Receiver(chip, pins, frame_s=frame_ms * 1e-3, sequential=sequential, jitter_us=2.0)
    receiver.width_us = [1100.0, 1300.0, 1500.0, 1700.0, 1900.0]
    receiver.start()
    chip.run_s(0.5)
    for channel, pin in enumerate(pins):
        seen = pulses(*chip.edges(pin)).astype(np.int64)
        assert np.array_equal(seen, receiver.pulses(channel)[: len(seen)])
        assert len(seen) >= 0.5 / (frame_ms * 1e-3) - 2
        assert np.abs(np.diff(seen, axis=1) / 16 - receiver.width_us[channel]).max() <= 2.1
    first, second = (receiver.pulses(c)[5] for c in (0, 1))
    assert (second[0] == first[1]) if sequential else (second[0] == first[0])
    starts = receiver.pulses(0)[:, 0]
    assert set(np.diff(starts)) == {cycles(frame_ms * 1e-3)}


def test_receiver_loses_channels_and_all(make_chip: MakeChip) -> None:
    chip = make_chip("pulses")
    chip.run_s(1e-3)
    receiver = Receiver(chip, ["PK0", "PK2"], gap_us=100.0).start()
    chip.run_s(0.095)
    receiver.lost_channels.add(1)
    chip.run_s(0.1)
    assert (len(receiver.pulses(0)), len(receiver.pulses(1))) == (10, 5)
    receiver.lost = True
    chip.run_s(0.1)
    assert len(receiver.pulses(0)) == 10
    counted = int(chip.read_array("count", "u1")[1])
    assert counted == 2 * (10 + 5)
    receiver.glitch(0, at_cycle=chip.cycle + 100, width_us=50.0)
    edges = receiver.noise(1, at_cycle=chip.cycle + 2000, time_s=0.01, rate_hz=1000.0)
    chip.run_s(0.1)
    assert int(chip.read_array("count", "u1")[1]) == counted + 2 + edges


# ---- barometers ---------------------------------------------------------------------------------


def test_bmp085_answers_on_a_bit_banged_bus(make_chip: MakeChip) -> None:
    chip = make_chip("soft_i2c", power=False)
    baro = Bmp085(chip, "PA2", "PA3")
    baro.raw_temperature, baro.raw_pressure = 27898, 271097
    chip.power_on()
    chip.run_s(0.1)
    assert chip.read("chip_id") == 0x55
    words = struct.unpack(">hhhHHHhhhhh", chip.read_array("calibration", "u1").tobytes())
    assert words[:6] == (408, -72, -14383, 32741, 32757, 23153)
    assert chip.read("temperature") == 27898
    assert chip.read("pressure") == 271097
    assert chip.read("missing") == 0
    assert 100_000 < baro.fastest_scl_hz < 200_000
    assert [command for _, command in baro.conversions[:2]] == [0x2E, 0xF4]
    baro.raw_temperature = 24342
    while chip.read("too_early") == 0:
        chip.run_s(0.01)
    assert chip.read("too_early") != 24342  # the old result stands while it converts
    chip.run_s(0.05)
    assert chip.read("temperature") == 24342


def test_barometer_goes_missing_and_its_bus_sticks(make_chip: MakeChip) -> None:
    chip = make_chip("soft_i2c", power=False)
    baro = Bmp085(chip, "PA2", "PA3")
    chip.power_on()
    chip.run_s(0.05)
    baro.present = False
    chip.run_s(0.1)
    assert chip.read("missing") == 1
    baro.present = True
    chip.run_s(0.1)
    assert chip.read("missing") == 0
    baro.hold(sda=True, scl=False)
    assert not chip.level("PA2")
    chip.run_s(0.1)
    baro.hold(sda=False, scl=False)
    assert chip.level("PA2") or chip.is_output("PA2")
    chip.run_s(0.2)
    assert chip.read("missing") == 0
    assert chip.read("chip_id") == 0x55


def test_bmp280_measures_in_forced_mode_and_its_time() -> None:
    with Chip() as chip:
        baro = Bmp280(chip, "PA2", "PA3", 0x77)
        assert baro.get(0xD0) == 0x58
        baro.put(0xF4, b"\x25")
        baro.written(0xF4, 0x25)  # one of each, forced
        chip.run_s(0.0063)
        assert baro.get(0xF7) == 0x80
        chip.run_s(0.0003)
        raw = bytes(baro.get(0xF7 + i) for i in range(6))
        assert int.from_bytes(raw[:3], "big") >> 4 == 415148
        assert int.from_bytes(raw[3:], "big") >> 4 == 519888
        assert baro.get(0xF4) & 3 == 0


# ---- GPS ----------------------------------------------------------------------------------------


def test_ubx_checksum_is_the_datasheets() -> None:
    # CFG-RATE 200 ms with its checksum, as widely published
    expected = bytes.fromhex("b562060806 00c800010001 00de6a".replace(" ", ""))
    assert ubx((6, 8), bytes.fromhex("c80001000100")) == expected


def test_gps_speaks_nmea_until_it_is_configured(make_chip: MakeChip) -> None:
    chip = make_chip("uart")
    gps = GpsUart(chip, 1, baud=38400)
    gps.start()
    chip.run_s(1.5)
    assert gps.epochs
    assert chip.read("finished") == 1
    for kind, body in (
        ((6, 0x00), struct.pack("<BxxxII", 1, 0x8D0, 57600) + bytes([3, 0, 1, 0, 0, 0, 0, 0])),
        ((6, 0x08), struct.pack("<HHH", 200, 1, 1)),
        ((6, 0x01), bytes([*POSLLH, 1])),
        ((6, 0x01), bytes([*SOL, 1])),
        ((6, 0x01), bytes([*VELNED, 1])),
        ((6, 0x01), bytes([*PVT, 1])),
    ):
        gps._command(kind, body)
    assert gps.baud == 57600
    assert not gps.nmea
    assert gps.enabled == {POSLLH, SOL, VELNED}  # an old one refuses PVT
    before = len(gps.epochs)
    chip.run_s(2.0)
    assert len(gps.epochs) - before >= 5


def test_gps_hears_only_its_baud(make_chip: MakeChip) -> None:
    chip = make_chip("uart")
    chip.run_s(0.01)  # the program has set 117647 baud
    message = ubx((6, 8), bytes.fromhex("c80001000100"))
    near, far = GpsUart(chip, 0, baud=115200), GpsUart(chip, 0, baud=9600)
    for byte in message:
        near._byte(byte, 0)
        far._byte(byte, 0)
    assert near.configured == [(6, 8)]
    assert near.period_ms == 200
    assert far.configured == []


def test_radio_lets_through_what_the_air_takes(make_chip: MakeChip) -> None:
    chip = make_chip("everything", power=False)  # sends at 58.8 kbit/s without looking at CTS
    radio = XBee(chip, 3, cts="PA7").start()
    assert not chip.level("PA7")
    chip.power_on()
    chip.run_s(1.0)
    sent = len(chip.uart_sent(3))
    assert sent == pytest.approx(58824 / 10, rel=0.02)
    assert len(radio.delivered) == pytest.approx(35_000 / 8, rel=0.01)
    assert sent == len(radio.delivered) + radio.lost + len(radio._buffer)
    assert chip.level("PA7")
    radio.air_bps = 0.0
    delivered = len(radio.delivered)
    chip.run_s(0.2)
    assert len(radio.delivered) <= delivered + 1


# ---- relay and supply ---------------------------------------------------------------------------

SERVOS = {"aileron": ("PK0", "PE4")}


def relay_bench(make_chip: MakeChip) -> tuple[Chip, ChargePumpRelay, Receiver]:
    chip = make_chip("heartbeat", power=False)
    for pin in ("PA0", "PA1", "PA2"):
        chip.drive(pin, True)
    relay = ChargePumpRelay(chip, "PH5", SERVOS, sense="PH6")
    receiver = Receiver(chip, ["PK0"], frame_s=0.020).start()
    return chip, relay, receiver


def test_relay_engages_on_a_living_heartbeat_only(make_chip: MakeChip) -> None:
    chip, relay, _ = relay_bench(make_chip)
    chip.run_s(0.1)
    assert not relay.engaged
    chip.power_on()
    chip.run_s(0.3)
    assert relay.engaged
    assert not chip.level("PH6")


def integrated(pump: ChargePump, time_s: float) -> tuple[float, float]:
    """Kirchhoff's laws in steps of 0.1 us."""
    v1, v2, step_s = pump.coupling_volt, pump.gate_volt, 1e-7
    for _ in range(round(time_s / step_s)):
        if pump.level:
            into = max(0.0, pump.supply_volt - pump.diode_volt - v1 - v2) / pump.series_ohm
        else:
            into = -max(0.0, v1 - pump.diode_volt) / pump.series_ohm
        v1 += step_s * into / pump.coupling_f
        v2 += step_s * (max(0.0, into) - v2 / pump.bleed_ohm) / pump.reservoir_f
    return v1, v2


def test_charge_pump_solves_its_circuit() -> None:
    rng = np.random.default_rng(3)
    pump = ChargePump(coupling_f=0.3e-6, reservoir_f=0.8e-6)
    for edge in range(12):
        time_s = float(rng.uniform(1e-5, 3e-3))
        assert pump.at(time_s) == pytest.approx(integrated(pump, time_s), abs=2e-3)
        pump.edge(edge % 2 == 0, time_s)
    # no D2 current at first: C1 kept its charge, the gate is above what the pin gives
    pump.edge(True, 0.0)
    pump.coupling_volt, pump.gate_volt = 3.0, 3.5
    for time_s in (1e-3, 8e-3, 12e-3):
        assert pump.at(time_s) == pytest.approx(integrated(pump, time_s), abs=2e-3)


@pytest.mark.parametrize("high", [True, False], ids=["high", "low"])
def test_charge_pump_that_stands_still_is_empty_in_time(high: bool) -> None:
    """Capacitors 10 % and resistors 5 % too large; 7 ms of the coil are still to come."""
    pump = ChargePump(
        coupling_f=0.363e-6, reservoir_f=0.517e-6, bleed_ohm=26_775.0, diode_volt=0.24
    )
    for edge in range(200):
        pump.edge(edge % 2 == 0, 1e-3)
    if high != pump.level:
        pump.edge(high, 1e-3)
    assert pump.gate_volt > 2.75
    assert pump.falls_below(0.8) < 0.038
    assert pump.at(pump.falls_below(0.8))[1] == pytest.approx(0.8, abs=1e-6)


@pytest.mark.parametrize("pin", ["PA0", "PA1", "PA2"], ids=["stuck high", "stuck low", "hang"])
def test_relay_lets_go_within_50_ms(make_chip: MakeChip, pin: str) -> None:
    chip, relay, receiver = relay_bench(make_chip)
    chip.power_on()
    chip.run_s(0.5)
    assert relay.engaged
    at = chip.cycle
    chip.drive(pin, False)
    chip.run_s(0.2)
    assert not relay.engaged
    closed = next(cycle for cycle, state in relay.contacts if cycle > at and state == 1)
    assert closed - at < cycles(0.050)
    seen = relay.servo_pulses("aileron")
    gaps = np.diff(seen[:, 0]) / 16e6
    after = seen[seen[:, 0] > closed + cycles(0.03)]
    assert np.allclose(np.diff(after, axis=1), 1500 * 16, atol=1)
    assert gaps[seen[1:, 0] > cycles(0.1)].max() < 0.110
    assert len(receiver.pulses(0)) > 30


def test_servo_behind_the_relay_sees_the_megas_pulses(make_chip: MakeChip) -> None:
    chip, relay, _ = relay_bench(make_chip)
    chip.power_on()
    chip.run_s(0.6)
    seen = relay.servo_pulses("aileron")
    late = seen[seen[:, 0] > cycles(0.4)]
    mega = pulses(*chip.edges("PE4")).astype(np.int64)
    assert np.isin(late, mega).all()
    # the copy is made in whole timer clocks of 0.5 us
    assert np.abs(np.diff(late, axis=1) / 16 - 1500).max() <= 1.0


def test_reset_releases_the_relay(make_chip: MakeChip) -> None:
    chip, relay, _ = relay_bench(make_chip)
    chip.power_on()
    chip.run_s(0.4)
    assert relay.engaged
    chip.hold_reset(ResetCause.BROWN_OUT)
    chip.run_s(0.06)
    assert not relay.engaged


def beat(chip: Chip, edges: int) -> None:
    """Make the heartbeat from outside, an edge each millisecond."""
    for _ in range(edges):
        chip.drive("PH5", not chip.level("PH5"))
        chip.run_s(0.001)


def test_relay_turned_back_forgets_the_movement_it_gave_up(make_chip: MakeChip) -> None:
    """Let go while the new contact still bounces, and pulled in again before it went away."""
    chip, relay, _ = relay_bench(make_chip)
    relay.bounce_s, relay.on_volt, relay.off_volt = 0.020, 1.5, 1.5
    beat(chip, 20)  # 8 ms until the contact is made, then it bounces
    assert relay.engaged
    chip.run_s(0.1)
    assert not relay.engaged
    states = [state for _, state in relay.contacts]
    last_of_mega = len(states) - 1 - states[::-1].index(2)
    opened = relay.contacts[last_of_mega + 1][0]
    behind = [(cycle, state) for cycle, state in relay.contacts if cycle > opened]
    # 5 ms in the air, the make, two bounces of its own
    assert [state for _, state in behind] == [1, 0, 1, 0, 1]
    assert behind[0][0] - opened == cycles(relay.transfer_s)


def test_relay_let_go_for_a_moment_does_not_open(make_chip: MakeChip) -> None:
    """The gate comes below the threshold for 2 ms: the armature needs 7 to leave."""
    chip, relay, _ = relay_bench(make_chip)
    relay.on_volt = relay.off_volt = 2.5
    beat(chip, 60)
    chip.run_s(0.009)
    assert not relay.energised
    before = len(relay.contacts)
    beat(chip, 60)
    assert relay.energised
    assert len(relay.contacts) == before


def test_worst_pump_is_the_worst_of_all_corners() -> None:
    """A pattern with the longest rests allowed, and one of 1 ms with a rest of 3 ms in it."""
    for pattern in ([0.004, 0.0025], [0.001] * 30 + [0.003], [0.001]):
        rests = np.array((pattern * 200)[:400])
        at = np.concatenate(([0], np.cumsum(np.round(rests * 16e6)))).astype(np.uint64)
        for first in (0, 1):
            level = ((np.arange(len(at)) + first) % 2).astype(np.uint8)
            found = [judge_beats(at, level, pump=pump).gate_volt for pump in all_corners()]
            assert judge_beats(at, level).gate_volt == pytest.approx(min(found), abs=1e-3)


def test_heartbeat_that_rests_is_noticed() -> None:
    """An edge each millisecond; then one of 6.5 ms, then two of 2.7 ms."""
    steady = [0.001] * 100
    level = (np.arange(200) % 2).astype(np.uint8)

    def judged(rests: list[float], *, may_stop: bool = False) -> Beats:
        at = np.cumsum(np.round(np.array(rests) * 16e6)).astype(np.uint64)
        return judge_beats(at, level[: len(at)], may_stop=may_stop)

    assert judged(steady).wrong() == []
    assert judged(steady).gate_volt == pytest.approx(2.73, abs=0.01)
    high, low = [*steady[:50], 0.0065, *steady[:50]], [*steady[:51], 0.0065, *steady[:50]]
    assert judged(high).wrong() == ["the heartbeat rested 6.50 ms", "the gate at 1.99 V"]
    assert judged(low).wrong() == ["the heartbeat rested 6.50 ms", "the gate at 1.60 V"]
    two = judged([*steady[:50], 0.0027, 0.0027, *steady[:50]])
    assert two.wrong() == ["two rests of the heartbeat in a row of 2.70 ms"]
    # what the two limits allow once leaves the gate above its own
    assert judged([*steady[:51], 0.004, *steady[:50]]).gate_volt == pytest.approx(2.04, abs=0.01)
    stopped = [*steady[:50], 0.5, *steady[:50]]
    assert judged(stopped, may_stop=True).wrong() == []
    assert judged(stopped).wrong()[0] == "the heartbeat rested 500.00 ms"


def test_supply_resets_by_voltage(make_chip: MakeChip) -> None:
    chip = make_chip("reset", power=False)
    chip.drive("PK0", True)
    supply = Supply(chip, brown_out_volt=4.3)
    supply.set(5.0)
    chip.run_s(0.01)
    assert chip.read("cause") == ResetCause.POWER_ON
    kept = chip.read("kept")
    supply.set(4.4)
    chip.run_s(0.01)
    assert chip.state == "running"
    supply.set(4.2)
    chip.run_s(0.01)
    assert chip.state == "reset"
    supply.set(4.32)
    chip.run_s(0.01)
    assert chip.state == "reset"  # hysteresis
    supply.set_at(chip.cycle + 100, 5.0)
    chip.run_s(0.01)
    assert chip.read("cause") == ResetCause.BROWN_OUT
    assert chip.read("kept") == (kept + 1) & 0xFFFF
    supply.set(0.0)
    assert chip.state == "off"
    powered = select(chip.log(), LogKind.POWER)
    assert list(powered["value"]) == [1, 0]
