"""Faults of IMU, static pressure, analogue sensors and GPS."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from devices.ardu_imu import ImuSample, MasterDeath
from flight.faults.card import turns
from flight.faults.model import Check, Fault, Seen, change, expect, valid_bit
from flight.rig import ANALOG_CHANNELS, FlightRig
from numpy.typing import NDArray
from simavr_bench.barometer import BMP085_CALIBRATION

FRESH, UNSATURATED, TRIGGERED = (
    valid_bit(name) for name in ("imu_fresh", "imu_unsaturated", "imu_triggered")
)
IMU_VALUES = ("p", "q", "r", "ax", "ay", "az", "phi", "theta", "psi")
VANES = ("alpha_a", "beta_a")
VANE_CHANNELS = (1, 2)
SLOTS = ("alpha_a", "alpha_b", "beta_a", "beta_b", "dp_a", "dp_b", "pot_elevator",
         "pot_aileron_left", "pot_aileron_right", "pot_rudder")  # fmt: skip
PITOTS = (3, 4)


# ---- IMU ----------------------------------------------------------------------------------------


def no_bad_sample(seen: Seen) -> list[str]:
    """Every fresh row of the log is a sample that the IMU sent, in all its values."""
    sent = {(s.sequence, s.sample.rates[1]): s.sample for s in seen.rig.imu.sent}
    wrong = 0
    for row in seen.ident[(seen.ident["valid"] & FRESH) != 0]:
        sample = sent.get((int(row["imu_seq"]), int(row["q"])))
        values = tuple(int(row[name]) for name in IMU_VALUES)
        wrong += sample is None or values != (
            *sample.rates, *sample.specific_force, *sample.angles_cdeg,
        )  # fmt: skip
    return expect(wrong == 0, f"{wrong} rows hold values that were never sent")


def each_once(seen: Seen) -> list[str]:
    """No sample stands in two fresh rows."""
    fresh = seen.ident[(seen.ident["valid"] & FRESH) != 0]
    twice = len(fresh) - len(np.unique(fresh[["imu_seq", "p", "q"]]))
    return expect(twice == 0, f"{twice} samples stand in the log twice")


def stale(seen: Seen) -> list[str]:
    """Rows go on at their rate with the last sample, marked stale within two periods."""
    rows = seen.during(late_s=0.0)
    step_us = np.diff(rows["t_us"].astype(np.int64))
    old = (rows["valid"] & FRESH) == 0
    first = int(np.argmax(old))
    return [
        *turns(seen),
        *no_bad_sample(seen),
        *each_once(seen),
        *expect(np.any(old) and np.all(old[first:-1]), "stale rows are marked fresh"),
        *expect(first <= 3, f"{first} rows until the first is stale"),
        *expect(step_us.max() <= 16_000, f"{step_us.max()} us between rows"),
        *expect(len(np.unique(rows["imu_seq"][first:])) == 1, "the sequence number moved"),
        *expect(not np.any(rows["valid"][first + 1 :] & TRIGGERED), "triggered by packets"),
    ]


def flips_are_counted(seen: Seen) -> Sequence[str]:
    """As many bad packets as were spoilt, as many lost."""
    spoilt = [s for s in seen.rig.imu.sent if s.spoilt and seen.begin < s.cycle < seen.end]
    bad, lost = seen.count("imu_bad_packets"), seen.count("imu_lost")
    return [
        *no_bad_sample(seen),
        *each_once(seen),
        *expect(bad == lost == len(spoilt) > 0, f"{len(spoilt)} spoilt, {bad} bad, {lost} lost"),
    ]


def repeats_are_dropped(seen: Seen) -> Sequence[str]:
    """Packets that come twice leave no trace."""
    twice = sum(len(s.packets) == 2 for s in seen.rig.imu.sent if s.cycle > seen.begin)
    return [
        *no_bad_sample(seen),
        *each_once(seen),
        *expect(twice >= 5, f"only {twice} packets were sent twice"),
        *expect(seen.count("imu_lost") == 0, f"{seen.count('imu_lost')} counted as lost"),
        *expect(seen.count("imu_bad_packets") == 0, "counted as bad"),
    ]


def numbers_are_counted(seen: Seen) -> Sequence[str]:
    """A number that comes again leaves out one: that one is missing, nothing else."""
    numbers = [s.sequence for s in seen.rig.imu.sent if s.cycle > seen.begin - 320_000]
    steps = [(b - a) & 0xFF for a, b in pairwise(numbers)]
    left_out = sum(step - 1 for step in steps if step > 1)
    lost = seen.count("imu_lost")
    return [
        *expect(left_out >= 5, f"only {left_out} numbers were left out"),
        *expect(lost == left_out, f"{left_out} numbers left out, {lost} counted"),
    ]


def slow_packets(seen: Seen) -> Sequence[str]:
    """At half the rate every second row is the timer's, and stale."""
    rows = seen.during(late_s=0.5)
    fresh = np.count_nonzero(rows["valid"] & FRESH)
    seconds = np.ptp(rows["t_us"].astype(np.int64)) / 1e6
    return [
        *no_bad_sample(seen),
        *each_once(seen),
        *expect(abs(fresh / seconds - 40) < 2, f"{fresh / seconds:.0f} fresh rows a second"),
        *expect(seen.count("imu_lost") == 0, f"{seen.count('imu_lost')} counted as lost"),
    ]


