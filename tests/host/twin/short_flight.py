"""Short flights through the recorder with one fault each, and their logs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from host.log import FlightLog, read_log
from host.twin.faults import FAULTS, Fault
from host.twin.flight.fly import FlightRecord, fly
from host.twin.recorder import sitl
from host.twin.recorder.stimuli import Stimuli, stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard import cards
from host.twin.testcard.cards import Card
from host.wire.schema_text import packed_schema
from numpy.typing import NDArray

CARD = {
    "format": 1,
    "aircraft": "ultrastick25e",
    "flight": {"ground_s": 4.0},
    "sensors": {"clock_error": False},
    "air": {"turbulence_mps": 0.5},
    "segment": [{"kind": "trim", "duration_s": 8.0}],
}
AT_S, FOR_S = 6.0, 2.0
EVENTS = packed_schema().enums["event"]


@dataclass
class Flown:
    """One short flight with its log."""

    card: Card
    record: FlightRecord
    given: Stimuli
    recording: sitl.Recording
    path: Path

    def __post_init__(self) -> None:
        self.path.write_bytes(self.recording.log)
        self.log: FlightLog = read_log(self.path)
        self.ident = self.log.frames["ident"]
        self.system = self.log.frames["system"]
        self.at_s = self.ident["t_us"] * 1e-6
        self.during = (self.at_s > AT_S + 0.2) & (self.at_s < AT_S + FOR_S - 0.1)
        self.after = self.at_s > AT_S + FOR_S + 0.3

    def told(self, name: str) -> list[int]:
        """Arguments of every event of a name, in order."""
        event = self.log.frames["event"]
        return [int(arg) for arg in event["arg"][event["code"] == EVENTS[name]]]

    def started(self) -> list[str]:
        """Why each session began, in the log's words."""
        return [self.log.schema.word("start_cause", arg) for arg in self.told("session_start")]

    def ended(self) -> list[str]:
        """Why each session ended, in the log's words."""
        return [self.log.schema.word("end_cause", arg) for arg in self.told("session_end")]

    def valid(self, bit: int, where: NDArray[np.bool_]) -> set[int]:
        """Values a bit of `valid` takes."""
        return set((self.ident["valid"][where] & bit > 0).astype(int).tolist())

    def count(self, name: str) -> int:
        """A counter at the end."""
        return int(self.system[name][-1])

    def gaps(self) -> int:
        """Identification frames missing by their counter."""
        steps = np.diff(self.ident["count"].astype(np.int64)).tolist()
        return sum((step - 1) % 65536 for step in steps)


def fly_with(folder: Path, *faults: Fault) -> Flown:
    card = replace(cards.parse(CARD, "short"), faults=faults)
    record = fly(card, seed=2)
    given = stimuli(record, air_data(record))
    recording = sitl.record(given, rate_hz=100, aircraft="x", faults=faults)
    return Flown(card, record, given, recording, folder / "flight.bin")


def make(kind: str, value: float | None = None, channel: str = "") -> Fault:
    about = FAULTS[kind]
    if about.from_start:
        return Fault(kind, 0.0, value=value)
    if about.lasts:
        return Fault(kind, AT_S, FOR_S, value, channel)
    return Fault(kind, AT_S, value=value, channel=channel)
