"""Every fault a card can name, on a short flight through the recorder, must show in its log."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from host.log import read_log
from host.twin.faults import FAULTS, Fault
from host.twin.flight.fly import fly
from host.twin.outcome import compare
from host.twin.recorder import sitl
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard import cards

from tests.host.twin.short_flight import AT_S, CARD, FOR_S, Flown, fly_with, make

FRESH, UNSATURATED, ATTITUDE, TRIGGERED = (1 << bit for bit in (10, 11, 12, 13))
RC = ("rc_aileron", "rc_elevator", "rc_rudder", "rc_throttle", "rc_switch")
INERTIAL = ("p", "q", "r", "ax", "ay", "az")
ANALOGUE = ("alpha_a", "alpha_b", "beta_a", "beta_b", "dp_a", "dp_b",
            "pot_elevator", "pot_aileron_left", "pot_aileron_right", "pot_rudder")  # fmt: skip
NO_DRIVE = {"direct_receiver_lost": 3, "direct_self_test": 4}


@pytest.fixture(scope="module")
def calm(library: Path, tmp_path_factory: pytest.TempPathFactory) -> Flown:
    assert library.is_file()
    return fly_with(tmp_path_factory.mktemp("calm"))


def card_stall(f: Flown, calm: Flown) -> None:
    (stall_ms,) = f.told("card_stall")
    assert stall_ms == pytest.approx(500, abs=10)
    assert int(f.system["card_busy_max_ms"].max()) == stall_ms
    assert f.gaps() == 0


def card_stall_too_long(f: Flown, calm: Flown) -> None:
    assert 0 < f.gaps() <= sum(f.told("frames_dropped"))
    assert f.count("frames_dropped") == sum(f.told("frames_dropped"))
    # The main loop never waited for the card.
    assert int(f.system["loop_max_us"].max()) <= int(calm.system["loop_max_us"].max()) + 100


def card_away(f: Flown, calm: Flown) -> None:
    assert len(f.told("card_removed")) == 1
    assert f.started() == ["button", "resumed"]
    assert not f.during.any()
    assert f.after.any()


def refused_once(f: Flown, calm: Flown) -> None:
    assert f.count("card_errors") == 1
    assert f.told("block_skipped") == []
    assert f.gaps() == 0


def refused_twice(f: Flown, calm: Flown) -> None:
    assert len(f.told("block_skipped")) == 1
    assert f.gaps() == 0


def power_gone(f: Flown, calm: Flown) -> None:
    assert AT_S - 0.15 < f.at_s[-1] <= AT_S
    assert f.ended() == ["next_boot"]
    assert f.log.complete == "complete"


def baro_gone(status: int) -> Callable[[Flown, Flown], None]:
    def check(f: Flown, calm: Flown) -> None:
        assert f.told("baro_lost") == [status]
        assert len(f.told("baro_found")) == 2
        at_s = f.log.frames["baro"]["t_us"] * 1e-6
        assert not ((at_s > AT_S + 0.1) & (at_s < AT_S + FOR_S)).any()
        assert (at_s > AT_S + FOR_S + 1.2).any()
        assert f.count("baro_errors") > 0
        assert f.gaps() == 0

    return check


def baro_refused(f: Flown, calm: Flown) -> None:
    # As the sensor's words are: the chip simulator's model takes no others.
    words = struct.pack("<hhhHHHhhhhh", *f.given.coefficients)
    assert words in (b"\xff" * 22, b"\0" * 22)
    assert f.told("baro_found") == []
    assert f.count("baro_errors") >= 5  # tried again about once a second
    assert not (f.log.frames["baro"]["static_pressure"] != 0).any()


def baro_frozen(f: Flown, calm: Flown) -> None:
    baro = f.log.frames["baro"]
    at_s = baro["t_us"] * 1e-6
    held = (at_s > AT_S + 0.2) & (at_s < AT_S + FOR_S - 0.1)
    assert len(np.unique(baro["raw_pressure"][held])) == 1
    assert len(np.unique(baro["raw_pressure"][at_s < AT_S])) > 20


def imu_silent(f: Flown, calm: Flown) -> None:
    assert f.told("imu_lost") == [pytest.approx(101, abs=5)]
    assert f.told("imu_found") == [0, 0]
    assert f.valid(FRESH, f.during) == f.valid(TRIGGERED, f.during) == {0}
    assert f.valid(FRESH, f.after) == {1}
    assert len(np.unique(f.ident["imu_seq"][f.during])) == 1
    assert f.gaps() == 0


def imu_frozen(f: Flown, calm: Flown) -> None:
    for name in INERTIAL:
        assert len(np.unique(f.ident[name][f.during])) == 1
    assert len(np.unique(f.ident["imu_seq"][f.during])) > 50


def damaged(f: Flown) -> int:
    """Packets on the bus that differ from those of the same flight without the fault."""
    good = {p.data for p in stimuli(replace(f.record, card=replace(f.card, faults=())),
                                    air_data(f.record)).packets}  # fmt: skip
    return sum(p.data not in good for p in f.given.packets)


def imu_damaged(f: Flown, calm: Flown) -> None:
    assert f.count("imu_bad_packets") == damaged(f) > 3
    assert f.count("imu_lost") == f.count("imu_bad_packets")
    sent = {row.tobytes() for row in f.given.imu.raw}
    logged = np.column_stack([f.ident[n] for n in (*INERTIAL, "phi", "theta", "psi")])
    assert all(row.tobytes() in sent for row in logged)


def imu_at_half_rate(f: Flown, calm: Flown) -> None:
    assert f.count("imu_lost") == 0
    assert f.count("imu_packets") == pytest.approx(calm.count("imu_packets") - 200, abs=3)
    assert f.valid(FRESH, f.during) == {1}


def imu_gaps(f: Flown, calm: Flown) -> None:
    seq = np.array([p.data[1] for p in f.given.packets if p.start < f.system["t_us"][-1] * 2])
    missing = int(((np.diff(seq.astype(int)) - 1) % 256).sum())
    assert f.count("imu_lost") == missing > 5
    assert f.gaps() == 0


def imu_twice(f: Flown, calm: Flown) -> None:
    assert len(f.given.packets) > len(calm.given.packets) + 5
    # The second of a pair is no packet of its own (a health frame may come a packet later).
    assert f.count("imu_packets") == pytest.approx(calm.count("imu_packets"), abs=1)
    assert f.count("imu_bad_packets") == f.count("imu_lost") == 0
    # 200 samples a second for 100 rows: each row has the second sample behind that of the last.
    assert set((np.diff(f.ident["imu_seq"].astype(int)) % 256).tolist()) == {2}


def imu_again(f: Flown, calm: Flown) -> None:
    assert f.told("imu_restarted") == [0]
    assert len(f.told("imu_lost")) == 1
    assert f.valid(ATTITUDE, f.during & (f.at_s > AT_S + 0.5)) == {0}
    # Rates and forces are as if nothing had been: no new zero in flight.
    known = {row.tobytes() for row in calm.given.imu.raw[:, :6]}
    logged = np.column_stack([f.ident[name][f.after] for name in INERTIAL])
    assert len(logged) > 100
    assert all(row.tobytes() in known for row in logged)


def gyro_full(f: Flown, calm: Flown) -> None:
    assert f.valid(UNSATURATED, f.during) == {0}
    assert f.valid(UNSATURATED, f.after) == {1}
    assert set(f.ident["q"][f.during].tolist()) == {32767}


def one_channel_lost(f: Flown, calm: Flown) -> None:
    assert f.told("receiver_lost") == [4]
    assert f.ident["rc_rudder"][f.during].max() == 0
    for name in (n for n in RC if n != "rc_rudder"):
        assert f.ident[name][f.during].min() > 0
    assert f.ident["rc_rudder"][f.after].min() > 0


def all_channels_lost(f: Flown, calm: Flown) -> None:
    assert f.told("receiver_lost")[-1] == 31
    gone = f.at_s[(f.at_s > AT_S) & (f.ident["rc_elevator"] == 0)][0]
    assert gone - AT_S < 0.1
    assert all(f.ident[name][f.during].max() == 0 for name in RC)
    assert NO_DRIVE["direct_receiver_lost"] in f.told("drive_changed")
    # It acts on the aircraft: the motor runs down.
    later = f.record.t_s > AT_S + 1.5
    assert f.record.thrust_n[later].min() < 0.2 * calm.record.thrust_n[later].min()


def preset_pulses(f: Flown, calm: Flown) -> None:
    assert set(f.ident["rc_switch"][f.during].tolist()) <= {1799, 1800, 1801}
    assert NO_DRIVE["direct_receiver_lost"] in f.told("drive_changed")
    assert f.told("receiver_lost") == []


def extra_pulses(f: Flown, calm: Flown) -> None:
    assert f.count("rc_glitches") > calm.count("rc_glitches") + 5
    for name in RC:
        # No glitch is taken for a pulse. A pulse right behind one is refused too: the last one
        # stands for a frame more.
        known = np.unique(calm.ident[name].astype(int))
        assert np.abs(f.ident[name].astype(int)[:, None] - known).min(axis=1).max() <= 4
        rows = min(len(f.ident), len(calm.ident))  # the last block may end a little earlier
        assert (f.ident[name][:rows] != calm.ident[name][:rows]).mean() < 0.05


def storm_on_a_line(f: Flown, calm: Flown) -> None:
    assert f.told("receiver_lost") == [1]
    assert f.ident["rc_aileron"][f.during].max() == 0
    assert f.ident["rc_elevator"][f.during].min() > 0
    assert f.count("rc_glitches") > 1000
    assert f.told("reset") == [1]
    assert f.gaps() == 0


def at_the_rail(name: str, raw: int) -> Callable[[Flown, Flown], None]:
    def check(f: Flown, calm: Flown) -> None:
        bit = 1 << ANALOGUE.index(name)
        assert f.valid(bit, f.during) == {0}
        assert f.valid(bit, f.after) == {1}
        assert np.abs(f.ident[name][f.during].astype(int) - raw).max() <= 4
        others = [n for n in ANALOGUE if n != name]
        rows = min(len(f.ident), len(calm.ident))
        assert all(np.array_equal(f.ident[n][:rows], calm.ident[n][:rows]) for n in others)

    return check


def still(name: str) -> Callable[[Flown, Flown], None]:
    def check(f: Flown, calm: Flown) -> None:
        # Four conversions of one voltage with 0.4 counts of noise.
        assert f.ident[name][f.during].std() < 1.2
        assert f.valid(1 << ANALOGUE.index(name), f.during) == {1}

    return check


def turned_round(f: Flown, calm: Flown) -> None:
    zero = 4 * 512
    assert f.ident["dp_b"][f.during].max() < zero < calm.ident["dp_b"][calm.during].min()
    column = f.log.table()["differential_b_pa"].to_numpy()
    assert column[f.during].max() < 0.0  # signed, not clipped


def supply_low(f: Flown, calm: Flown) -> None:
    assert int(f.system["avcc_mv"].min()) == 4400
    rows = min(len(f.ident), len(calm.ident))
    assert all(np.array_equal(f.ident[n][:rows], calm.ident[n][:rows]) for n in ANALOGUE)


def supply_far_too_low(f: Flown, calm: Flown) -> None:
    # The reference of an uncalibrated chip may be 1.2 V: only below 4.1 V it is sure of 4.5 V.
    assert int(f.system["avcc_mv"].min()) == 4000
    assert NO_DRIVE["direct_self_test"] in f.told("drive_changed")


def rail_low(f: Flown, calm: Flown) -> None:
    low, usual = int(f.system["rail"].min()), int(calm.system["rail"].min())
    assert low / usual == pytest.approx(4.0 / 5.0, abs=0.01)
    assert int(f.system["rail"][-1]) == usual


def restarted(cause: int) -> Callable[[Flown, Flown], None]:
    def check(f: Flown, calm: Flown) -> None:
        assert f.told("reset") == [1, cause]
        assert f.started() == ["button", "resumed"]
        # The first prepared the file, at an earlier power-on.
        assert [session.number for session in f.log.sessions] == [1, 2, 3]
        second = read_log(f.path, session=3).frames
        assert second["identity"]["resumed"][0] == 1
        assert second["identity"]["reset_cause"][0] == cause
        # Its clock begins at the reset: back within a second.
        assert second["ident"]["t_us"][0] < 1_000_000

    return check


def gps_silent(f: Flown, calm: Flown) -> None:
    assert len(f.told("gps_lost")) == 1
    assert len(f.told("gps_found")) == 2
    at_s = f.log.frames["gps"]["t_us"] * 1e-6
    assert not ((at_s > AT_S + 0.1) & (at_s < AT_S + FOR_S)).any()
    assert (at_s > AT_S + FOR_S).sum() > 5


def gps_damaged(f: Flown, calm: Flown) -> None:
    assert f.count("gps_errors") > 3
    known = set(calm.log.frames["gps"]["latitude"].tolist())
    assert set(f.log.frames["gps"]["latitude"].tolist()) <= known
    assert len(f.log.frames["gps"]) < len(calm.log.frames["gps"]) - 5
    for name in ("itow_ms", "latitude", "v_north"):
        mine, theirs = (log.frames["gps"][name][-5:] for log in (f.log, calm.log))
        assert np.array_equal(mine, theirs)


def gps_blind(f: Flown, calm: Flown) -> None:
    gps = f.log.frames["gps"]
    at_s = gps["t_us"] * 1e-6
    assert set(gps["fix"][(at_s > AT_S + 0.1) & (at_s < AT_S + FOR_S)].tolist()) == {0}
    assert set(gps["fix"][at_s > AT_S + FOR_S + 0.3].tolist()) == {3}


def gps_astray(f: Flown, calm: Flown) -> None:
    gps = f.log.frames["gps"]
    at_s = gps["t_us"] * 1e-6
    wrong = (at_s > AT_S + 0.1) & (at_s < AT_S + FOR_S)
    assert wrong.sum() > 5
    assert not (np.abs(gps["latitude"][wrong] * 1e-7) <= 90.0).any()
    assert np.isfinite(f.log.table()["t_s"]).all()


def gps_week_over(f: Flown, calm: Flown) -> None:
    gps = f.log.frames["gps"]
    assert set(gps["week"].tolist()) == {1024, 2047}
    assert int(gps["itow_ms"].max()) > 604_700_000
    assert int(gps["itow_ms"][-1]) < 10_000
    rows = min(len(f.ident), len(calm.ident))
    assert np.allclose(f.log.table()["t_s"][:rows], calm.log.table()["t_s"][:rows], atol=1e-3)


def radio_blocked(f: Flown, calm: Flown) -> None:
    assert f.count("telemetry_dropped") > calm.count("telemetry_dropped") + 30
    rows = min(len(f.ident), len(calm.ident))
    assert np.array_equal(f.ident["q"][:rows], calm.ident["q"][:rows])
    assert f.gaps() == 0


def settings_gone(f: Flown, calm: Flown) -> None:
    assert f.told("settings_default") == [1]
    assert calm.told("settings_default") == []


def clock_over(f: Flown, calm: Flown) -> None:
    assert f.ident["t_us"][0] > f.ident["t_us"][-1]
    table = f.log.table()
    rows = min(len(f.ident), len(calm.ident))
    assert np.allclose(table["t_s"][:rows], calm.log.table()["t_s"][:rows], atol=1e-3)
    at = compare.true_times(f.record, table, int(f.ident["t_us"][0]))
    assert [d.column for d in compare.deviations(f.record, table, at) if not d.within] == []


CASES: list[tuple[Fault, Callable[[Flown, Flown], None]]] = [
    (make("card_busy"), card_stall),
    (make("card_busy", 1200.0), card_stall_too_long),
    (make("card_removed"), card_away),
    (make("card_reject"), refused_once),
    (make("card_reject", 2.0), refused_twice),
    (make("power_cut"), power_gone),
    (make("baro_bus_stuck"), baro_gone(2)),
    (make("baro_off"), baro_gone(1)),
    (make("baro_garbage"), baro_refused),
    (make("baro_garbage", 0.0), baro_refused),
    (make("baro_stuck"), baro_frozen),
    (make("imu_off"), imu_silent),
    (make("imu_stuck"), imu_frozen),
    (make("imu_garbage", 0.05), imu_damaged),
    (make("imu_short", 0.05), imu_damaged),
    (make("imu_slow"), imu_at_half_rate),
    (make("imu_lost_packets"), imu_gaps),
    (make("imu_repeated"), imu_twice),
    (make("imu_reset"), imu_again),
    (make("gyro_saturated", channel="q"), gyro_full),
    (make("receiver_channel_lost", channel="rudder"), one_channel_lost),
    (make("receiver_lost"), all_channels_lost),
    (make("receiver_failsafe"), preset_pulses),
    (make("receiver_glitch", channel="elevator"), extra_pulses),
    (make("receiver_storm"), storm_on_a_line),
    (make("vane_stuck", channel="beta_a"), still("beta_a")),
    (make("vane_open"), at_the_rail("alpha_a", 4092)),
    (make("vane_short", channel="beta_b"), at_the_rail("beta_b", 0)),
    (make("pot_open"), at_the_rail("pot_elevator", 4092)),
    (make("pot_short", channel="pot_rudder"), at_the_rail("pot_rudder", 0)),
    (make("pitot_open"), at_the_rail("dp_a", 4092)),
    (make("pitot_short", channel="dp_b"), at_the_rail("dp_b", 0)),
    (make("pitot_blocked"), still("dp_a")),
    (make("pitot_swapped", channel="dp_b"), turned_round),
    (make("supply_sag"), supply_low),
    # Three low measurements in a row, one a second: an odd one releases nothing.
    (replace(make("supply_sag", 4.0), duration_s=4.5), supply_far_too_low),
    (make("rail_drop"), rail_low),
    (make("brown_out"), restarted(3)),
    (make("watchdog_reset"), restarted(4)),
    (make("gps_off"), gps_silent),
    (make("gps_garbage"), gps_damaged),
    (make("gps_no_fix"), gps_blind),
    (make("gps_far"), gps_astray),
    (make("gps_rollover"), gps_week_over),
    (make("telemetry_blocked"), radio_blocked),
    (make("settings_damaged"), settings_gone),
    (make("clock_wrap"), clock_over),
]


@pytest.mark.parametrize(
    ("fault", "check"), CASES, ids=[f"{f.kind}-{f.channel or f.amount:}" for f, _ in CASES]
)
def test_a_fault_is_in_the_log_as_it_must_be(
    calm: Flown, tmp_path: Path, fault: Fault, check: Callable[[Flown, Flown], None]
) -> None:
    flown = fly_with(tmp_path, fault)
    check(flown, calm)
    if not FAULTS[fault.kind].from_start and fault.kind != "clock_wrap":
        # Up to the fault the log is that of the flight without it.
        for name in ("count", "valid", "imu_seq", *INERTIAL, *ANALOGUE, *RC):
            mine = flown.ident[name][: np.searchsorted(flown.at_s[:230], AT_S - 0.1)]
            assert np.array_equal(mine, calm.ident[name][: len(mine)]), name
            assert len(mine) > 200
    # And the flight without it does not pass for one with it.
    with pytest.raises((AssertionError, ValueError, IndexError)):
        check(calm, calm)


@pytest.mark.parametrize("kind", ["card_absent", "card_full", "card_unformatted"])
def test_an_unusable_card_is_refused_and_said_so(library: Path, kind: str) -> None:
    assert library.is_file()
    faults = (make(kind),)
    record = fly(replace(cards.parse(CARD, "short"), faults=faults), seed=2)
    recording = sitl.record(
        stimuli(record, air_data(record)), rate_hz=100, aircraft="x", faults=faults
    )
    assert recording.log == b""
    assert recording.name == sitl.NO_FILE[kind]


def test_every_fault_a_card_can_name_is_flown_here() -> None:
    elsewhere = {"motor_cut", "telemetry_flood", "card_absent", "card_full", "card_unformatted"}
    assert {fault.kind for fault, _ in CASES} == set(FAULTS) - elsewhere
