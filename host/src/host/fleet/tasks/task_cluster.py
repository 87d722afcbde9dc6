"""Run tasks in processes of this computer or of a cluster, by Dask.

No more tasks are given out at once than keep every worker busy: the scheduler holds no million of
them, and a run that is stopped has little underway.
"""

from __future__ import annotations

import contextlib
import itertools
import logging
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from host.fleet.fleet_error import FleetError
from host.fleet.flight_task import IDENTIFY, FlightTask, TaskLimits

if TYPE_CHECKING:
    from distributed import Client

    from host.fleet.tasks.guarded_child import GuardedChild

HERE = "127.0.0.1"
_AHEAD = 4  # tasks given out for each worker
_LEAST_AHEAD = 16
# Tasks of a worker that dies go to another one, however often: flights run in children, so none of
# them can have killed the worker.
_SETTINGS = {
    "distributed.scheduler.allowed-failures": 10_000,
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": False,
    "distributed.admin.tick.limit": "1 hour",
    "distributed.comm.timeouts.connect": "30s",
}
_LOCAL = ("127.0.0.1", "localhost", "::1")
_DASHBOARD = 8787
_GUARD = "host.fleet.tasks.dashboard_guard"
_WORKERS_S = 30.0  # until the first worker of a cluster that is starting
_MOST_TRIED = 50  # files of each kind that a worker is asked to open before it gets flights

Row = dict[str, Any]
_children: dict[str, GuardedChild] = {}  # of this worker, by their work


@dataclass(frozen=True, slots=True)
class ClusterOptions:
    """Where tasks run.

    Attributes
    ----------
    workers : int
        Processes on this computer; 0: one for each core.
    scheduler : str
        Address of another cluster; empty: this computer.
    work : str
        ``module:function`` that a child calls with the values of a task.
    """

    workers: int = 0
    scheduler: str = ""
    work: str = IDENTIFY


def run_task(values: Row, limits: TaskLimits, work: str) -> Row:
    """Return the row of a flight; called in a worker."""
    from host.fleet.tasks.guarded_child import GuardedChild

    if work not in _children:
        _children[work] = GuardedChild(work)
    return _children[work].row(values, limits)


def run_tasks(
    tasks: Iterable[FlightTask],
    limits: TaskLimits,
    options: ClusterOptions,
    kept: Callable[[Row], None],
    tell: Callable[[str], None],
) -> None:
    """Run tasks and hand on each row as it comes.

    Parameters
    ----------
    tasks : iterable of FlightTask
    limits : TaskLimits
    options : ClusterOptions
    kept : callable
        Takes a row; what it raises ends the run.
    tell : callable
        Takes lines for the user.

    Raises
    ------
    FleetError
        If the scheduler cannot be reached, or is lost.
    """
    from dask import config
    from distributed import as_completed

    listed = list(tasks)
    waiting = iter(listed)
    with config.set(_SETTINGS), _client(options, tell, sample_files(listed)) as client:
        ahead = max(_LEAST_AHEAD, _AHEAD * len(client.scheduler_info(n_workers=-1)["workers"]))

        def given() -> Iterator[Any]:
            for task in waiting:
                yield client.submit(
                    run_task, task.values(), limits, options.work, key=task.key, pure=False
                )

        source = given()
        first = list(itertools.islice(source, ahead))
        try:
            rest = as_completed(first)
            for future in rest:
                row = future.result()
                future.release()
                kept(row)
                for fresh in _next(source):
                    rest.add(fresh)
        except FleetError:
            raise
        except Exception as error:
            raise FleetError(_lost(options, error)) from error


def _next(source: Iterator[Any]) -> Iterator[Any]:
    """Yield one more, if there is one."""
    for one in source:
        yield one
        return


def _lost(options: ClusterOptions, error: Exception) -> str:
    where = options.scheduler or "on this computer"
    return (
        f"scheduler {where} is lost ({type(error).__name__}); what was done is kept, run the same"
        " command again"
    )


@contextlib.contextmanager
def _client(
    options: ClusterOptions, tell: Callable[[str], None], files: list[str]
) -> Iterator[Client]:
    """Give a client of the cluster that was asked for."""
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with _remote(options, tell, files) if options.scheduler else _local(options, tell) as client:
        yield client


