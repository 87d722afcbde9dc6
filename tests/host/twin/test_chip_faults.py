"""Faults of a card in the chip simulator: the same story as on this computer."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from host.errors import UsageError
from host.log import read_log
from host.twin.flight.fly import fly
from host.twin.outcome import compare
from host.twin.recorder import avr, sitl
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard import cards
from host.wire.schema_text import packed_schema

CARD = {
    "format": 1,
    "aircraft": "ultrastick25e",
    "flight": {"ground_s": 4.0},
    "segment": [{"kind": "trim", "duration_s": 9.5}],
    "fault": [
        {"kind": "baro_bus_stuck", "at_s": 5.0, "duration_s": 1.0},
        {"kind": "imu_reset", "at_s": 5.5},
        {"kind": "supply_sag", "at_s": 7.0, "duration_s": 1.2},
        {"kind": "gps_garbage", "at_s": 8.0, "duration_s": 2.0},
        {"kind": "receiver_storm", "at_s": 8.5, "duration_s": 0.3},
        {"kind": "vane_open", "at_s": 9.0, "duration_s": 0.5},
        {"kind": "card_reject", "at_s": 9.5, "value": 2},
        {"kind": "telemetry_flood", "at_s": 9.8, "duration_s": 1.0},
        {"kind": "brown_out", "at_s": 11.0},
    ],
}
NUMBERS = packed_schema().enums
TIMES = {"block_skipped": 1, "imu_restarted": 1, "baro_lost": 1, "receiver_lost": 1, "reset": 2}
CODES = {NUMBERS["event"][name]: times for name, times in TIMES.items()}
DRIVE = NUMBERS["event"]["drive_changed"]
DIRECT, RECEIVER_LOST = (
    NUMBERS["drive"][name] for name in ("direct_switch", "direct_receiver_lost")
)
# The guard against edge storms is in the Mega's interrupt: SITL has none.
STORM = NUMBERS["event"]["receiver_storm"]


def test_faults_tell_the_same_story_on_the_chip(library: Path, image: Path, tmp_path: Path) -> None:
    assert library.is_file()
    assert image == avr.ELF
    card = cards.parse(CARD, "broken")
    record = fly(card, seed=5)
    given = stimuli(record, air_data(record))
    told = []
    quiet = tuple(fault for fault in card.faults if fault.kind != "telemetry_flood")
    with pytest.raises(UsageError, match="telemetry_flood: here an interrupt takes no time"):
        sitl.record(given, rate_hz=100, aircraft="x", faults=card.faults)
    for recorder, faults in ((sitl.record, quiet), (avr.record, card.faults)):
        recording = recorder(given, rate_hz=100, aircraft="x", faults=faults)
        path = tmp_path / "flight.bin"
        path.write_bytes(recording.log)
        log = read_log(path)
        # The chip's clock begins with its program, the library's with the power.
        late_s = compare.clock_began_s(record, given.imu, log.frames["ident"])
        assert abs(late_s) < 1e-4 if recorder is sitl.record else 1e-3 < late_s < 0.02
        assert [session.number for session in log.sessions] == [
            1,
            2,
            3,
        ]  # the first prepared the file, at an earlier power-on
        event, system, ident = (log.frames[name] for name in ("event", "system", "ident"))
        told.append(Counter(code for code in event["code"].tolist() if code not in (STORM, DRIVE)))
        # The relay's own story begins with the supply, which only the chip measures at its boot.
        drives = event["arg"][(event["code"] == DRIVE) & (event["t_us"] > 8_000_000)]
        assert drives.tolist() == [RECEIVER_LOST, DIRECT]
        assert int(system["avcc_mv"][system["avcc_mv"] > 0].min()) == 4400
        assert int(system["gps_errors"].max()) > 3
        assert int((ident["valid"] & 1 == 0).sum()) == pytest.approx(50, abs=3)
    assert told[0] == told[1]
    assert CODES.items() <= told[0].items()


def test_a_fault_the_chip_cannot_have_is_named() -> None:
    card = cards.parse({**CARD, "fault": [{"kind": "clock_wrap", "at_s": 6.0}]}, "wrap")
    record = fly(card, seed=5)
    with pytest.raises(UsageError, match="clock_wrap: the chip's clock starts at 0"):
        avr.record(stimuli(record, air_data(record)), rate_hz=100, aircraft="x", faults=card.faults)
