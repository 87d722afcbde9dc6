"""Logs in a store like S3: found by pattern and folder, read, and known when they change."""

from pathlib import Path

import pytest
from host.fleet.fleet_error import FleetError
from host.fleet.sources.flight_files import flight_files, log_id
from host.fleet.sources.object_store import arrow_s3
from host.fleet.tasks.flight_identification import _local
from host.fleet.tasks.task_cluster import check_readable, unreadable


def put(address: str, data: bytes) -> str:
    """Write an object."""
    with arrow_s3().open_output_stream(address.removeprefix("s3://")) as stream:
        stream.write(data)
    return address


@pytest.fixture
def logs(store: str) -> list[str]:
    names = ("2026/N0/a.bin", "2026/N0/note.txt", "2026/N1/b.bin", "2025/N1/old.bin")
    return [put(f"{store}/{name}", name.encode()) for name in names]


def test_addresses_are_found_by_folder_and_by_pattern(store: str, logs: list[str]) -> None:
    assert flight_files(f"{store}/2026") == [logs[0], logs[2]]
    assert flight_files(f"{store}/2026/*/*.bin") == [logs[0], logs[2]]
    assert flight_files(f"{store}/**/old.bin") == [logs[3]]
    assert flight_files(logs[0]) == [logs[0]]
    for empty in (f"{store}/1999", f"{store}-of-others/2026"):
        with pytest.raises(FleetError, match=r"no logs .* there"):
            flight_files(empty)


def test_a_log_is_read_whole_and_known_again_until_it_changes(logs: list[str]) -> None:
    with _local(logs[0]) as path:
        assert path.read_bytes() == b"2026/N0/a.bin"
        assert path.suffix == ".bin"
    assert not Path(path).exists()
    first = log_id(logs[0], {})
    assert log_id(logs[0], {}) == first
    put(logs[0], b"another flight of another length")
    assert log_id(logs[0], {}) != first


def test_a_worker_says_what_it_cannot_read(logs: list[str], tmp_path: Path) -> None:
    assert unreadable([logs[0]]) == ""
    for missing in (f"{logs[0]}.gone", str(tmp_path / "gone.bin")):
        with pytest.raises(FleetError, match=r"worker w cannot read .*gone.*same names"):
            check_readable({"w": unreadable([logs[0], missing])})
