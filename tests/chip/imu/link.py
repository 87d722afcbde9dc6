"""A flight of both images on one bus, and what it gave."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from flight.rig import GROUND_S, check_card, take_log
from imu.motion import fly
from imu.rig import PairRig
from imu.truth import Match, match
from simavr_bench.log import LogKind, TwiNote


@dataclass(frozen=True, slots=True)
class Link:
    """What a flight of both images gave.

    Attributes
    ----------
    match : Match
        Log against truth.
    lost_frames : int
        Frames that the log lacks.
    imu_load, mega_load : float
        Part of the cycles not asleep.
    stack_room, stack_untouched : int
        Bytes, of the IMU.
    transfers, refused : int
        On the bus.
    imu_lost, imu_bad : int
        As the Mega counted.
    field_frames : int
        Magnetometer frames in the log.
    faults : int
        Accesses outside the models.
    """

    match: Match
    lost_frames: int
    imu_load: float
    mega_load: float
    stack_room: int
    stack_untouched: int
    transfers: int
    refused: int
    imu_lost: int
    imu_bad: int
    field_frames: int
    faults: int


def run_link(rig: PairRig, time_s: float, folder: Path, *, doubled: bool = False) -> Link:
    """Take off, sway for a time, cut the power, compare.

    Parameters
    ----------
    rig : PairRig
        Without power.
    time_s : float
        After take-off.
    folder : Path
        For the log; the card is the rig's.
    doubled : bool
        See :func:`imu.truth.match`.
    """
    import host

    board = rig.board
    # On the ground first: a file is made there and nowhere else.
    fly(board.mpu, board.magnetometer, time_s + 20.0, rest_s=GROUND_S)
    rig.take_off()
    board.chip.clear_statistics()
    rig.mega.clear_statistics()
    rig.mega.run_s(time_s)
    loads = board.chip.load_now().busy_fraction, rig.mega.load_now().busy_fraction
    samples, samples_us = board.mpu.samples(), rig.samples_us()
    notes = board.chip.records(LogKind.TWI)["source"]
    faults = len(board.chip.faults()) + len(rig.mega.faults())
    stack = board.stack_room, board.stack_untouched()
    rig.mega.power_off()
    check_card(rig.flight.card_image)
    log = host.read_log(take_log(rig.flight.card_image, folder / "imu.bin"))
    system = log.frames["system"]
    return Link(
        match=match(log.frames["ident"], samples, samples_us, doubled=doubled),
        lost_frames=int(log.loss.frames or 0),
        imu_load=loads[0],
        mega_load=loads[1],
        stack_room=stack[0],
        stack_untouched=stack[1],
        transfers=int(np.sum(notes == TwiNote.DONE)),
        refused=int(np.sum(notes == TwiNote.REFUSED)),
        imu_lost=int(system["imu_lost"][-1]) - int(system["imu_lost"][0]),
        imu_bad=int(system["imu_bad_packets"][-1]),
        field_frames=len(log.frames["mag"]),
        faults=faults,
    )
