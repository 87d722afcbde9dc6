"""Inject faults between the IMU and the Mega, both their own images, and print what came of each.

    make faults                          runs this behind the Mega's table
    cd tests/chip && PYTHONPATH=../simulator ../../.venv/bin/python -m imu.faults --only bus

Simulation only. Every fault starts from the same state, in flight with the Mega driving at 200 Hz,
lasts 3 s and is followed for 3 s.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from flight.images import build_image
from flight.rig import check_card, make_card, take_log
from flight.servos import LONGEST_GAP_MS, worst_gap_ms
from host.log import read_log  # here: each child of in_fork would load it anew
from host.wire.schema_text import packed_schema
from imu.motion import fly, swaying
from imu.record import ImuRecord, read_record
from imu.rig import PairRig
from imu.truth import match
from numpy.typing import NDArray
from simavr_bench import MpuFault, ResetCause, in_fork

CLOCK_PPM, MPU_PPM = 3000.0, -8000.0
RATE_HZ = 200 * (1 + CLOCK_PPM * 1e-6) * (1 + MPU_PPM * 1e-6)
FAULT_S = 3.0
AFTER_S = 3.0
EVENT_NAMES = {
    packed_schema().number("event", word): word
    for word in ("imu_lost", "imu_found", "imu_restarted", "reset")
}
# Behind the parking attitude and the last zeroing: what a reset in flight must not touch.
RECORD = ImuRecord(rate_offset=(40, -30, 20), force_offset=(150, -90, 60), offsets_valid=1)
FRESH, UNSATURATED, ATTITUDE = (
    packed_schema().bit("valid", word) for word in ("imu_fresh", "imu_unsaturated", "attitude")
)
IMU_WATCHDOG = 6
LOAD_LIMIT = 0.60  # of the IMU's cycles, whatever happens
SPCR = 0x4C


@dataclass(slots=True)
class Outcome:
    """What a fault did.

    Attributes
    ----------
    gap_ms : float
        Longest time a servo saw no pulse.
    lost : int
        Frames of the log.
    engaged : bool
        The Mega drives at the end.
    events : Counter
        From the fault on, by name.
    heard : float
        Samples in the log during the fault, as a part of those due.
    saturated, levelled : float
        Part of these marked saturated, and with a valid attitude.
    recovered_ms : float
        From the end of the fault to the next sample in the log.
    after : float
        Samples in the log in the last two seconds, as a part of those due.
    foreign : int
        Samples in the log whose values the sensor did not make at that instant.
    imu_resets : int
        Watchdog of the IMU.
    offsets_kept : bool
        The IMU's record is as before.
    imu_load : float
        Part of the IMU's cycles during the fault.
    """

    gap_ms: float
    lost: int
    engaged: bool
    events: Counter[str]
    heard: float
    saturated: float
    levelled: float
    recovered_ms: float
    after: float
    foreign: int
    imu_resets: int
    offsets_kept: bool
    imu_load: float


@dataclass(frozen=True, slots=True)
class Fault:
    """One row: what is done, undone after FAULT_S, and what must come of it on both sides.

    Attributes
    ----------
    injected, imu, mega : str
        In words: the fault, and what either side does.
    begin, end : callable
        Do and undo it.
    events : tuple of str
        Events the log must hold; of the IMU's, it may hold no others.
    heard : tuple of float
        Least and largest part of the samples in the log meanwhile.
    recovered_ms : float
        At most.
    after_s : float
        Flown on behind it.
    lossless, engaged : bool
        Whether the Mega loses no frame, and whether it is engaged.
    saturated, levelled : tuple of float
        Least and largest part of the samples marked so.
    imu_resets : tuple of int
        Fewest and most resets by the IMU's watchdog.
    """

    injected: str
    imu: str
    mega: str
    begin: Callable[[PairRig], object]
    end: Callable[[PairRig], object] = lambda rig: None
    events: tuple[str, ...] = ()
    heard: tuple[float, float] = (1.0, 1.0)
    recovered_ms: float = 50.0
    after_s: float = AFTER_S
    lossless: bool = True
    engaged: bool = True
    saturated: tuple[float, float] = (0.0, 0.0)
    levelled: tuple[float, float] = (0.0, 1.0)
    imu_resets: tuple[int, int] = (0, 0)


def saturate(rig: PairRig) -> None:
    """Roll at 700 deg/s in pulls of 6 g."""
    at_s, rates, force = swaying(FAULT_S + AFTER_S + 1)
    rates[at_s < FAULT_S, 0] = np.deg2rad(700)
    force[at_s < FAULT_S, 2] = -6 * 9.81
    rig.board.mpu.motion(at_s, rates, force)


def reset_imu(rig: PairRig) -> None:
    """Pull the reset of the IMU in a steady turn, in which nothing may be zeroed."""
    rig.board.chip.reset(ResetCause.EXTERNAL)


def hang_imu(rig: PairRig) -> None:
    """Let the IMU's program stand still for a while: its watchdog starts it again."""
    from simavr_bench import Image

    chip = rig.board.chip
    address, size = chip.symbols["_ZN3hal13poll_transferEv"]
    code = chip.flash(address, size)
    chip.load(Image({address: b"\xff\xcf"}))  # rjmp to itself
    rig.mega.run_s(0.6)  # the watchdog, after 0.5 s, meets the same jump
    chip.load(Image({address: code}))