def restart_is_told(seen: Seen) -> Sequence[str]:
    """Reported once, its numbers are not a gap, values as sent: nothing is zeroed anew."""
    return [
        *no_bad_sample(seen),
        *expect(len(seen.events_of("imu_restarted")) == 1, "not reported once"),
        *expect(seen.count("imu_lost") == 0, f"{seen.count('imu_lost')} counted as lost"),
    ]


def saturation_is_marked(seen: Seen) -> Sequence[str]:
    """Exactly the rows with a value at the end of its range lack the bit."""
    full = seen.ident["p"] == 32767
    marked = (seen.ident["valid"] & UNSATURATED) == 0
    return [
        *no_bad_sample(seen),
        *expect(np.count_nonzero(full) > 100, f"{np.count_nonzero(full)} rows saturated"),
        *expect(np.array_equal(full, marked), "other rows are marked than are saturated"),
    ]


def pace(rig: FlightRig, rate_hz: float) -> None:
    """Let the IMU go on at another rate, its numbers in step."""
    rig.imu.rate_hz = rate_hz
    rig.imu.start(number=rig.imu.sent[-1].sequence + 1)


def saturate(rig: FlightRig) -> None:
    """Spin faster than the gyro can say, its flag set as the IMU's firmware does."""

    def spinning(time_s: float) -> ImuSample:
        sample = rig.source(time_s)
        return replace(sample, rates=(32767, *sample.rates[1:]))

    rig.imu.source = spinning
    rig.imu.flags |= 0x01


def unsaturate(rig: FlightRig) -> None:
    """Spin as before."""
    rig.imu.source = rig.source
    rig.imu.flags &= ~0x01


# ---- static pressure ----------------------------------------------------------------------------


def bad_words(rig: FlightRig, words: tuple[int, ...]) -> None:
    """Plug in a pressure sensor whose memory is blank."""
    rig.baro.present = False
    rig.baro.calibrate(words)
    rig.chip.run_s(0.2)
    rig.baro.present = True


def good_words(rig: FlightRig) -> None:
    """Plug in the right one again."""
    rig.baro.present = False
    rig.baro.calibrate(BMP085_CALIBRATION)
    rig.chip.run_s(0.2)
    rig.baro.present = True


