"""`make fleet-bench`: what a fleet costs, and from it what a million flights would cost.

    python tests/bench/fleet_bench.py              # seven to ten minutes on a quiet machine
    python tests/bench/fleet_bench.py --short      # fewer flights and tasks, to see that it works

Flights of five minutes are flown by the twin and recorded by the firmware; all are one flight under
several names, so that every one costs the same. Exit code 6 if a limit is missed on a machine that
was quiet; on a busy one figures by the clock are marked and not judged.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import psutil
from host.fleet.dataset.flight_store import FlightStore
from host.fleet.dataset.row_flights import type_flights
from host.fleet.runs.fleet_run import run_fleet
from host.fleet.sources.flight_keys import FleetSources, tasks_by_key
from host.fleet.statistics.type_model import type_model
from host.fleet.tasks.guarded_child import ONE_THREAD
from host.fleet.tasks.task_cluster import ClusterOptions
from host.twin.flight.fly import fly
from host.twin.recorder import sitl
from host.twin.recorder.stimuli import stimuli
from host.twin.sensors.local_flow import air_data
from host.twin.testcard.cards import load

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from tests.bench.fleet_reckoning import Figures, reckoning
from tests.bench.fleet_work import SLEEP_S

ROOT = Path(__file__).resolve().parents[2]
AIRCRAFT = "ultrastick25e"
MINUTES, SEED = 5.0, 22_900
SLEEPS = "tests.bench.fleet_work:slept"
LEAST_RATIO, MOST_OVERHEAD = 1.7, 0.10
QUIET_LOAD = 0.5  # processes that wait or run next to us
_FOLDERS = 50  # aircraft of the sleeping fleet


@dataclass
class Run:
    """A run of the verb's own code over logs.

    Attributes
    ----------
    at_s : list of float
        When each row came.
    used_s : float
        Processor time of the flights, children and workers with it.
    most_mb : float
        Largest resident memory of this process, where the scheduler is.
    """

    at_s: list[float] = field(default_factory=list)
    used_s: float = 0.0
    most_mb: float = 0.0
    folder: Path = Path()

    def per_flight_s(self, workers: int) -> float:
        """Return seconds by the clock from row to row, those that started a child left out."""
        return (self.at_s[-1] - self.at_s[workers - 1]) / (len(self.at_s) - workers)


def flown(minutes: float) -> tuple[bytes, float]:
    """Return the log of one flight of about so many minutes, and how many it became."""
    card = load("demo")
    once = [s for s in card.segments if s.kind != "trim"]
    repeats = max(1, round(minutes / 1.5))  # of a minute and a half
    card = replace(card, segments=(card.segments[0], *(once * repeats), card.segments[-1]))
    record = fly(card, seed=SEED)
    log = sitl.record(
        stimuli(record, air_data(record)),
        rate_hz=sitl.recorder_rate_hz(card.flight.rate_hz),
        aircraft=AIRCRAFT,
        faults=(),
        seed=SEED,
    ).log
    found = float(record.t_s[-1]) / 60.0
    print(f"a flight of {found:.1f} min, {len(log) / 1e6:.2f} MB", flush=True)
    return log, found


def named(folder: Path, log: bytes, count: int) -> Path:
    """Write a log under several aircraft's names."""
    for number in range(count):
        own = folder / f"N{number:02d}"
        own.mkdir(parents=True)
        (own / "flight.bin").write_bytes(log)
    return folder


def identified(folder: Path, log: bytes, count: int, workers: int) -> Run:
    """Identify so many flights with so many workers, as the verb does."""
    logs = named(folder / "logs", log, count)
    return run(FleetSources([str(logs)], AIRCRAFT), folder / "out", ClusterOptions(workers))


def run(sources: FleetSources, out: Path, cluster: ClusterOptions) -> Run:
    """Run a fleet and watch it."""
    own, found = psutil.Process(), Run(folder=out)

    def progress(done: int, of: int) -> None:
        found.at_s.append(time.perf_counter())
        if done % 100 == 0 or done == of:
            found.most_mb = max(found.most_mb, own.memory_info().rss / 1e6)

    before = children_s()
    result = run_fleet(sources, out, cluster=cluster, progress=progress)
    found.used_s = children_s() - before
    assert result.rows is not None
    assert result.set_aside == 0, result.rows["reason"].tolist()
    return found


