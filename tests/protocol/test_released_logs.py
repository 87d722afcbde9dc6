"""Logs of released formats decode for ever, to every value written with them."""

from pathlib import Path

import numpy as np
import pytest
from host.log import read_log

from tests.campaign import every_nth
from tests.protocol.agreement import check_oracle
from tests.protocol.damage import DAMAGES
from tests.protocol.expected_text import text_of_host, text_of_oracle
from tests.protocol.log_writer import ROOT
from tests.protocol.oracle import decode

LOGS = sorted((ROOT / "tests/data").glob("format-*.bin"))


def test_each_released_format_is_there() -> None:
    assert {path.name.split("-")[1] for path in LOGS} == {"1"}


@pytest.mark.parametrize("path", LOGS, ids=lambda path: path.stem)
def test_host_reads_what_was_recorded(path: Path) -> None:
    expected = path.with_suffix(".txt").read_text(encoding="ascii")
    assert text_of_host(read_log(path)) == expected


@pytest.mark.parametrize("path", LOGS, ids=lambda path: path.stem)
def test_independent_decoder_reads_what_was_recorded(path: Path) -> None:
    # Without a schema from elsewhere: the log must stand for itself.
    read = decode(path.read_bytes())
    assert read is not None
    order = [
        line.split(":")[0]
        for line in path.with_suffix(".txt").read_text(encoding="ascii").splitlines()
        if line.endswith(" frames")
    ]
    assert text_of_oracle(read, order) == path.with_suffix(".txt").read_text(encoding="ascii")


@pytest.mark.parametrize("path", LOGS, ids=lambda path: path.stem)
def test_table_of_a_released_log(path: Path) -> None:
    log = read_log(path)
    table = log.table()
    assert len(table) == len(log.frames["ident"])
    assert table["t_s"].is_monotonic_increasing
    # A power-on that only prepared the file recorded nothing into it.
    recorded = {session.number for session in log.sessions if session.rows}
    assert set(table["session"]) == recorded
    assert recorded <= set(log.selection.sessions)


@pytest.mark.parametrize("seed", every_nth(range(2), 2))
@pytest.mark.parametrize("name", DAMAGES)
@pytest.mark.parametrize("path", LOGS, ids=lambda path: path.stem)
def test_damaged_released_log_reads_alike(path: Path, name: str, seed: int) -> None:
    check_oracle(DAMAGES[name](path.read_bytes(), np.random.default_rng(seed)))
