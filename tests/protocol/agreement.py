"""Does the host decoder say what must be said? Shared by the tests and the fuzz target."""

import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from host.errors import NotALogError
from host.log import FlightLog, read_log

from tests.protocol import oracle
from tests.protocol.damage import expected, surviving
from tests.protocol.log_writer import LogWriter, released_texts

TELLING = frozenset({"complete", "truncated", "damaged"})


@contextmanager
def decoded(data: bytes) -> Iterator[FlightLog | None]:
    """Yield the host's reading of `data`, None if it says that this is no log."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        path = Path(folder) / "flight.bin"
        path.write_bytes(data)
        try:
            log = read_log(path)
        except NotALogError as error:
            assert "\n" not in str(error)
            log = None
        yield log


def check_rows(writer: LogWriter, damaged: bytes) -> None:
    """Compare the host's rows with those of the blocks that are left, byte for byte."""
    alive = {at for at in surviving(writer.data(), damaged) if at < writer.sequence}
    with decoded(damaged) as log:
        if log is None:
            assert not alive
            return
        for name, wanted in expected(writer, alive).items():
            assert len(log.frames[name]) == len(wanted), name
            assert log.frames[name].tobytes() == wanted.tobytes(), name
        check_ledger(log, alive)
        check_table(log)


def check_ledger(log: FlightLog, alive: set[int]) -> None:
    """Every run of missing blocks stands in the ledger, once, and no other does."""
    lost = sorted(set(range(max(alive))) - alive)
    runs = np.split(lost, np.flatnonzero(np.diff(lost) > 1) + 1) if lost else []
    named = [loss for loss in log.loss.losses if loss.blocks]
    inside = [loss.blocks for loss in named]
    for run in runs:
        assert len(run) in inside, f"blocks {run[0]} to {run[-1]} are lost, the ledger is silent"
        inside.remove(len(run))
    # What is left may only be what stood behind the last block.
    end = int(log.blocks.position.max()) + 512
    assert len(inside) <= 1
    if inside:
        assert any(loss.offset >= end and loss.blocks == inside[0] for loss in named)
    for loss in log.loss.losses:
        assert 0 <= loss.offset <= log.scan.size_bytes
        assert 0 <= loss.length <= log.scan.size_bytes
        assert loss.frames is None or loss.frames >= 0
        assert loss.seconds is None or loss.seconds >= 0.0
    assert log.complete in TELLING
    assert bool(runs) <= (log.complete == "damaged")


def check_table(log: FlightLog) -> None:
    """The table has a row for every identification frame and never an infinite value."""
    columns = log.columns()
    assert len(columns["t_s"]) == len(log.frames["ident"])
    for name, values in columns.items():
        assert not np.isinf(values).any(), name


def check_oracle(data: bytes) -> None:
    """Compare every value of every frame with the independent decoder's."""
    wanted = oracle.decode(data, known_schemas=released_texts())
    with decoded(data) as log:
        if wanted is None or log is None:
            assert wanted is None and log is None
            return
        for name in log.frames:
            found = log.frames[name]
            values = [row for row, _ in wanted.frames.get(name, [])]
            assert len(found) == len(values), name
            for column in (found.dtype.names or ())[1:]:
                said = [row[column] for row in values]
                if found.dtype[column].kind == "S":
                    said = [text.rstrip(b"\0") for text in said]
                plain = [list(v) if isinstance(v, list) else v for v in said]
                assert found[column].tolist() == plain, (name, column)
        assert log.complete == wanted.complete
        assert list(log.selection.sessions) == wanted.sessions
        assert sum(other.blocks for other in log.selection.foreign) == len(wanted.foreign)
