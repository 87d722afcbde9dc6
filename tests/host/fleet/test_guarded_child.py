"""One flight after another in a child: what each costs the others."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import psutil
import pytest
from host.fleet.flight_task import IDENTIFIED, SET_ASIDE, TaskLimits
from host.fleet.tasks.guarded_child import GuardedChild

STUB = "tests.host.fleet.stub_work:stub_row"
LIMITS = TaskLimits(processor_s=0.5, memory_mb=400.0, waiting_s=100.0)
# On a busy computer new memory costs processor time, so that only one limit is near at a time.
OTHERS = {"eats": replace(LIMITS, processor_s=100.0), "hangs": replace(LIMITS, waiting_s=1.0)}


@pytest.fixture(scope="module")
def child() -> Iterator[GuardedChild]:
    one = GuardedChild(STUB)
    yield one
    one.close()


def task(name: str) -> dict[str, Any]:
    texts = ("log_id", "type", "aircraft", "aircraft_file", "aircraft_id", "calibration_id")
    return {
        **dict.fromkeys((*texts, "date", "version"), ""),
        "key": name,
        "source": f"{name}.bin",
        "models": [],
    }


def test_a_child_works_on_one_flight_after_another(child: GuardedChild) -> None:
    rows = [child.row(task(name), LIMITS) for name in ("one", "two")]
    assert [row["state"] for row in rows] == [IDENTIFIED] * 2
    assert rows[0]["maneuvers"] == rows[1]["maneuvers"]  # one process


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("damaged", "no intact block, expected a log"),
        ("eats", "more than 400 MB of memory"),
        ("works", "more than 0.5 s of processor time"),
        ("hangs", "hangs: no answer after 1 s"),
        ("ends", "the process of this flight ended (7), 2 times"),
    ],
)
def test_a_hostile_flight_is_set_aside_and_the_next_one_is_not(
    child: GuardedChild, name: str, reason: str
) -> None:
    row = child.row(task(name), OTHERS.get(name, LIMITS))
    assert row["state"] == SET_ASIDE
    assert reason in row["reason"]
    assert child.row(task("next"), LIMITS)["state"] == IDENTIFIED


def test_a_child_that_somebody_kills_is_started_again(child: GuardedChild) -> None:
    first = child.row(task("one"), LIMITS)["maneuvers"]
    psutil.Process(first).kill()
    psutil.wait_procs([psutil.Process(first)] if psutil.pid_exists(first) else [], timeout=10)
    second = child.row(task("two"), LIMITS)
    assert second["state"] == IDENTIFIED
    assert second["maneuvers"] != first


def test_a_child_ends_with_its_worker() -> None:
    one = GuardedChild(STUB)
    number = one.row(task("one"), LIMITS)["maneuvers"]
    process = one._process
    assert process is not None
    assert process.stdin is not None
    process.stdin.close()  # what the end of a worker does
    assert process.wait(timeout=30) == 0
    assert not psutil.pid_exists(number)
    one.close()
