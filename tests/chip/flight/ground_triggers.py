"""Triggers on the ground and in flight on the image itself: draws of `tests/sitl/ground_triggers`.

    python -m flight.ground_triggers --ground 4 --honest 3

Run in `tests/chip`, as `make ground-triggers` does. 6 if a row started on the ground, or an honest
trigger did not start its row.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from flight.images import build_image
from flight.input_rig import InputRig
from flight.rig import make_card
from host.wire.framing import EnvelopeReader
from host.wire.schema_text import packed_schema

from tests.sitl import flight_cards as cards
from tests.sitl.ground_triggers import (
    BEGIN_S,
    CYCLE_S,
    TRIGGERS,
    Session,
    Told,
    in_flight,
    on_the_ground,
    reasons,
    told_by,
)
from tests.sitl.input_judge import deflected

NEAR_TICKS = 8  # a width measured on the chip is 2.6 us off at most
RADIO = 3
# Wind and the static port, wind and the barometer, door and car, engine and hand.
GROUND = (10, 13, 38, 50)


def fly(session: Session, elf: Path, folder: Path, triggers: int = TRIGGERS) -> Told:
    """Fly the first triggers of a session on the simulated chip."""
    rig = InputRig(
        elf, make_card(folder / "card.img"), session.flight, cards.eeprom_with(session.card)
    )
    rig.run_to(BEGIN_S + triggers * CYCLE_S)
    event = packed_schema().by_name["event"]
    data = [d for d in EnvelopeReader().feed(rig.chip.uart_sent(RADIO)) if d[0] == event.id]
    rows = np.frombuffer(b"".join(data), event.dtype)
    moved = int(deflected(rig.pulses(), session.flight, 0.0, near=NEAR_TICKS).size)
    rig.chip.close()
    return told_by(rows, moved)


def main() -> int:
    """Fly, print a table, return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--ground", type=int, default=len(GROUND), metavar="SESSIONS")
    parser.add_argument("--honest", type=int, default=3, metavar="SESSIONS")
    parser.add_argument("--triggers", type=int, default=TRIGGERS, metavar="OF_A_SESSION")
    options = parser.parse_args()
    sessions = [(on_the_ground(n), False) for n in GROUND[: options.ground]]
    sessions += [(in_flight(n), True) for n in range(options.honest)]
    wrong = 0
    print("| on the chip | triggers | rows started | refused because of |")
    print("| --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for session, honest in sessions:
            told = fly(session, build_image("mega2560"), Path(folder), options.triggers)
            asked = told.started + sum(told.refused.values())
            wanted = options.triggers if honest else 0
            wrong += asked != options.triggers or told.started != wanted
            wrong += not honest and told.moved > 0
            where = "flight known by " if honest else "ground: "
            print(f"| {where}{session.name} | {asked} | {told.started} | {reasons(told.refused)} |")
    return 6 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
