"""A whole run with stub flights: damaged and hostile ones, workers that die, a full disk, a
scheduler that is lost. The cluster is a scheduler and workers of their own, over TLS."""

import errno
import random
import threading
from collections import Counter
from pathlib import Path
from typing import Any

import psutil
import pytest
from host.fleet.dataset import flight_store
from host.fleet.dataset.flight_store import FlightStore
from host.fleet.fleet_error import FleetError
from host.fleet.flight_task import IDENTIFIED, SET_ASIDE, TaskLimits
from host.fleet.runs.fleet_run import FleetRun, run_fleet
from host.fleet.sources.flight_keys import FleetSources
from host.fleet.tasks.task_cluster import (
    ClusterOptions,
    address_warnings,
    check_versions,
    worker_versions,
)

from tests.host.fleet.conftest import Cluster, started

STUB = "tests.host.fleet.stub_work:stub_row"
# What hangs is known from what waits for its turn by the clock alone: a flight of 20 ms takes long.
LIMITS = TaskLimits(processor_s=2.0, memory_mb=400.0, waiting_s=10.0)
HOSTILE = {"hangs", "eats", "ends", "damaged"}


def written(folder: Path, count: int) -> Path:
    """Write files that stand for logs of four aircraft, four of them damaged or hostile."""
    for number in range(count):
        name = {7: "hangs", 27: "eats", 47: "ends", 67: "damaged"}.get(number, "flight")
        path = folder / f"N{number % 4}" / f"{name}{number}.bin"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"log %d" % number)
    return folder


def run(
    logs: Path, out: Path, cluster: Cluster, said: list[str] | None = None, **more: Any
) -> FleetRun:
    return run_fleet(
        FleetSources([str(logs)], "ultrastick25e"),
        out,
        limits=LIMITS,
        cluster=ClusterOptions(scheduler=cluster.address, work=STUB),
        tell=(said if said is not None else []).append,
        **more,
    )


def test_nothing_is_lost_and_nothing_is_twice_while_workers_are_killed(
    cluster: Cluster, tmp_path: Path
) -> None:
    """Eighty flights, 5 % of them damaged or hostile."""
    logs = written(tmp_path / "logs", 80)
    over, killed, rng = threading.Event(), [0], random.Random(20)

    def kill() -> None:
        while killed[0] < 2 and not over.wait(1.0):
            workers = [
                p
                for p in psutil.Process(cluster.workers.pid).children(recursive=True)
                if "child_program" in " ".join(p.cmdline()) and p.is_running()
            ]
            if workers:  # a worker is the parent of its child
                rng.choice(workers).parent().kill()
                killed[0] += 1

    killer = threading.Thread(target=kill)
    killer.start()
    try:
        found = run(logs, tmp_path / "out", cluster)
    finally:
        over.set()
        killer.join()
    assert killed[0] == 2
    rows = found.rows
    assert rows is not None
    assert sorted(Path(s).name for s in rows["source"]) == sorted(
        p.name for p in logs.rglob("*.bin")
    )
    assert len(rows) == len(set(rows["log_id"])) == 80
    # Nobody else is blamed for what these four did, or for the workers that died.
    aside = rows[rows["state"] == SET_ASIDE]
    names = ["".join(c for c in Path(s).stem if c.isalpha()) for s in aside["source"]]
    assert sorted(names) == sorted(HOSTILE)
    assert Counter(rows["aircraft"]) == dict.fromkeys(("N0", "N1", "N2", "N3"), 20)
    # The second run does only what is new or has changed.
    (logs / "N0" / "flight0.bin").write_bytes(b"longer than before")
    said: list[str] = []
    again = run(logs, tmp_path / "out", cluster, said)
    assert (again.known, again.done) == (79, 1)
    assert again.rows is not None
    assert len(again.rows) == 80
    assert len(FlightStore(tmp_path / "out").states()) == 80  # what the log was before is gone
    assert not any("warning" in line for line in said)


def test_a_full_disk_stops_in_one_line_and_a_rerun_resumes(
    cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    logs = written(tmp_path / "logs", 7)
    kept: list[Path] = []
    publish = flight_store._published

    def full(table: Any, path: Path) -> None:
        if len(kept) == 3:
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        publish(table, path)
        kept.append(path)

    monkeypatch.setattr(flight_store, "_published", full)
    with pytest.raises(FleetError, match="No space left on device; what was done is kept") as stop:
        run(logs, tmp_path / "out", cluster)
    assert "\n" not in str(stop.value)
    monkeypatch.setattr(flight_store, "_published", publish)
    again = run(logs, tmp_path / "out", cluster)
    assert again.known == 3
    assert again.rows is not None
    assert Counter(again.rows["state"]) == {IDENTIFIED: 7}


def test_a_lost_scheduler_stops_in_one_line_and_a_rerun_resumes(
    cluster: Cluster, tmp_path: Path
) -> None:
    logs = written(tmp_path / "logs", 7)
    lost = started(tmp_path, 1, nanny=False)

    def progress(done: int, of: int) -> None:
        if done == 2:
            lost.scheduler.kill()

    try:
        with pytest.raises(FleetError, match=r"is lost .*; what was done is kept") as stop:
            run(logs, tmp_path / "out", lost, progress=progress)
    finally:
        lost.close()
    assert "\n" not in str(stop.value)
    again = run(logs, tmp_path / "out", cluster)
    assert 2 <= again.known < 7
    assert again.rows is not None
    assert Counter(again.rows["state"]) == {IDENTIFIED: 7}


def test_a_scheduler_that_is_not_there_or_not_safe_is_told() -> None:
    assert address_warnings("tls://lab:8786") == []
    assert address_warnings("tcp://127.0.0.1:8786") == []
    assert "not encrypted" in address_warnings("tcp://lab:8786")[0]


def test_a_worker_with_another_version_is_refused() -> None:
    ours = worker_versions()
    check_versions(ours, {"tcp://lab:1": ours})
    with pytest.raises(FleetError, match=r"worker tcp://lab:1 has numpy 1\.0, expected"):
        check_versions(ours, {"tcp://lab:1": {**ours, "numpy": "1.0"}})
