"""The program that measures hostile files: it measures, or says that it could not."""

from pathlib import Path

import pytest

from tests.protocol import costs
from tests.protocol.flights import large_log


def test_a_log_and_a_file_of_rows_are_measured(tmp_path: Path) -> None:
    log, rows = tmp_path / "flight.bin", tmp_path / "rows.txt"
    large_log(log, 50 * 512)
    rows.write_bytes(costs.PRINTED_ROW * 20)
    for path, said in ((log, "complete"), (rows, "27 readings, 20 rows")):
        took_s, peak_bytes, end = costs.measured(path)
        assert took_s > 0.0
        assert peak_bytes > 1 << 20
        assert said in end


def test_a_reader_that_fails_is_no_cheap_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It took no time at all, and every hostile file passed against it."""
    monkeypatch.setattr(costs, "READ", "import host.no_such_module")
    with pytest.raises(SystemExit, match="was not measured: ModuleNotFoundError"):
        costs.measured(tmp_path / "flight.bin")
