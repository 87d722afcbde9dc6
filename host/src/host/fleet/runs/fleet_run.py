"""A run of a fleet: which flights are new, their answers, what is kept of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from host.fleet.dataset.flight_store import FlightStore
from host.fleet.fleet_error import FleetError
from host.fleet.flight_task import IDENTIFIED, SET_ASIDE, TaskLimits
from host.fleet.sources.flight_keys import FleetSources, tasks_by_key
from host.fleet.tasks.task_cluster import ClusterOptions, run_tasks

if TYPE_CHECKING:
    import pandas as pd

_COMPACT_EVERY = 500  # new rows: as many small files wait at the most


@dataclass(slots=True)
class FleetRun:
    """Counts of a run, and the rows of its flights.

    Attributes
    ----------
    flights : int
        Given.
    known : int
        Kept by an earlier run.
    done, set_aside : int
        Flights of this run.
    rows : pandas.DataFrame
        Rows of all flights given.
    """

    flights: int
    known: int
    done: int = 0
    set_aside: int = 0
    rows: pd.DataFrame | None = field(default=None, repr=False)


def run_fleet(
    sources: FleetSources,
    output: Path,
    *,
    limits: TaskLimits | None = None,
    cluster: ClusterOptions | None = None,
    retry: bool = False,
    tell: Callable[[str], None] = lambda line: None,
    progress: Callable[[int, int], None] = lambda done, all_: None,
) -> FleetRun:
    """Identify every flight that is new or has changed, and return the rows of all.

    Parameters
    ----------
    sources : FleetSources
    output : Path
        Folder of the dataset.
    limits : TaskLimits, optional
    cluster : ClusterOptions, optional
        This computer without.
    retry : bool
        Try flights again that were set aside.
    tell : callable
        Takes lines for the user.
    progress : callable
        Takes how many flights are done, and how many there are to do.

    Raises
    ------
    host.errors.HostError
        If there is nothing to do, the folder cannot be written to, or the scheduler is lost; what
        was done is kept.
    """
    store = FlightStore(output)
    store.compact()
    sources.hashes = store.read_hashes()
    tasks = tasks_by_key(sources.tasks())
    store.write_hashes(sources.hashes)
    if retry:
        store.drop(lambda row: row["state"] == SET_ASIDE)
    states = store.states()
    new = [task for key, task in tasks.items() if key not in states]
    run = FleetRun(len(tasks), len(tasks) - len(new))
    tell(f"{run.flights} flights, {run.known} of them known, {len(new)} to do")
    counts: Counter[str] = Counter()

    def keep(row: dict[str, Any]) -> None:
        store.keep(row)
        counts[row["state"]] += 1
        if row["state"] != IDENTIFIED:
            tell(f"{row['source']}: set aside: {row['reason']}")
        done = counts.total()
        progress(done, len(new))
        if done % _COMPACT_EVERY == 0:
            store.compact()

    if new:
        run_tasks(new, limits or TaskLimits(), cluster or ClusterOptions(), keep, tell)
    store.compact()
    # Earlier rows of the same log, or of a file that it replaced, are no further flights.
    given = {name for task in tasks.values() for name in (task.log_id, task.source)}
    store.drop(
        lambda row: not given.isdisjoint((row["log_id"], row["source"])) and row["key"] not in tasks
    )
    run.done, run.set_aside = counts[IDENTIFIED], counts[SET_ASIDE]
    run.rows = store.rows(tasks)
    if not (run.rows["state"] == IDENTIFIED).any():
        reasons = Counter(run.rows["reason"]).most_common(1)
        raise FleetError(
            f"no flight of {run.flights} could be identified; most often: {reasons[0][0]}"
        )
    return run