@contextlib.contextmanager
def _local(options: ClusterOptions, tell: Callable[[str], None]) -> Iterator[Client]:
    from distributed import Client, LocalCluster, Security

    from host.fleet.tasks.guarded_child import ONE_THREAD

    os.environ.update(ONE_THREAD)  # before workers are spawned
    try:
        started = LocalCluster(
            n_workers=options.workers or os.cpu_count() or 1,
            threads_per_worker=1,
            processes=True,
            host=HERE,
            dashboard_address=f"{HERE}:{_free(_DASHBOARD)}",
            memory_limit=0,
            # Whoever reaches a scheduler runs programs: keys of this run alone, held in memory.
            security=Security.temporary(),
            preload=[_GUARD],
            scheduler_kwargs={"preload": [_GUARD]},
            silence_logs=logging.CRITICAL,
        )
    except (OSError, RuntimeError) as error:
        raise FleetError(f"workers on this computer did not start: {error}; try again") from error
    with started as cluster, Client(cluster) as client:
        count = len(cluster.workers)
        workers = f"{count} worker{'s' * (count != 1)}"
        tell(f"{workers} on this computer; dashboard {cluster.dashboard_link}")
        yield client


@contextlib.contextmanager
def _remote(
    options: ClusterOptions, tell: Callable[[str], None], files: list[str]
) -> Iterator[Client]:
    from distributed import Client

    address = options.scheduler
    for line in address_warnings(address):
        tell(line)
    try:
        client = Client(address, timeout="10s")
    except (OSError, ValueError, TimeoutError) as error:
        raise FleetError(f"scheduler {address}: not reached: {error}") from None
    with client:
        _same_versions(client, address)
        check_readable(client.run(unreadable, files))
        workers = client.scheduler_info(n_workers=-1)["workers"]
        tell(f"{len(workers)} workers of {address}; dashboard {client.dashboard_link}")
        yield client


def address_warnings(address: str) -> list[str]:
    """Return the warning about a scheduler's address, before it is used."""
    parts = urlsplit(address)
    if parts.scheme == "tls" or (parts.hostname or "") in _LOCAL:
        return []
    return [
        f"warning: {address} is not encrypted, and whoever reaches it runs programs there and"
        " here; use tls:// (distributed.security in Dask's settings)"
    ]


def _same_versions(client: Client, address: str) -> None:
    """Check that every worker runs what we run."""
    try:
        client.wait_for_workers(1, timeout=_WORKERS_S)
    except TimeoutError:
        raise FleetError(
            f"scheduler {address} has no workers; start some with dask worker"
        ) from None
    check_versions(worker_versions(), client.run(worker_versions))


def check_versions(ours: dict[str, str], theirs: dict[str, dict[str, str]]) -> None:
    """Check versions of workers.

    Raises
    ------
    FleetError
        At the first that differs.
    """
    for worker, found in theirs.items():
        for name, version in ours.items():
            if found.get(name) != version:
                raise FleetError(
                    f"worker {worker} has {name} {found.get(name)}, expected {version}; install the"
                    " same on every machine"
                )


def check_readable(theirs: dict[str, str]) -> None:
    """Check that every worker can read the sources.

    Parameters
    ----------
    theirs : dict of str to str
        What `unreadable` returned, by worker.

    Raises
    ------
    FleetError
        A computer has another version; the first is named.
    """
    for worker, found in theirs.items():
        if found:
            raise FleetError(
                f"worker {worker} cannot read {found}; every machine must see the sources, aircraft"
                " files and calibrations by the same names"
            )


def sample_files(tasks: Sequence[FlightTask]) -> list[str]:
    """Return files to try: one log of each folder, and every other file."""
    logs = {task.source.rpartition("/")[0]: task.source for task in tasks}
    others = {
        name
        for task in tasks
        for name in (task.aircraft_file, task.calibration, task.mapping)
        if name and Path(name).is_file()
    }
    return [*list(logs.values())[:_MOST_TRIED], *sorted(others)[:_MOST_TRIED]]


def unreadable(files: list[str]) -> str:
    """Return the first file that cannot be read here, and why; empty if all can."""
    from host.fleet.sources.flight_files import is_address, opened

    for name in files:
        try:
            with opened(name) if is_address(name) else Path(name).open("rb") as file:
                file.read(1)
        except (OSError, FleetError) as error:
            return f"{name}: {getattr(error, 'strerror', None) or error}"
    return ""


def worker_versions() -> dict[str, str]:
    """Return the versions of the programs on which an answer depends."""
    from importlib import metadata

    from host import __version__

    names = ("numpy", "scipy", "pandas", "distributed")
    return {
        "host": __version__,
        "Python": ".".join(map(str, sys.version_info[:2])),
        **{name: metadata.version(name) for name in names},
    }


def _free(port: int) -> int:
    """Return a port if nobody has it; 0, any one, else."""
    import socket

    with socket.socket() as probe:
        try:
            probe.bind((HERE, port))
        except OSError:
            return 0
    return port