def baro_invalid(seen: Seen) -> Sequence[str]:
    """Raw values go on, none of the compensated ones may be used."""
    rows = seen.log.frames["baro"]
    time_us = rows["t_us"].astype(np.int64)
    inside = rows[(time_us > seen.begin // 16 + 1_800_000) & (time_us < seen.end // 16 - 200_000)]
    return [
        *turns(seen),
        *expect(len(inside) > 10, f"{len(inside)} rows of raw pressure"),
        *expect(np.all(inside["static_pressure"] == 0), "compensated with what no chip has"),
        *expect(np.all(inside["temperature"] == -32768), "a temperature is given"),
    ]


def baro_kept(seen: Seen) -> Sequence[str]:
    """No value made up while it is away."""
    rows = seen.log.frames["baro"]["t_us"].astype(np.int64)
    inside = np.count_nonzero((rows > seen.begin // 16 + 100_000) & (rows < seen.end // 16))
    return [*turns(seen), *expect(inside == 0, f"{inside} rows while the sensor was away")]


# ---- analogue -----------------------------------------------------------------------------------


def put(rig: FlightRig, channels: Sequence[int], volt: float) -> None:
    """Put sensors at a voltage."""
    for channel in channels:
        rig.chip.analog(channel, volt)


def put_back(rig: FlightRig, channels: Sequence[int]) -> None:
    """As the rig wired them."""
    for channel in channels:
        slot = ANALOG_CHANNELS.index(channel)
        rig.chip.analog(channel, 0.8 + 0.33 * slot, noise_lsb=0.5)


def vanes_invalid(seen: Seen) -> Sequence[str]:
    """The two are marked, raw and at the rail; no other channel is touched."""
    rows = seen.during()
    bits = [valid_bit(name) for name in SLOTS]
    wrong = []
    for name, bit in zip(SLOTS, bits, strict=True):
        valid = (rows["valid"] & bit) != 0
        if name in VANES:
            rail = np.all((rows[name] <= 2) | (rows[name] >= 4090))
            wrong += expect(not np.any(valid), f"{name} is marked valid")
            wrong += expect(rail, f"{name} is not at its rail")
        else:
            wrong += expect(np.all(valid), f"{name} is marked invalid")
    return wrong


def pitots_logged(volt: float) -> Check:
    """Make a check that both pitots stand in the log as they are, signed and not clipped."""

    def check(seen: Seen) -> Sequence[str]:
        rows = seen.during()
        wanted = volt / 5.0 * 1024 * 4
        worst = max(float(np.abs(rows[name] - wanted).max()) for name in ("dp_a", "dp_b"))
        bits = valid_bit("dp_a") | valid_bit("dp_b")
        return [
            *expect(worst <= 8, f"{worst:.0f} of 4096 off"),
            *expect(np.all((rows["valid"] & bits) == bits), "marked invalid"),
        ]

    return check


# ---- GPS ----------------------------------------------------------------------------------------


def gps_rows(seen: Seen) -> NDArray[np.void]:
    """Rows of the GPS while the fault lasts."""
    rows = seen.log.frames["gps"]
    time_us = rows["t_us"].astype(np.int64)
    inside: NDArray[np.void] = rows[
        (time_us > seen.begin // 16 + 250_000) & (time_us < seen.end // 16)
    ]
    return inside


def positions_refused(seen: Seen) -> Sequence[str]:
    """No place on earth: marked invalid, the rest of the row goes on."""
    rows = gps_rows(seen)
    return [
        *turns(seen),
        *expect(len(rows) >= 12, f"{len(rows)} rows"),
        *expect(np.all(rows["latitude"] == -(2**31)), "a latitude of 100 deg is given"),
        *expect(np.all(rows["longitude"] == -(2**31)), "a longitude of 200 deg is given"),
        *expect(np.all(np.diff(rows["itow_ms"].astype(np.int64)) == 200), "time of week jumps"),
    ]


def no_fix_no_place(seen: Seen) -> Sequence[str]:
    """Without a fix no position."""
    rows = gps_rows(seen)
    return [
        *expect(len(rows) >= 12 and np.all(rows["fix"] == 0), "a fix is claimed"),
        *expect(np.all(rows["latitude"] == -(2**31)), "a position without a fix"),
    ]


def week_turns(seen: Seen) -> Sequence[str]:
    """The time of week starts over; nothing else does."""
    rows = gps_rows(seen)
    itow = rows["itow_ms"].astype(np.int64)
    steps = np.diff(itow) % 604_800_000
    table = seen.log.table()
    return [
        *expect(np.count_nonzero(np.diff(itow) < 0) == 1, "the time of week did not start over"),
        *expect(np.all(steps == 200), f"steps of {np.unique(steps)} ms"),
        *expect(np.all(np.diff(table["t_s"]) > 0), "the table's time does not rise"),
        *expect(not seen.events_of("gps_lost"), "reported as lost"),
    ]


def errors_counted(seen: Seen) -> Sequence[str]:
    """Garbage makes no row."""
    wrong = []
    for row in gps_rows(seen):
        wrong += expect(row["latitude"] in (250_500_000, -(2**31)), "a row was made of garbage")
    return [*turns(seen), *wrong[:1]]


def power_cycle_gps(rig: FlightRig) -> None:
    """It comes back as delivered: 9600 baud, NMEA, once a second."""
    change(rig.gps, baud=9600, nmea=True, period_ms=1000)
    rig.gps.enabled.clear()


IMU = (
    Fault("7", "IMU dies, lets lines go", "stale, timer triggers",
          lambda r: r.imu.die(MasterDeath.LETS_GO, after_bytes=10), lambda r: r.imu.revive(),
          events=("imu_lost", "imu_found"), check=stale),
    Fault("7", "IMU dies holding SDA", "stale, timer triggers",
          lambda r: r.imu.die(MasterDeath.HOLDS_SDA, after_bytes=10), lambda r: r.imu.revive(),
          events=("imu_lost", "imu_found"), check=stale),
    Fault("7", "IMU dies holding SCL", "stale, timer triggers",
          lambda r: r.imu.die(MasterDeath.HOLDS_SCL, after_bytes=10), lambda r: r.imu.revive(),
          events=("imu_lost", "imu_found"), check=stale),
    Fault("10", "IMU silent", "stale, timer triggers",
          lambda r: change(r.imu, silent=True), lambda r: change(r.imu, silent=False),
          events=("imu_lost", "imu_found"), check=stale),
    Fault("11", "1 % of IMU packets spoilt", "dropped, counted, none in log",
          lambda r: change(r.imu, flip_fraction=0.01, short_fraction=0.01),
          lambda r: change(r.imu, flip_fraction=0.0, short_fraction=0.0),
          check=flips_are_counted),
    Fault("12", "5 % of IMU packets twice", "each once in the log",
          lambda r: change(r.imu, twice_fraction=0.05),
          lambda r: change(r.imu, twice_fraction=0.0), check=repeats_are_dropped),
    Fault("12", "5 % of IMU numbers twice", "gaps counted exactly",
          lambda r: change(r.imu, repeat_fraction=0.05),
          lambda r: change(r.imu, repeat_fraction=0.0), check=numbers_are_counted),
    Fault("12", "IMU slow: 40 Hz", "fresh rows marked",
          lambda r: pace(r, 40.0), lambda r: pace(r, 100.0), check=slow_packets),
    Fault("13", "IMU reset in flight", "reported, not zeroed anew", lambda r: r.imu.restart(0.3),
          check=restart_is_told),
    Fault("14", "gyro saturated", "marked row by row", saturate, unsaturate,
          check=saturation_is_marked),
)  # fmt: skip

BARO = (
    Fault("7", "pressure bus SDA low", "lost and found, loop unmoved",
          lambda r: r.baro.hold(sda=True, scl=False), lambda r: r.baro.hold(sda=False, scl=False),
          events=("baro_lost", "baro_found"), check=baro_kept),
    Fault("7", "pressure bus SCL low", "lost and found, loop unmoved",
          lambda r: r.baro.hold(sda=False, scl=True), lambda r: r.baro.hold(sda=False, scl=False),
          events=("baro_lost", "baro_found"), check=baro_kept),
    Fault("8", "pressure sensor silent", "lost and found",
          lambda r: change(r.baro, present=False), lambda r: change(r.baro, present=True),
          events=("baro_lost", "baro_found"), check=baro_kept),
    Fault("9", "pressure words 0xFFFF", "rejected, raw kept",
          lambda r: bad_words(r, (-1, -1, -1, 0xFFFF, 0xFFFF, 0xFFFF, -1, -1, -1, -1, -1)),
          good_words, events=("baro_lost", "baro_found"), check=baro_invalid),
    Fault("9", "pressure words 0", "rejected, raw kept", lambda r: bad_words(r, (0,) * 11),
          good_words, events=("baro_lost", "baro_found"), check=baro_invalid),
    Fault("9", "pressure stuck at 0", "rejected, raw kept",
          lambda r: change(r.baro, raw_pressure=0, raw_temperature=0),
          lambda r: change(r.baro, raw_pressure=23843 << 3, raw_temperature=27898),
          check=baro_invalid),
)  # fmt: skip

ANALOG = (
    Fault("19", "two vanes at 0 V", "marked invalid, raw kept",
          lambda r: put(r, VANE_CHANNELS, 0.0), lambda r: put_back(r, VANE_CHANNELS),
          check=vanes_invalid),
    Fault("19", "two vanes at 5 V", "marked invalid, raw kept",
          lambda r: put(r, VANE_CHANNELS, 5.0), lambda r: put_back(r, VANE_CHANNELS),
          check=vanes_invalid),
    Fault("20", "pitot ports swapped", "negative pressure as it is",
          lambda r: put(r, PITOTS, 1.9), lambda r: put_back(r, PITOTS), check=pitots_logged(1.9)),
    Fault("20", "pitots blocked", "constant, as it is",
          lambda r: put(r, PITOTS, 2.5), lambda r: put_back(r, PITOTS), check=pitots_logged(2.5)),
)  # fmt: skip

GPS = (
    Fault("24", "GPS silent", "lost and found", lambda r: change(r.gps, silent=True),
          lambda r: change(r.gps, silent=False), events=("gps_lost", "gps_found")),
    Fault("24", "GPS sends garbage", "resynchronised", lambda r: change(r.gps, garbage=True),
          lambda r: change(r.gps, garbage=False), check=errors_counted),
    Fault("24", "GPS at 100 deg N, 200 deg E", "no position, no stall",
          lambda r: change(r.gps, latitude_1e7=1_000_000_000, longitude_1e7=2_000_000_000),
          lambda r: change(r.gps, latitude_1e7=250_500_000, longitude_1e7=1_215_000_000),
          check=positions_refused),
    Fault("24", "GPS loses its fix", "no position",
          lambda r: change(r.gps, fix=0), lambda r: change(r.gps, fix=3), check=no_fix_no_place),
    Fault("24", "GPS week ends", "time goes on",
          lambda r: change(r.gps, itow_ms=604_799_000 // 200 * 200), check=week_turns),
    Fault("24", "GPS back at 9600 baud, NMEA", "found again", power_cycle_gps,
          events=("gps_lost", "gps_found"), after_s=6.0),
)  # fmt: skip
