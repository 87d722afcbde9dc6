"""Inject the faults an aircraft may meet into the flight image and print what came of each.

    make faults                     the table
    make faults FAULTS="--only IMU" rows whose text holds this

Simulation only. Every fault starts from the same state, in flight with the Mega driving; the log is
decoded and the file system checked afterwards.
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
from flight.rig import FlightRig, build_flight_image, check_card, make_card, take_log
from flight.servos import LONGEST_GAP_MS, worst_gap_ms
from simavr_bench import ResetCause, in_fork
from simavr_bench.imu import MasterDeath

EVENT_NAMES = {
    3: "frames_dropped",
    4: "block_skipped",
    5: "card_stall",
    6: "card_error",
    7: "card_removed",
    8: "imu_lost",
    9: "imu_found",
    11: "baro_lost",
    12: "baro_found",
    13: "gps_lost",
    14: "gps_found",
    15: "receiver_lost",
    16: "receiver_found",
    17: "drive_changed",
    18: "reset",
    20: "crash",
    26: "receiver_storm",
}
FAULT_S = 3.0
AFTER_S = 3.0


@dataclass(frozen=True, slots=True)
class Fault:
    """One row: what is done, undone after FAULT_S, and what must come of it.

    Attributes
    ----------
    number : str
        Of hardware.md section 5, as the reliability practice it is taken from counts.
    injected, expected : str
        In words.
    begin, end : callable
        Do and undo it.
    events : tuple of str
        Events the log must hold, from the fault on.
    lossless : bool
        Whether no frame may be lost.
    engaged : bool or None
        Whether the Mega still drives at the end; None: either.
    servos : tuple of str
        Servos that must see pulses all the time.
    """

    number: str
    injected: str
    expected: str
    begin: Callable[[FlightRig], object]
    end: Callable[[FlightRig], object] = lambda rig: None
    events: tuple[str, ...] = ()
    lossless: bool = True
    engaged: bool | None = True
    servos: tuple[str, ...] = ("aileron", "elevator", "rudder", "throttle")


@dataclass(slots=True)
class Outcome:
    """What a fault did."""

    gap_ms: float
    lost: int
    recovered: bool
    engaged: bool
    events: Counter[str]


def change(device: object, **values: object) -> None:
    """Set attributes of a device model."""
    for name, value in values.items():
        setattr(device, name, value)


def stop_master(rig: FlightRig, how: MasterDeath) -> None:
    """Let the IMU die in the middle of a packet."""
    rig.imu.die(how, after_bytes=10)


def glitches(rig: FlightRig) -> None:
    """Add short pulses to three channels, some inside, some beside the true ones."""
    rng = np.random.default_rng(3)
    for _ in range(60):
        at = rig.chip.cycle + int(rng.integers(round(FAULT_S * 16e6)))
        width_us = float(rng.uniform(50, 700))
        rig.receiver.glitch(int(rng.integers(3)), at_cycle=at, width_us=width_us)


def open_sensors(rig: FlightRig, volt: float) -> None:
    """Put two vanes at a rail."""
    rig.chip.analog(1, volt)
    rig.chip.analog(2, volt)


def brown_out(rig: FlightRig) -> None:
    """Hold the chip in reset for 100 ms, as its brown-out detector does."""
    rig.chip.hold_reset(ResetCause.BROWN_OUT)
    rig.chip.run_s(0.1)
    rig.chip.release_reset(ResetCause.BROWN_OUT)


def bad_words(rig: FlightRig) -> None:
    """Plug in a pressure sensor whose memory is blank."""
    rig.baro.present = False
    rig.baro.calibrate((-1, -1, -1, 0xFFFF, 0xFFFF, 0xFFFF, -1, -1, -1, -1, -1))
    rig.chip.run_s(0.2)
    rig.baro.present = True


# BMP085 datasheet, figure 3.
GOOD_WORDS = (408, -72, -14383, 32741, 32757, 23153, 6190, 4, -32768, -8711, 2868)
NO_GAP: tuple[str, ...] = ()

FAULTS = (
    Fault("-", "none", "nothing lost", lambda r: None),
    Fault("1", "card busy 500 ms", "nothing lost", lambda r: r.card.stall(0.5),
          events=("card_stall",)),
    Fault("2", "card busy 1.2 s", "newest dropped and counted", lambda r: r.card.stall(1.2),
          events=("card_stall", "frames_dropped"), lossless=False),
    Fault("3", "card pulled, put back", "servos unaffected, resumes", lambda r: r.card.remove(),
          lambda r: r.card.insert(), events=("card_removed",), lossless=False),
    Fault("4", "block refused once", "sent again", lambda r: r.card.reject(1)),
    Fault("4", "block refused twice", "skipped, none lost", lambda r: r.card.reject(2),
          events=("block_skipped",)),
    Fault("7", "pressure bus SDA low", "baro lost and found",
          lambda r: r.baro.hold(sda=True, scl=False), lambda r: r.baro.hold(sda=False, scl=False),
          events=("baro_lost", "baro_found")),
    Fault("8", "pressure sensor silent", "baro lost and found",
          lambda r: change(r.baro, present=False), lambda r: change(r.baro, present=True),
          events=("baro_lost", "baro_found")),
    Fault("9", "pressure words 0xFFFF", "rejected, raw kept",
          bad_words, lambda r: r.baro.calibrate(GOOD_WORDS), events=("baro_lost", "baro_found")),
    Fault("10", "IMU silent", "lost and found, timer triggers",
          lambda r: change(r.imu, silent=True), lambda r: change(r.imu, silent=False),
          events=("imu_lost", "imu_found")),
    Fault("7", "IMU dies holding SDA", "lost and found",
          lambda r: stop_master(r, MasterDeath.HOLDS_SDA), lambda r: r.imu.revive(),
          events=("imu_lost", "imu_found")),
    Fault("7", "IMU dies holding SCL", "lost and found",
          lambda r: stop_master(r, MasterDeath.HOLDS_SCL), lambda r: r.imu.revive(),
          events=("imu_lost", "imu_found")),
    Fault("11", "1 % of IMU bytes wrong", "dropped and counted",
          lambda r: change(r.imu, flip_fraction=0.01, short_fraction=0.01),
          lambda r: change(r.imu, flip_fraction=0.0, short_fraction=0.0)),
    Fault("12", "5 % of IMU packets twice", "each once in the log",
          lambda r: change(r.imu, repeat_fraction=0.05),
          lambda r: change(r.imu, repeat_fraction=0.0)),
    Fault("15", "rudder channel lost", "released, receiver drives",
          lambda r: r.receiver.lost_channels.add(2), lambda r: r.receiver.lost_channels.clear(),
          events=("receiver_lost", "receiver_found"), engaged=False,
          servos=("aileron", "elevator", "throttle")),
    Fault("16", "all channels lost", "released", lambda r: change(r.receiver, lost=True),
          lambda r: change(r.receiver, lost=False),
          events=("receiver_lost", "receiver_found"), engaged=False, servos=NO_GAP),
    Fault("17", "failsafe pulses: switch 920 us", "released, receiver drives",
          lambda r: r.receiver.width_us.__setitem__(4, 920.0), events=("drive_changed",),
          engaged=False),
    Fault("18", "glitches of 50 to 700 us", "never repeated", glitches, engaged=None,
          servos=("throttle",)),
    Fault("18", "storm of 10 kHz on aileron", "masked, others driven",
          lambda r: r.receiver.noise(0, at_cycle=r.chip.cycle, time_s=0.5, rate_hz=10_000),
          engaged=False, servos=("elevator", "rudder", "throttle")),
    Fault("19", "two vanes at 0 V", "marked invalid, raw kept", lambda r: open_sensors(r, 0.0),
          lambda r: open_sensors(r, 2.0)),
    Fault("21", "supply sags to 4.4 V", "released by the self-test",
          lambda r: r.chip.analog_supply(4.4), lambda r: r.chip.analog_supply(5.0),
          events=("drive_changed",), engaged=False),
    Fault("22", "watchdog reset", "resumes within 2 s, receiver drives",
          lambda r: r.chip.reset(ResetCause.WATCHDOG), lossless=False, events=("reset",),
          engaged=False),
    Fault("22", "brown-out 100 ms", "resumes within 2 s, receiver drives",
          brown_out,
          lossless=False, events=("reset",), engaged=False),
    Fault("24", "GPS silent", "lost and found", lambda r: change(r.gps, silent=True),
          lambda r: change(r.gps, silent=False), events=("gps_lost", "gps_found")),
    Fault("24", "GPS sends garbage", "resynchronised", lambda r: change(r.gps, garbage=True),
          lambda r: change(r.gps, garbage=False)),
    Fault("25", "radio port flooded", "nothing lost",
          lambda r: r.chip.uart_send(3, bytes(15_000), baud=57_600)),
)  # fmt: skip


def read_flight(card: Path, folder: Path) -> tuple[list[str], int]:
    """Check the card and decode its log: events by name, frames lost."""
    import host

    check_card(card)
    log = host.read_log(take_log(card, folder / "flight.bin"))
    events = [EVENT_NAMES.get(int(code), str(int(code))) for code in log.frames["event"]["code"]]
    return events, int(log.loss.frames or 0)


def run_fault(rig: FlightRig, fault: Fault, folder: Path) -> Outcome:
    """Fly on from the state of the rig with a fault; only in a child of in_fork."""
    since = rig.chip.cycle
    written = rig.card.count().written
    fault.begin(rig)
    rig.chip.run_s(FAULT_S)
    fault.end(rig)
    rig.chip.run_s(AFTER_S)
    before = rig.card.count().written
    rig.chip.run_s(1.0)
    recovered = rig.card.count().written - before >= 12 and before > written
    gap_ms = worst_gap_ms(rig, since, servos=fault.servos) if fault.servos else float("nan")
    engaged = rig.relay.engaged
    rig.chip.power_off()
    events, lost = read_flight(rig.save_card(folder / "card.img"), folder)
    return Outcome(gap_ms, lost, recovered, engaged, Counter(events))


def verdict(fault: Fault, seen: Outcome, calm: Outcome) -> list[str]:
    """Say what is not as it must be; `calm` is the same flight without a fault."""
    wrong = []
    missing = [name for name in fault.events if seen.events[name] <= calm.events[name]]
    if missing:
        wrong.append("no event " + ", ".join(missing))
    if fault.lossless and seen.lost:
        wrong.append(f"{seen.lost} frames lost")
    if not seen.recovered:
        wrong.append("not recording afterwards")
    if fault.servos and not seen.gap_ms <= LONGEST_GAP_MS:
        wrong.append(f"gap of {seen.gap_ms:.0f} ms")
    if fault.engaged is not None and seen.engaged != fault.engaged:
        wrong.append("Mega drives" if seen.engaged else "receiver drives")
    return wrong


def ready_rig(elf: Path, folder: Path) -> FlightRig:
    """Bring a rig into flight, its card in private pages."""
    rig = FlightRig(elf, make_card(folder / "empty.img"), in_place=False)
    rig.take_off()
    rig.chip.run_s(2.0)
    return rig


def main() -> int:
    """Print the table; 0 if every row is as expected, else 6."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--only", help="faults whose text holds this")
    options = parser.parse_args()
    elf = build_flight_image()
    bad = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rig = ready_rig(elf, folder)
        print(f"{'#':3} {'injected':32} {'expected':38} {'gap':>7} {'lost':>5}  seen")
        calm = in_fork(lambda: run_fault(rig, FAULTS[0], folder))
        for fault in FAULTS:
            if options.only and options.only not in fault.injected:
                continue
            seen = in_fork(partial(run_fault, rig, fault, folder))
            wrong = verdict(fault, seen, calm)
            bad += len(wrong)
            said = "; ".join(wrong) if wrong else "as expected, recovered"
            gap = f"{seen.gap_ms:.0f} ms" if fault.servos else "-"
            print(
                f"{fault.number:3} {fault.injected:32} {fault.expected:38} {gap:>7} "
                f"{seen.lost:5}  {said}",
                flush=True,
            )
    return 6 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
