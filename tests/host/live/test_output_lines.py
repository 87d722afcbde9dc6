"""Lines of `host live` for a reader that rests or leaves: nobody waits for it."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import pytest
from host.live.output_lines import OutputLines

LINE = "x" * 1000


def test_a_reader_that_rests_holds_nothing_up(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Ten times what a pipe and the memory hold: the giver returns; the count is said."""
    read_fd, write_fd = os.pipe()
    told = tmp_path / "err"
    with os.fdopen(write_fd, "w") as pipe, told.open("w") as err:
        monkeypatch.setattr("sys.stdout", pipe)
        monkeypatch.setattr("sys.stderr", err)
        lines = OutputLines()

        def give() -> None:
            for number in range(10_000):
                lines.out(f"{number} {LINE}")

        giver = threading.Thread(target=give, daemon=True)
        giver.start()
        giver.join(30.0)
        waited = giver.is_alive()
        with os.fdopen(read_fd) as reader:
            got: list[str] = []
            taker = threading.Thread(target=lambda: got.extend(reader), daemon=True)
            taker.start()
            lines.close()
            pipe.close()
            taker.join()
    assert not waited
    numbers = [int(line.split()[0]) for line in got]
    assert numbers == sorted(numbers)
    assert numbers[:900] == list(range(900))
    left_out = 10_000 - len(numbers)
    assert left_out > 0
    counts = [int(line.split()[1]) for line in told.read_text().splitlines()]
    assert sum(counts) == left_out


def test_a_reader_that_left_is_told_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """As behind `head -1`; standard error goes on."""
    read_fd, write_fd = os.pipe()
    os.close(read_fd)
    told = tmp_path / "err"
    pipe = os.fdopen(write_fd, "w")
    with told.open("w") as err:
        monkeypatch.setattr("sys.stdout", pipe)
        monkeypatch.setattr("sys.stderr", err)
        lines = OutputLines()
        for _ in range(3):
            lines.out("row")
        lines.err("host: later")
        lines.close()
    with pytest.raises(BrokenPipeError):  # what stayed in its buffer
        pipe.close()
    said = told.read_text().splitlines()
    assert len(said) == 2
    assert said[0].startswith("host: standard output takes no more lines")
    assert said[1] == "host: later"
