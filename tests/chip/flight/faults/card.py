"""Faults of the card and of the supply that feeds it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from flight.faults.model import Fault, Seen, expect
from flight.rig import FlightRig
from numpy.typing import NDArray
from simavr_bench import LogKind, SdCard

RADIO_PORT, BUZZER = 3, "PH4"
LONGEST_TURN_US = 2500  # of the main loop, as without a fault


def turns(seen: Seen) -> list[str]:
    """Main loop not held up."""
    longest = int(seen.system["loop_max_us"].max())
    return expect(longest <= LONGEST_TURN_US, f"a turn of the main loop took {longest} us")


def stall_is_told(seen: Seen) -> Sequence[str]:
    """The event and the health frame give the length of the stall."""
    told = [event.arg for event in seen.events_of("card_stall")]
    busiest = int(seen.system["card_busy_max_ms"].max())
    return [
        *turns(seen),
        *expect(len(told) == 1 and abs(told[0] - busiest) <= 10, f"stalls reported: {told} ms"),
        *expect(busiest >= 495, f"longest busy time logged {busiest} ms"),
    ]


def drops_are_counted(seen: Seen) -> Sequence[str]:
    """Events, health frame, block header and the frames themselves agree on what was dropped."""
    told = sum(event.arg for event in seen.events_of("frames_dropped"))
    counted = int(seen.system["frames_dropped"][-1])
    count: NDArray[np.int64] = seen.ident["count"].astype(np.int64)
    gaps = (count[1:] - count[:-1]) % 65536 - 1
    missing = int(gaps.sum())
    return [
        *turns(seen),
        *expect(told == counted == seen.log.loss.dropped_frames, f"{told} said, {counted} counted"),
        *expect(0 < missing == seen.log.loss.frames, f"{missing} identification frames missing"),
        *expect(np.count_nonzero(gaps) == 1, "dropped in several pieces, not the newest in one"),
    ]


def removal_is_told(seen: Seen) -> Sequence[str]:
    """Within a second, by an event that stands in the next session."""
    told = seen.events_of("card_removed")
    late_s = (told[0].t_us - seen.begin / 16) / 1e6 if told else float("nan")
    return [
        *turns(seen),
        *expect(late_s < 1.0, f"reported {late_s:.2f} s after the removal"),
        *expect(not seen.events_of("reset"), "the chip was reset"),
        *expect(len(seen.rig.started) == 1, "the chip started anew"),
    ]


def remove_for_good(rig: FlightRig) -> None:
    """Pull the card out and listen to the buzzer."""
    rig.chip.watch(BUZZER)
    rig.card.remove()


def alarms_without_a_card(seen: Seen) -> Sequence[str]:
    """Seven beeps on the panel; telemetry goes on."""
    at, level = seen.rig.chip.edges(BUZZER)
    beeps = int(np.count_nonzero(level[at > seen.begin + 16_000_000] == 1))
    sent = seen.rig.chip.records(LogKind.UART_TX, RADIO_PORT)["cycle"]
    bytes_late = int(np.count_nonzero(sent > seen.begin + 16_000_000))
    return [
        *expect(beeps >= 5, f"{beeps} beeps within five seconds"),
        *expect(bytes_late > 5000, f"the radio sent {bytes_late} bytes"),
    ]


def nothing_skipped(seen: Seen) -> Sequence[str]:
    """Sent again, so no hole in the file."""
    return [
        *expect(not seen.events_of("block_skipped"), "a block was skipped"),
        *expect(seen.count("card_errors") == 1, f"{seen.count('card_errors')} errors counted"),
    ]


def one_skipped(seen: Seen) -> Sequence[str]:
    """The hole in the file is named, its content stands one place further."""
    told = [event.arg for event in seen.events_of("block_skipped")]
    causes = [loss.cause for loss in seen.log.loss.losses]
    return [
        *expect(len(told) == 1, f"blocks named as skipped: {told}"),
        *expect(seen.count("card_errors") == 2, f"{seen.count('card_errors')} errors counted"),
        *expect(not seen.log.loss.dropped_frames, f"frames dropped; losses {causes}"),
    ]


def stopped_and_resumed(seen: Seen) -> Sequence[str]:
    """Recording stopped with an alarm and went on in the same file behind what was there."""
    return [
        *expect(seen.events_of("card_error"), "no event card_error"),
        *expect(len(seen.log.sessions) == 2, f"{len(seen.log.sessions)} sessions"),
    ]


def hold_line_between_blocks(rig: FlightRig) -> None:
    """Hold the card's line low once it has programmed a block and was seen to rest."""
    for busy in (True, False):
        while rig.card.busy is not busy:
            rig.chip.run_s(0.0005)
    rig.chip.run_s(0.01)
    rig.card.hold_line(True)


CARD = (
    Fault("1", "card busy 500 ms", "nothing lost, stall logged", lambda r: r.card.stall(0.5),
          events=("card_stall",), check=stall_is_told),
    Fault("2", "card busy 1.2 s", "newest dropped, counted exactly", lambda r: r.card.stall(1.2),
          events=("card_stall", "frames_dropped"), lossless=False, check=drops_are_counted),
    Fault("2", "card busy 4 s", "stops with alarm, resumes", lambda r: r.card.stall(4.0),
          lossless=False, check=stopped_and_resumed, fault_s=4.0, after_s=5.0),
    Fault("2", "card's line low for 4 s", "stops with alarm, resumes",
          hold_line_between_blocks, lambda r: r.card.hold_line(False), lossless=False,
          check=stopped_and_resumed, fault_s=4.0, after_s=5.0),
    Fault("3", "card pulled, put back", "reported in 1 s, resumes", lambda r: r.card.remove(),
          lambda r: r.card.insert(), events=("card_removed",), lossless=False, after_s=4.0,
          check=removal_is_told),
    Fault("3", "card pulled for good", "alarm, telemetry goes on", remove_for_good,
          lossless=False, recovers=False, check=alarms_without_a_card),
    Fault("4", "block refused once (CRC)", "sent again", lambda r: r.card.reject(1),
          check=nothing_skipped),
    Fault("4", "block refused once (write error)", "sent again",
          lambda r: r.card.reject(1, token=SdCard.WRITE_ERROR), check=nothing_skipped),
    Fault("4", "block refused twice", "skipped and named, none lost", lambda r: r.card.reject(2),
          events=("block_skipped",), check=one_skipped),
    Fault("4", "every block refused for 3 s", "stops with alarm, resumes",
          lambda r: r.card.reject(1_000_000), lambda r: r.card.reject(0), lossless=False,
          check=stopped_and_resumed, after_s=5.0),
)  # fmt: skip
