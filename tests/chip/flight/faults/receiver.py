"""Faults of the receiver and of the radio, and of the supply."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from flight.faults.card import turns
from flight.faults.model import Check, Fault, Seen, change, expect
from flight.faults.program import came_back
from flight.rig import ANALOG_CHANNELS, FlightRig
from simavr_bench import Supply, XBee, cycles

CHANNELS = ("aileron", "elevator", "rudder", "throttle", "switch")
INVALID_MS, LOST_MS = 60, 100
BROWN_OUT_VOLT = 4.3  # extended fuse 0xFC, as hw/power.md asks for


def channel_lost(number: int) -> Check:
    """Make a check: that channel is invalid within 60 ms of its last pulse, no other ever."""

    def check(seen: Seen) -> Sequence[str]:
        rows = seen.during(late_s=0.0)
        last_us = max(end for c, _, end in seen.rig.receiver.sent if c == number and end < seen.end)
        dead = rows["t_us"] > last_us / 16 + INVALID_MS * 1000 + 20_000
        wrong = []
        for k, name in enumerate(CHANNELS):
            width = rows[f"rc_{name}"]
            if k == number:
                wrong += expect(np.all(width[dead] == 0), f"{name} is given without a pulse")
            else:
                wrong += expect(np.all(width > 0), f"{name} is missing")
        lost = seen.events_of("receiver_lost")
        bits = [event.arg for event in lost]
        return [*wrong, *expect(bits == [1 << number], f"reported as lost: {bits}")]

    return check


def all_lost(seen: Seen) -> Sequence[str]:
    """Reported within 100 ms, no pulse made up, none of 544 us."""
    last = max(end for _, _, end in seen.rig.receiver.sent if end < seen.begin + cycles(0.03))
    lost = seen.events_of("receiver_lost")
    late_ms = (lost[0].t_us - last / 16) / 1000 if lost else float("nan")
    rows = seen.during(late_s=0.12)
    servos = [rows[f"servo_{name}"] for name in CHANNELS[:4]]
    return [
        *expect(late_ms <= LOST_MS, f"reported after {late_ms:.0f} ms"),
        *expect(not np.any(np.stack(servos)), "pulses are sent without a receiver"),
    ]


def failsafe_is_known(seen: Seen) -> Sequence[str]:
    """The receiver's own failsafe is distinguished from a switch that was moved."""
    drives = [event.arg for event in seen.events_of("drive_changed")]
    return expect(drives[:1] == [3], f"drive states reported: {drives}")  # direct_receiver_lost


def glitches(rig: FlightRig) -> None:
    """Add short pulses to three channels, some inside, some outside the true ones."""
    rng = np.random.default_rng(3)
    for _ in range(60):
        at = rig.chip.cycle + int(rng.integers(round(3.0 * 16e6)))
        width_us = float(rng.uniform(50, 700))
        rig.receiver.glitch(int(rng.integers(3)), at_cycle=at, width_us=width_us)


def glitches_are_counted(seen: Seen) -> Sequence[str]:
    """Most are counted as rejected; every width in the log was on the line.

    A glitch that ends within a pulse leaves a shorter one that looks like any other.
    """
    wrong = []
    for name, (pin, _) in seen.rig.relay.servos.items():
        at, level = seen.rig.chip.edges(pin)
        rises, falls = (at[level == wanted].astype(np.int64) for wanted in (1, 0))
        falls = falls[falls > rises[0]]
        on_line = (falls - rises[: len(falls)]) / 8  # in steps of the log
        widths = np.unique(seen.ident[f"rc_{name}"])
        odd = [w / 2 for w in widths if w and np.abs(on_line - int(w)).min() > 8]
        wrong += expect(not odd, f"{name} of {odd[:3]} us was never on the line")
        wrong += expect(np.all((widths == 0) | (widths >= 1600)), "a width below 800 us")
    count = seen.count("rc_glitches")
    return [*wrong, *expect(count >= 20, f"{count} glitches counted of 60"), *turns(seen)]


def noise_is_rejected(seen: Seen) -> Sequence[str]:
    """Too slow for a storm: each of its pulses is refused, the channel is lost."""
    count = seen.count("rc_glitches")
    return [
        *expect([e.arg for e in seen.events_of("receiver_lost")] == [1], "not lost alone"),
        *expect(count >= 1000, f"{count} pulses refused of 5000"),
        *expect(not seen.events_of("reset"), "the chip was reset"),
    ]


def storm_is_bounded(seen: Seen) -> Sequence[str]:
    """Reported, masked: the main loop and everything else go on."""
    return [
        *expect(seen.events_of("receiver_storm"), "no event receiver_storm"),
        *expect(int(seen.system["cpu_load"].max()) < 700, "the storm took the chip"),
        *expect(not seen.events_of("reset"), "the chip was reset"),
    ]