def hold_mega(rig: PairRig) -> None:
    """Hold the Mega in reset."""
    rig.mega.hold_reset(ResetCause.BROWN_OUT)


LOST = ("imu_lost", "imu_found")
NONE = (0.0, 0.0)
FAULTS = (
    Fault("none", "sends every sample", "logs every sample", lambda r: None, levelled=(1.0, 1.0)),
    Fault("IMU reset", "back in 0.5 s, offsets from EEPROM", "lost, found, restarted",
          reset_imu, events=(*LOST, "imu_restarted"), heard=(0.8, 0.9)),
    Fault("IMU program hangs", "watchdog, back in 1.3 s", "lost, found, restarted",
          hang_imu, events=(*LOST, "imu_restarted"), heard=(0.55, 0.75),
          imu_resets=(1, 2)),
    Fault("MPU off, as without power", "sets it up again and again", "lost, timer triggers, found",
          lambda r: r.board.mpu.fail(MpuFault.SILENT),
          lambda r: r.board.mpu.fail(MpuFault.NONE), events=LOST, heard=NONE, recovered_ms=900),
    Fault("MPU makes no samples", "sets it up again and again", "lost, timer triggers, found",
          lambda r: r.board.mpu.fail(MpuFault.CLOCK_STOPPED),
          lambda r: r.board.mpu.fail(MpuFault.NONE), events=LOST, heard=NONE, recovered_ms=900),
    Fault("MPU resets by itself", "sets it up again", "lost and found",
          lambda r: r.board.mpu.reset(), events=LOST, heard=(0.75, 0.96)),
    Fault("SPI off in its register", "sets it up again", "loses a sample or two",
          lambda r: r.board.chip.poke(SPCR, b"\0"), heard=(0.95, 1.0)),
    Fault("MPU stuck", "sends 20, then none", "lost, timer triggers, found",
          lambda r: r.board.mpu.fail(MpuFault.STUCK),
          lambda r: r.board.mpu.fail(MpuFault.NONE), events=LOST, heard=(0.0, 0.04),
          recovered_ms=900),
    Fault("MPU sends garbage", "refuses the chip", "lost, timer triggers, found",
          lambda r: r.board.mpu.fail(MpuFault.GARBAGE),
          lambda r: r.board.mpu.fail(MpuFault.NONE), events=LOST, heard=(0.0, 0.05),
          recovered_ms=900),
    Fault("700 deg/s and 6 g", "flags every sample, no attitude", "marks them, loses none",
          saturate, saturated=(0.97, 1.0), levelled=(0.0, 0.05)),
    Fault("bus: SDA low", "lets go, tries each sample", "lost, timer triggers, found",
          lambda r: r.board.bus.hold(sda_low=True), lambda r: r.board.bus.hold(),
          events=LOST, heard=NONE),
    Fault("bus: SCL low", "lets go, tries each sample", "lost, timer triggers, found",
          lambda r: r.board.bus.hold(scl_low=True), lambda r: r.board.bus.hold(),
          events=LOST, heard=NONE),
    Fault("bus: SDA high", "nobody answers, tries each sample", "lost, timer triggers, found",
          lambda r: r.board.bus.hold(sda_high=True), lambda r: r.board.bus.hold(),
          events=LOST, heard=NONE),
    Fault("bus: SCL high", "lets go, tries each sample", "lost, timer triggers, found",
          lambda r: r.board.bus.hold(scl_high=True), lambda r: r.board.bus.hold(),
          events=LOST, heard=NONE),
    Fault("bus: a slave hangs, 5 clocks", "clocks it free", "misses a sample or two",
          lambda r: r.board.bus.hang(5), heard=(0.99, 1.0)),
    Fault("magnetometer silent", "sends on, heading by gyro", "loses no sample",
          lambda r: r.board.magnetometer.fail(absent=True),
          lambda r: r.board.magnetometer.fail()),
    Fault("Mega absent (in reset)", "tries each sample", "resumes, receiver drives",
          hold_mega, lambda r: r.mega.release_reset(ResetCause.BROWN_OUT),
          events=("reset", "imu_found"), heard=NONE, recovered_ms=4000, after_s=6.0, lossless=False,
          engaged=False),
    Fault("Mega slow: 20 us a byte", "sends every sample", "loses none",
          lambda r: r.board.bus.stretch(20e-6), lambda r: r.board.bus.stretch(0.0),
          heard=(0.98, 1.0)),
    Fault("Mega slow: 90 us a byte", "sends every sample, in 4.2 ms", "loses none",
          lambda r: r.board.bus.stretch(90e-6), lambda r: r.board.bus.stretch(0.0),
          heard=(0.98, 1.0)),
    Fault("Mega slow: 110 us a byte", "lets go after 4.5 ms", "lost, timer triggers, found",
          lambda r: r.board.bus.stretch(110e-6), lambda r: r.board.bus.stretch(0.0),
          events=LOST, heard=(0.0, 0.05)),
    Fault("Mega slow: 2 ms a byte", "lets go, tries each sample", "lost, timer triggers, found",
          lambda r: r.board.bus.stretch(2e-3), lambda r: r.board.bus.stretch(0.0),
          events=LOST, heard=NONE),
)  # fmt: skip


