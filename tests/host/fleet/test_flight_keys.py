"""What a flight's answer depends on: each change of it is a new task, anything else is not."""

from pathlib import Path

import pytest
from host.fleet.fleet_error import FleetError
from host.fleet.sources.fleet_table import TableRow
from host.fleet.sources.flight_keys import FleetSources


def key(log: Path, **more: object) -> str:
    sources = FleetSources([str(log)], "ultrastick25e", **more)  # type: ignore[arg-type]
    (task,) = sources.tasks()
    return task.key


def test_a_key_is_of_log_aircraft_calibration_and_settings(tmp_path: Path) -> None:
    log = tmp_path / "N0" / "a.bin"
    log.parent.mkdir()
    log.write_bytes(b"one")
    first = key(log)
    assert key(log) == first
    assert key(log, accept=("clock",)) != first
    assert key(log, table=[TableRow(source=str(log), aircraft="N1")]) != first
    assert key(log, table=[TableRow(source=str(log), date="2026-11-23")]) != first
    log.write_bytes(b"two")
    assert key(log) != first


@pytest.mark.parametrize("name", ["longitudinal", "lateral"])
def test_a_linear_model_is_refused_with_the_reason(tmp_path: Path, name: str) -> None:
    log = tmp_path / "a.bin"
    log.write_bytes(b"one")
    with pytest.raises(FleetError, match=f"--model {name} is linear: its A and B are those of one"):
        key(log, models=(name,))