def noise(rig: FlightRig, rate_hz: float) -> None:
    """Square noise on the aileron's line for half a second."""
    rig.receiver.noise(0, at_cycle=rig.chip.cycle, time_s=0.5, rate_hz=rate_hz)


# ---- supply -------------------------------------------------------------------------------------


def sag(rig: FlightRig, volt: float) -> None:
    """Let the rail come to a voltage, the ratiometric sensors with it."""
    rig.chip.analog_supply(volt)
    for slot, channel in enumerate(ANALOG_CHANNELS):
        rig.chip.analog(channel, (0.8 + 0.33 * slot) * volt / 5.0, noise_lsb=0.5)


def sag_is_logged(seen: Seen) -> Sequence[str]:
    """The rail is in the log, ratiometric values do not move, the self-test releases the relay."""
    avcc = seen.system["avcc_mv"]
    drives = [event.arg for event in seen.events_of("drive_changed")]
    wrong = []
    before = seen.ident[seen.ident["t_us"] < seen.begin // 16]
    for name in ("alpha_a", "beta_b", "dp_a", "pot_rudder"):
        moved = abs(float(seen.during()[name].mean()) - float(before[name].mean()))
        wrong += expect(moved <= 4, f"{name} moved by {moved:.1f} of 4096")
    return [
        *wrong,
        *expect(abs(int(avcc.min()) - 4400) < 60, f"lowest rail logged {avcc.min()} mV"),
        *expect(4 in drives, f"drive states reported: {drives}"),  # direct_self_test
    ]


def brown_out(rig: FlightRig) -> None:
    """Let the rail dip to 4.0 V for 100 ms: the detector holds the chip in reset meanwhile."""
    supply = Supply(rig.chip, brown_out_volt=BROWN_OUT_VOLT, volt=5.0)
    supply.set(4.0)
    rig.chip.run_s(0.1)
    supply.set(5.0)


# ---- radio --------------------------------------------------------------------------------------


def dead_radio(rig: FlightRig) -> None:
    """Let the radio take no byte off its buffer and say so at its CTS."""
    XBee(rig.chip, 3, air_bps=0.0).start()
    rig.chip.drive("PA0", True)


RECEIVER = (
    Fault("15", "rudder channel lost", "released, others untouched",
          lambda r: r.receiver.lost_channels.add(2), lambda r: r.receiver.lost_channels.clear(),
          events=("receiver_lost", "receiver_found"), engaged=False,
          servos=("aileron", "elevator", "throttle"), check=channel_lost(2)),
    Fault("16", "all channels lost", "released in 100 ms, no pulse",
          lambda r: change(r.receiver, lost=True), lambda r: change(r.receiver, lost=False),
          events=("receiver_lost", "receiver_found"), engaged=False, servos=(), check=all_lost),
    Fault("17", "failsafe pulses: switch 920 us", "known as such, released",
          lambda r: r.receiver.width_us.__setitem__(4, 920.0), events=("drive_changed",),
          engaged=False, check=failsafe_is_known),
    Fault("18", "60 glitches of 50 to 700 us", "counted, never repeated", glitches, engaged=None,
          servos=("throttle",), check=glitches_are_counted),
    Fault("18", "noise of 10 kHz on aileron", "refused, released, others driven",
          lambda r: noise(r, 10_000), engaged=False, servos=("elevator", "rudder", "throttle"),
          check=noise_is_rejected),
    Fault("18", "storm of 100 kHz on aileron", "masked, released",
          lambda r: noise(r, 100_000), engaged=False, servos=("elevator", "rudder", "throttle"),
          check=storm_is_bounded),
)  # fmt: skip

SUPPLY = (
    Fault("21", "supply sags to 4.4 V", "logged, values kept, released",
          lambda r: sag(r, 4.4), lambda r: sag(r, 5.0), events=("drive_changed",), engaged=False,
          fault_s=3.5, check=sag_is_logged),  # three measurements, one a second, whatever the phase
    Fault("21", "supply dips to 4.0 V for 100 ms", "brown-out reset, resumes in 2 s",
          brown_out, lossless=False, events=("reset",), engaged=False, resets=True,
          check=came_back("brown_out")),
)  # fmt: skip

RADIO = (
    Fault("25", "radio dead, CTS never true", "log untouched", dead_radio, check=turns),
    Fault("25", "radio port flooded", "log untouched",
          lambda r: r.chip.uart_send(3, bytes(15_000), baud=57_600), check=turns),
)  # fmt: skip
