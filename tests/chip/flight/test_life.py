"""In flight on the chip: the heartbeat's rests, the load that the log states, pressure's rate."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

import host

if TYPE_CHECKING:
    from flight.rig import FlightRig

MakeRig = Callable[..., "FlightRig"]
FLOWN_S = 14.0
STEADY_S = 8.0  # at the end, everything there again
LONGEST_REST_MS, LONG_REST_MS = 4.0, 2.5
LOOK_MS = 1.6  # a servo's frame is 20 ms, and stick to servo may take 22 ms


def test_flight_states_its_load_and_never_rests_long(make_rig: MakeRig, tmp_path: Path) -> None:
    """A GPS that comes back and is set up anew, a mark, the status line: all in one flight."""
    from flight.rig import take_log

    rig = make_rig(imu_hz=200.0)
    rig.chip.watch("PH5")
    rig.take_off()
    since = rig.chip.cycle
    rig.gps.silent = True
    rig.chip.run_s(4.0)
    rig.gps.silent, rig.gps.baud, rig.gps.enabled = False, 9600, set()
    rig.chip.drive("PG0", False)
    rig.chip.run_s(0.3)
    rig.chip.drive("PG0", None)
    rig.chip.run_s(FLOWN_S - 4.3 - STEADY_S)
    rig.chip.clear_statistics()
    rig.chip.run_s(STEADY_S)
    busy = rig.chip.load_now().busy_fraction
    assert rig.relay.engaged
    at, _ = rig.chip.edges("PH5")
    rests_ms = np.diff(at[at > since].astype(np.int64)) / 16e3
    assert len(rests_ms) > 5000
    assert rests_ms.max() <= LONGEST_REST_MS
    assert np.minimum(rests_ms[1:], rests_ms[:-1]).max() <= LONG_REST_MS
    rig.land()
    log = host.read_log(take_log(rig.card_image, tmp_path / "flight.bin"))
    # The seconds that lie whole in it.
    stated = log.frames["system"]["cpu_load"][1 - round(STEADY_S) :].astype(float) / 1000
    assert stated.mean() == pytest.approx(busy, abs=0.01)
    t_us = log.frames["baro"]["t_us"].astype(np.int64)
    assert len(t_us) > 250
    assert 1e6 / np.diff(t_us).mean() == pytest.approx(25.0, abs=0.2)


def looks_for_edges(elf: Path) -> list[int]:
    """Return where the main loop asks whether the receiver's interrupt has stored an edge."""
    listing = subprocess.run(
        ["avr-objdump", "-d", str(elf)], capture_output=True, text=True, check=True
    ).stdout
    found, inside = [], ""
    for line in listing.splitlines():
        if line.endswith(">:"):
            inside = line
        elif "<capture_tail>" in line and "\tlds\t" in line and "__vector" not in inside:
            found.append(int(line.split(":", 1)[0], 16))
    return found


def test_no_task_keeps_the_receiver_waiting(make_rig: MakeRig, flight_elf: Path) -> None:
    """From one look at the receiver to the next, the second's frame of health in between."""
    from simavr_bench import LogKind

    rig = make_rig(imu_hz=200.0)
    rig.take_off()
    for address in looks_for_edges(flight_elf):
        rig.chip.watch_pc(address)
    rig.chip.run_s(5.0)
    looks = rig.chip.records(LogKind.PC)["cycle"].astype(np.int64)
    assert len(looks) > 5000
    assert np.diff(looks).max() / 16e3 < LOOK_MS


def test_relay_whose_contact_opens_in_flight_is_released(flying: FlightRig, tmp_path: Path) -> None:
    """Open for 20 ms: no more edges, whatever the switch says, until its sequence comes again."""
    from simavr_bench import in_fork

    assert in_fork(partial(open_contact, flying, tmp_path)) == [1]


def open_contact(rig: FlightRig, folder: Path) -> list[int]:
    """Let the contact open in flight and close again; give what the log says of it."""
    from flight.rig import DIRECT_US, MEGA_US, take_log

    rig.chip.watch("PH5")
    assert rig.relay.engaged
    rig.chip.drive("PH6", True)  # its sense line, as if the contact opened
    opened = rig.chip.cycle
    rig.chip.run_s(1.0)
    at, _ = rig.chip.edges("PH5")
    last_ms = (int(at[-1]) - opened) / 16e3
    assert 18.0 < last_ms < 26.0
    assert not rig.relay.engaged
    rig.chip.drive("PH6", None)
    rig.chip.run_s(1.0)
    assert not rig.relay.engaged
    for switch_us in (DIRECT_US, MEGA_US):
        rig.receiver.width_us[4] = switch_us
        rig.chip.run_s(0.6)
    at, _ = rig.chip.edges("PH5")
    assert int(at[-1]) > rig.chip.cycle - 16_000_000 // 10  # it drives again
    rig.chip.power_off()
    card = rig.save_card(folder / "card.img")
    log = host.read_log(take_log(card, folder / "flight.bin"))
    events, lost = log.frames["event"], log.schema.number("event", "relay_lost")
    said: list[int] = events["arg"][events["code"] == lost].tolist()
    return said


@pytest.mark.parametrize("where", ["start", "reads", "first write"])
def test_heartbeat_does_not_rest_while_a_card_stalls_on_the_ground(
    flight_elf: Path, tmp_path: Path, where: str
) -> None:
    """Three seconds without an answer, the Mega driving: when it starts, reads, is written."""
    from flight.rig import MEGA_US, FlightRig, make_card

    rig = FlightRig(
        flight_elf,
        make_card(tmp_path / "card.img"),
        read_s=3.0 if where == "reads" else 0.0002,
        init_s=3.0 if where == "start" else 0.05,
        ground_s=30.0,
    )
    if where == "first write":
        rig.card.stall(3.0)
    rig.chip.watch("PH5")
    rig.power_on()
    rig.chip.run_s(0.4)
    rig.receiver.width_us[4] = MEGA_US
    rig.chip.run_s(12.6)
    assert rig.relay.engaged
    at, _ = rig.chip.edges("PH5")
    rests_ms = np.diff(at).astype(np.int64) / 16e3
    assert rig.beats().wrong() == []
    assert len(rests_ms) > 5000
    assert rests_ms.max() <= LONGEST_REST_MS
    assert np.minimum(rests_ms[1:], rests_ms[:-1]).max() <= LONG_REST_MS
    assert ("card ready" in rig.status_lines()[-1]) == (where == "first write")
    rig.land()
