"""From what was measured to what a million flights would take, and where it would break first."""

from __future__ import annotations

from dataclasses import dataclass

MANY = 1_000_000
HOURS = 24.0  # in which they shall be done
CORES = 64  # of a machine that one can rent
MEMORY_GB = 256.0


@dataclass(frozen=True)
class Figures:
    """What the bench measured.

    Attributes
    ----------
    minutes : float
        Length of each flight.
    log_bytes : int
    loop_s, loop_used_s : float
        A flight in a plain loop: by the clock, of the processor.
    one_s, two_s : float
        Seconds by the clock from row to row, with one worker and with two.
    one_used_s : float
        Processor time of the child for a flight.
    tasks : int
        That slept `sleep_s` each, with two workers.
    task_s, task_used_s : float
        From row to row, and processor time of everything, of each.
    scheduler_mb : float
        Largest resident memory of the process with the scheduler, the store and all tasks.
    row_bytes : float
        Kept of a flight.
    answer_s, answer_bytes : float
        Time and memory of the type's model, for each of its flights.
    quiet : bool
    load : float
    """

    minutes: float
    log_bytes: int
    loop_s: float
    loop_used_s: float
    one_s: float
    one_used_s: float
    two_s: float
    tasks: int
    task_s: float
    task_used_s: float
    sleep_s: float
    scheduler_mb: float
    row_bytes: float
    answer_s: float
    answer_bytes: float
    quiet: bool
    load: float

    @property
    def ratio(self) -> float:
        """Flights per hour of two workers over those of one."""
        return self.one_s / self.two_s

    @property
    def overhead(self) -> float:
        """Overhead of one worker over a plain loop, by the clock."""
        return self.one_s / self.loop_s - 1.0

    @property
    def hand_out_s(self) -> float:
        """Time from row to row that is not the two workers' sleep. Most of it is the one process
        that gives out tasks and keeps rows, so that more workers do not shorten it."""
        return max(self.task_s - 0.5 * self.sleep_s, 1e-4)

    @property
    def most_workers(self) -> float:
        """Workers that one scheduler keeps busy."""
        return self.one_s / self.hand_out_s

    @property
    def model_gb(self) -> float:
        """Memory of the model of one type with all flights."""
        return MANY * self.answer_bytes / 1e9


def reckoning(f: Figures) -> list[str]:
    """Return the figures, then a million flights, as lines of Markdown tables."""
    return [
        "",
        *_table(f"measured{'' if f.quiet else ' on a busy machine'}, load {f.load:.1f}", _told(f)),
        "",
        *_table(f"10^6 flights of {f.minutes:.1f} min", _many(f)),
        "",
        f"breaks first: {_first(f)}",
    ]


def _table(head: str, rows: dict[str, str]) -> list[str]:
    return [f"| {head} | |", "| --- | --- |", *(f"| {a} | {b} |" for a, b in rows.items())]


def _told(f: Figures) -> dict[str, str]:
    slept = f"{f.tasks} tasks that sleep {1e3 * f.sleep_s:.0f} ms, two workers"
    return {
        "plain loop": f"{f.loop_s:.2f} s a flight of {f.minutes:.1f} min,"
        f" {f.loop_used_s:.2f} s of processor",
        "one worker": f"{f.one_s:.2f} s a flight, {3600 / f.one_s:.0f} an hour,"
        f" {f.one_used_s:.2f} s of processor",
        "two workers": f"{f.two_s:.2f} s a flight, {3600 / f.two_s:.0f} an hour:"
        f" {f.ratio:.2f} times one",
        "Dask over a plain loop": f"{100 * f.overhead:+.1f} %",
        slept: f"{1e3 * f.task_s:.1f} ms from row to row,"
        f" {1e3 * f.task_used_s:.1f} ms of processor of all processes",
        "memory of the process with the scheduler": f"{f.scheduler_mb:.0f} MB",
        "kept of a flight": f"{f.row_bytes / 1e3:.1f} kB (its log: {f.log_bytes / 1e6:.2f} MB)",
        "the type's model": f"{1e3 * f.answer_s:.2f} ms and {f.answer_bytes / 1e3:.0f} kB of memory"
        " for each flight",
    }


def _many(f: Figures) -> dict[str, str]:
    hours = MANY * f.one_s / 3600.0
    return {
        "processor": f"{hours:.0f} core hours",
        f"in {HOURS:g} h": f"{hours / HOURS / CORES:.1f} machines of {CORES} cores",
        "storage": f"{MANY * f.log_bytes / 1e12:.2f} TB of logs,"
        f" {MANY * f.row_bytes / 1e9:.1f} GB of rows",
        "one scheduler hands out": f"{1 / f.hand_out_s:.0f} flights a second:"
        f" {f.most_workers:.0f} workers, {MANY * f.hand_out_s / 3600:.1f} h at the least",
        "the model of one type": f"{MANY * f.answer_s / 60:.0f} min, {f.model_gb:.0f} GB of memory",
    }


def _first(f: Figures) -> str:
    if f.model_gb > MEMORY_GB:
        return (
            f"the model, {f.model_gb:.0f} GB against {MEMORY_GB:.0f} of a machine: it holds all"
            " flights of a type at once"
        )
    return f"the scheduler, beyond {f.most_workers:.0f} workers"