def ready_rig(mega_elf: Path, imu_elf: Path, folder: Path) -> PairRig:
    """Bring both images into flight, the card in private pages, the IMU with offsets."""
    card = make_card(folder / "empty.img")
    rig = PairRig(
        mega_elf,
        imu_elf,
        card,
        clock_ppm=CLOCK_PPM,
        mpu_ppm=MPU_PPM,
        bootloader=True,
        in_place=False,
    )
    rig.board.chip.load(RECORD.image())
    rig.take_off()
    fly(rig.board.mpu, rig.board.magnetometer, 30.0)
    rig.mega.run_s(2.0)
    return rig


def part(rows: NDArray[np.bool_]) -> float:
    """Give the part of the rows that are true; of none, none."""
    return float(np.mean(rows)) if len(rows) else 0.0


def run_fault(rig: PairRig, fault: Fault, folder: Path) -> Outcome:
    """Fly on from the state of the rig with a fault; only in a child of in_fork."""
    chip = rig.board.chip
    since = rig.mega.cycle
    chip.clear_statistics()
    fault.begin(rig)
    rig.mega.run_until(since + round(FAULT_S * 16e6))
    until = rig.mega.cycle
    load = chip.load_now().busy_fraction
    fault.end(rig)
    rig.mega.run_s(fault.after_s)
    done = rig.mega.cycle
    samples, samples_us = rig.board.mpu.samples(), rig.samples_us()
    gap_ms = worst_gap_ms(rig.flight, since)
    engaged = rig.flight.relay.engaged
    resets = chip.interrupt(IMU_WATCHDOG).count
    kept = read_record(chip) == RECORD
    rig.mega.power_off()
    card = rig.flight.save_card(folder / "card.img")
    check_card(card)
    log = read_log(take_log(card, folder / "flight.bin"))
    start_us, end_us, done_us = ((at - rig.mega_zero_cycle) / 16 for at in (since, until, done))
    ident = log.frames["ident"]
    reset = "reset" in fault.events
    ident_us = ident["t_us"].astype(np.float64)
    if reset:  # the second session counts its time from its own boot
        new = np.flatnonzero(np.diff(ident_us) < 0)
        ident_us[new[0] + 1 if len(new) else len(ident_us) :] += end_us
    fresh = (ident["valid"] & FRESH) != 0
    meanwhile = fresh & (ident_us > start_us + 20_000) & (ident_us < end_us)
    late = fresh & (ident_us > done_us - 2_000_000)
    due = RATE_HZ * (end_us - start_us - 20_000) / 1e6
    due_late = RATE_HZ * 1.7  # the last frames are cut off with the power
    again = ident_us[fresh & (ident_us > end_us)]
    judged = fresh & (ident_us < (end_us if reset else done_us))
    shifted = ident[judged].copy()
    for name, offset in zip(("p", "q", "r"), RECORD.rate_offset, strict=True):
        shifted[name] += offset
    for name, offset in zip(("ax", "ay", "az"), RECORD.force_offset, strict=True):
        shifted[name] += offset
    unsaturated = (shifted["valid"] & UNSATURATED) != 0
    found = match(shifted[unsaturated], samples, samples_us, doubled=False)
    names = [
        EVENT_NAMES[int(row["code"])]
        for row in log.frames["event"]
        if int(row["code"]) in EVENT_NAMES and (reset or row["t_us"] > start_us)
    ]
    return Outcome(
        gap_ms=gap_ms,
        lost=int(log.loss.frames or 0),
        engaged=engaged,
        events=Counter(names),
        heard=float(np.sum(meanwhile)) / due,
        saturated=part((ident["valid"][meanwhile] & UNSATURATED) == 0),
        levelled=part((ident["valid"][meanwhile] & ATTITUDE) != 0),
        recovered_ms=float(again[0] - end_us) / 1000 if len(again) else float("inf"),
        after=float(np.sum(late)) / due_late,
        foreign=found.foreign,
        imu_resets=resets,
        offsets_kept=kept,
        imu_load=load,
    )


