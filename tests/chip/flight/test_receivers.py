"""A row of a card with each of the bench's eight receivers: flown, and given up in time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest
from flight.bench.plan import RECEIVERS, ReceiverKind
from flight.flown_row import FlownRow, deflected, first_plain, input_rig
from flight.rig import FlightRig
from flight.servos import SERVOS, cuts_allowed, spoiled
from simavr_bench.fork import in_fork

from tests.sitl.input_flight import ELEVATOR, MEGA_US, SWITCH, THROTTLE

InRow = tuple[FlightRig, FlownRow]
PLAIN_S = 0.025  # from what the firmware can know to the first plain pulse
ACCEPTED_S = 0.0003  # the low behind a pulse that makes it count
FRAMES_AT_REST = 1.5
FLOWN_S = 0.4


@pytest.fixture(scope="module")
def in_row(
    request: pytest.FixtureRequest, flight_elf: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[InRow]:
    """A rig in the middle of a row with one receiver: for children made by in_fork only."""
    kind: ReceiverKind = request.param
    rig, _, row = input_rig(
        flight_elf, tmp_path_factory.mktemp("row"), threshold_volt=0.8,
        frame_s=kind.true_frame_s, sequential=kind.sequential,
    )  # fmt: skip
    yield rig, row
    rig.chip.close()


def stick(rig: FlightRig) -> None:
    rig.receiver.width_us[ELEVATOR] -= 60.0


def throttle(rig: FlightRig) -> None:
    rig.receiver.width_us[THROTTLE] += 60.0


def switch(rig: FlightRig) -> None:
    rig.receiver.width_us[SWITCH] = MEGA_US


def silence(rig: FlightRig) -> None:
    rig.receiver.lost = True


def nothing(rig: FlightRig) -> None:
    """Flown on."""


CHANNEL: dict[Callable[[FlightRig], None], int] = {
    stick: ELEVATOR,
    throttle: THROTTLE,
    switch: SWITCH,
}


def known(rig: FlightRig, fault: Callable[[FlightRig], None], begin: int) -> float:
    """Cycle from which the firmware can know it."""
    if fault is silence:
        last = {channel: start for channel, start, _ in rig.receiver.sent}
        return min(last.values()) + 16e6 * FRAMES_AT_REST * rig.receiver.frame_s
    channel = CHANNEL[fault]
    width = 16.0 * rig.receiver.width_us[channel]
    ends = (end for sent, start, end in rig.receiver.sent
            if sent == channel and end >= begin and abs(end - start - width) < 80)  # fmt: skip
    return next(ends) + 16e6 * ACCEPTED_S


FAULTS = (nothing, stick, throttle, switch, silence)
EXTREMES = (RECEIVERS[0], RECEIVERS[-1])  # the fastest in turn, the slowest all at once


# Two lists, one inside the other: a rig is kept for the faults of its receiver.
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.__name__)
@pytest.mark.parametrize(
    "in_row",
    [
        pytest.param(kind, id=kind.name, marks=() if kind in EXTREMES else pytest.mark.campaign)
        for kind in RECEIVERS
    ],
    indirect=True,
)
def test_a_row_with_each_receiver(in_row: InRow, fault: Callable[[FlightRig], None]) -> None:
    """Whole frames apart, so that a change is not cut in two by one."""
    rig, row = in_row

    def fly() -> tuple[list[str], float, float]:
        frame_end = max(end for _, _, end in rig.receiver.sent)
        while max(end for _, _, end in rig.receiver.sent) == frame_end:
            rig.chip.run_s(0.001)
        begin = rig.chip.cycle
        fault(rig)
        rig.chip.run_s(FLOWN_S)
        wrong = [
            f"{count} pulses at {servo} are nobody's"
            for channel, servo in enumerate(SERVOS)
            if (count := spoiled(rig, row.start, servo, partial(row.made, channel)))
            > cuts_allowed(rig, row.start)
        ]
        starts = deflected(rig, row)
        late_s = 0.0
        if fault is not nothing:
            late_s = (first_plain(rig, row) - known(rig, fault, begin)) / 16e6
        return wrong, late_s, (starts.max() - begin) / 16e6

    wrong, late_s, last_s = in_fork(fly)
    assert wrong == []
    if fault is nothing:
        assert last_s > FLOWN_S - 0.06  # a sum of sines passes through nought
    else:
        print(f"first plain pulse begins {1e3 * late_s:.1f} ms behind what can be known")
        assert late_s <= PLAIN_S