def children_s() -> float:
    """Return the processor time of this process and of all that it started and that ended."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def plain_loop(folder: Path, log: bytes, count: int) -> dict[str, float]:
    """Identify so many flights in a loop of one process without Dask; seconds of one."""
    sources = FleetSources([str(named(folder / "logs", log, count))], AIRCRAFT)
    tasks = [task.values() for task in tasks_by_key(sources.tasks()).values()]
    done = subprocess.run(
        [sys.executable, "-m", "tests.bench.fleet_work"],
        input=json.dumps(tasks), capture_output=True, text=True, check=True, cwd=ROOT,
        env={**os.environ, **ONE_THREAD, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    return {name: value / (count - 1) for name, value in json.loads(done.stdout).items()}


def sleeping(folder: Path, tasks: int) -> Run:
    """Run tasks that only sleep: what is left is Dask's, the pipes' and the disk's."""
    for number in range(tasks):
        path = folder / "logs" / f"N{number % _FOLDERS:02d}" / f"f{number}.bin"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"log %d" % number)
    sources = FleetSources([str(folder / "logs")], AIRCRAFT)
    return run(sources, folder / "out", ClusterOptions(2, work=SLEEPS))


def kept(folder: Path, out: Path, flights: int) -> tuple[float, float, float]:
    """Return bytes, seconds and bytes of memory of one flight in an answer over many.

    Rows of real flights are kept again under other names, each number altered a little: rows that
    are all alike would be packed too well.
    """
    import numpy as np

    rng = np.random.default_rng(SEED)
    rows = FlightStore(out).rows().to_dict("records")
    store = FlightStore(folder / "many")
    for number in range(flights):
        row = {str(k): v for k, v in rows[number % len(rows)].items()}
        for name in ("estimates", "own_covariance", "loadings", "watched_values"):
            row[name] = (
                np.array(row[name]) * (1.0 + 1e-3 * rng.standard_normal(len(row[name])))
            ).tolist()
        row |= {"key": f"k{number}", "log_id": f"l{number}", "aircraft": f"N{number % 10}"}
        store.keep(row)
    store.compact()
    files = (folder / "many" / "flights").rglob("*.parquet")
    size = sum(path.stat().st_size for path in files) / flights
    before, began_s = psutil.Process().memory_info().rss, time.process_time()
    model = type_model("type", type_flights(store.rows()))
    grown = psutil.Process().memory_info().rss - before
    assert model.effects
    return size, (time.process_time() - began_s) / flights, max(grown, 0) / flights


def measured(folder: Path, *, short: bool) -> Figures:
    """Measure everything."""
    before = os.getloadavg()[0]  # of others: making the flight is work too
    log, minutes = flown(1.0 if short else MINUTES)
    each, tasks = (2, 500) if short else (8, 10_000)

    def told(text: str) -> None:
        print(text, flush=True)

    plain = plain_loop(folder / "plain", log, each + 1)
    told(f"plain loop: {plain['clock_s']:.1f} s a flight, {plain['used_s']:.1f} s of processor")
    one = identified(folder / "one", log, each + 1, 1)
    told(f"one worker: {one.per_flight_s(1):.1f} s a flight")
    two = identified(folder / "two", log, 2 * each + 2, 2)
    told(f"two workers: {two.per_flight_s(2):.1f} s a flight")
    idle = sleeping(folder / "sleeping", tasks)
    told(f"{tasks} tasks that sleep {1e3 * SLEEP_S:.0f} ms: {idle.at_s[-1] - idle.at_s[0]:.0f} s")
    size, answer_s, answer_bytes = kept(folder, two.folder, 200 if short else 1000)
    rows = FlightStore(one.folder).rows()
    return Figures(
        minutes=minutes,
        log_bytes=len(log),
        loop_s=plain["clock_s"],
        loop_used_s=plain["used_s"],
        one_s=one.per_flight_s(1),
        one_used_s=float(rows["processor_s"].iloc[1:].mean()),
        two_s=two.per_flight_s(2),
        tasks=tasks,
        task_s=(idle.at_s[-1] - idle.at_s[0]) / tasks,
        task_used_s=idle.used_s / tasks,
        sleep_s=SLEEP_S,
        scheduler_mb=idle.most_mb,
        row_bytes=size,
        answer_s=answer_s,
        answer_bytes=answer_bytes,
        quiet=before < QUIET_LOAD,
        load=before,
    )


def main(arguments: list[str] | None = None) -> int:
    """Measure, print, and return an exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--short", action="store_true", help="fewer flights and tasks")
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory(prefix="fleet-bench-") as folder:
        figures = measured(Path(folder), short=args.short)
    print("\n".join(reckoning(figures)))
    short = []
    if figures.ratio < LEAST_RATIO:
        short.append(f"two workers do {figures.ratio:.2f} times one's, asked {LEAST_RATIO}")
    if figures.overhead > MOST_OVERHEAD:
        short.append(f"overhead {100 * figures.overhead:.1f} %, asked {100 * MOST_OVERHEAD:.0f} %")
    if short and not figures.quiet:
        print(f"not judged, the machine was busy (load {figures.load:.1f}): {'; '.join(short)}")
        return 0
    if short and not args.short:
        print(f"missed: {'; '.join(short)}")
        return 6
    return 0


if __name__ == "__main__":
    sys.exit(main())