def verdict(fault: Fault, seen: Outcome) -> list[str]:
    """Say what is not as it must be."""
    wrong = []
    missing = [name for name in fault.events if not seen.events[name]]
    if missing:
        wrong.append("no event " + ", ".join(missing))
    if "imu_restarted" not in fault.events and seen.events["imu_restarted"]:
        wrong.append("the IMU restarted")
    slack = 0.01
    for name, value, (low, high) in (
        ("samples heard", seen.heard, fault.heard),
        ("marked saturated", seen.saturated, fault.saturated),
        ("with attitude", seen.levelled, fault.levelled),
    ):
        if not low - slack <= value <= high + slack:
            wrong.append(f"{name} {value:.2f}")
    if not seen.recovered_ms <= fault.recovered_ms:
        wrong.append(f"back after {seen.recovered_ms:.0f} ms")
    if seen.after < 0.99:
        wrong.append(f"afterwards {seen.after:.2f} of the samples")
    if seen.foreign:
        wrong.append(f"{seen.foreign} samples that were none")
    if fault.lossless and seen.lost:
        wrong.append(f"{seen.lost} frames lost")
    if not seen.gap_ms <= LONGEST_GAP_MS:
        wrong.append(f"gap of {seen.gap_ms:.0f} ms")
    if seen.engaged != fault.engaged:
        wrong.append("Mega drives" if seen.engaged else "receiver drives")
    low_resets, high_resets = fault.imu_resets
    if not low_resets <= seen.imu_resets <= high_resets:
        wrong.append(f"{seen.imu_resets} watchdog resets of the IMU")
    if seen.imu_load > LOAD_LIMIT:
        wrong.append(f"the IMU's load {100 * seen.imu_load:.0f} %")
    if not seen.offsets_kept:
        wrong.append("offsets changed")
    return wrong


def main() -> int:
    """Print the table; 0 if every row is as expected, else 6."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--only", help="faults whose text holds this")
    options = parser.parse_args()
    mega_elf, imu_elf = build_image("mega2560"), build_image("arduimu")
    bad = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rig = ready_rig(mega_elf, imu_elf, folder)
        print(f"{'injected':28} {'the IMU':34} {'the Mega':28} {'heard':>6} {'back':>7}  seen")
        for fault in FAULTS:
            if options.only and options.only not in fault.injected:
                continue
            seen = in_fork(partial(run_fault, rig, fault, folder))
            wrong = verdict(fault, seen)
            bad += len(wrong)
            said = "; ".join(wrong) if wrong else "as expected, recovered"
            print(
                f"{fault.injected:28} {fault.imu:34} {fault.mega:28} {seen.heard:6.2f} "
                f"{seen.recovered_ms:4.0f} ms  {said}",
                flush=True,
            )
        rig.close()
    return 6 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
