"""What a hostile ULog may cost: SECURITY.md's promise, kept in time and in memory."""

from __future__ import annotations

import time
import tracemalloc
from functools import cache
from pathlib import Path

import pytest
from host.errors import HostError
from host.readers.autopilot_flight import read_autopilot
from host.readers.ulog_messages import read_ulog

from tests.host.readers.autopilot_flights import write
from tests.host.readers.hostile_ulog import MAGIC, clean, data, head, hostile, nested, subscription

SIZE = 1_200_000
MOST_TIMES, LEAST_S = 20.0, 2.0
MOST_BYTES, MOST_PER_BYTE = 40 << 20, 8  # of the promised 300 MB this reader needs a part


def cost(path: Path) -> float:
    """Return the processor time that a log takes, s."""
    began_s = time.process_time()
    try:
        read_autopilot(path)
    except HostError as error:
        assert "\n" not in str(error)
        assert len(str(error)) < 400
    return time.process_time() - began_s


@cache
def clean_s(folder: Path) -> float:
    path = folder / "clean.ulg"
    path.write_bytes(clean(SIZE))
    return cost(path)


@pytest.mark.parametrize("what", hostile(0))
def test_a_hostile_log_costs_what_was_promised(
    what: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """The first two and the fourth took the computer: over 60 s, and 3.75 GB of the first."""
    path = tmp_path / "log.ulg"
    path.write_bytes(hostile(SIZE)[what]())
    took_s = cost(path)
    assert took_s < max(LEAST_S, MOST_TIMES * clean_s(tmp_path_factory.getbasetemp()))
    path.write_bytes(hostile(SIZE // 8)[what]())
    tracemalloc.start()
    cost(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < MOST_BYTES + MOST_PER_BYTE * path.stat().st_size


def test_what_is_behind_garbage_is_read(tmp_path: Path) -> None:
    """Garbage without the head of a message costs itself and no message behind it."""
    rows = b"".join(data(1, bytes(8) + bytes(4)) for _ in range(5))
    whole = write("ulog", tmp_path).read_bytes()
    found = read_ulog(tmp_path / "flight.ulg")
    cut = len(whole) // 2
    path = tmp_path / "hurt.ulg"
    for garbage in (b"\xff" * 5000, bytes(5000), b"D" * 5000, rows):
        path.write_bytes(whole[:cut] + garbage + whole[cut:])
        hurt = read_ulog(path)
        for name, instances in found.messages.items():
            for instance, messages in instances.items():
                assert len(hurt.messages[name][instance]) >= len(messages) - 1, (garbage[:9], name)


@pytest.mark.parametrize(
    ("log", "says"),
    [
        (MAGIC + nested(6, 1000) + subscription("airspeed", 1), "holds no message"),
        (head() + b"\xff" * 100, "100 bytes from byte"),
        (MAGIC + b"\x28\0B" + bytes(8) + b"\2" + bytes(31), "a way of reading"),
        (head() + subscription("nobody", 7), "nobody: not defined: no topic"),
        (head()[:-3], "is cut after 14 bytes"),
    ],
)
def test_what_is_not_read_is_said(log: bytes, says: str, tmp_path: Path) -> None:
    path = tmp_path / "log.ulg"
    path.write_bytes(log)
    try:
        said = " ".join(read_ulog(path).damage)
    except HostError as error:
        said = str(error)
    assert says in said
