"""No test depends on time, on chance, or on how it was started.

Hypothesis draws the same cases, at any speed, every run. A shell that starts a job in the
background lets it ignore Ctrl-C, and so its children: those that are to end by Ctrl-C would hang.
The report of a run names the processor time of each case. One that takes more than `MOST_CPU_S`
of a quiet machine fails, unless it says why it costs more: `@pytest.mark.costs(seconds, "why")`.
Machines, and one machine with neighbours, differ by `SLOWER`.
A case marked `campaign` repeats others with another image, seed or input, or as one whole day: it
runs in `make campaign`, before a release.
The collector of cycles, which took 4 % of the time, passes over what was imported.
Linear algebra has one thread, before numpy is loaded: the matrices are small, and on a busy machine
threads that spin for them make a fit ten times slower.
"""

import gc
import os
import signal
from collections.abc import Generator
from contextlib import suppress
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import settings

settings.register_profile("house", deadline=None, derandomize=True, database=None)
settings.load_profile("house")
gc.set_threshold(100_000)  # new objects between two runs; Python says 700
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

MOST_CPU_S = 10.0  # of a case, what it makes for later ones included
SLOWER = 2.0
_BEGUN = pytest.StashKey[tuple[float, float, set[int]]]()


def pytest_configure(config: pytest.Config) -> None:
    """Register the mark of a case that may take more processor time than others."""
    config.addinivalue_line("markers", "costs(seconds, why): processor time it may take, and why")
    config.addinivalue_line("markers", "campaign: repeats another case on more; `make campaign`")


def _times_s() -> tuple[float, float]:
    """Return processor time of this process, and of those that it waited for."""
    used = os.times()
    return used.user + used.system, used.children_user + used.children_system


def _children() -> set[int]:
    """Return processes of this one that run or are not waited for; none where Linux is not."""
    found: set[int] = set()
    for path in Path("/proc/self/task").glob("*/children"):
        with suppress(OSError):  # a thread that ended meanwhile
            found |= {int(child) for child in path.read_text().split()}
    return found


def pytest_collection_finish() -> None:
    """Let the collector of cycles leave out what imports made."""
    gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Note when a case begins: before what it shares with later cases is made."""
    item.stash[_BEGUN] = *_times_s(), _children()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Write processor time into the report of the case; fail one that takes too much."""
    if call.when != "teardown":
        return (yield)
    own_s, others_s = _times_s()
    own_before_s, others_before_s, left = item.stash[_BEGUN]
    used_s = own_s - own_before_s
    # A process that an earlier case left and that was waited for in this one brings all the time of
    # its life along, and nothing says how much of the sum it is.
    if others_s > others_before_s and left <= _children():
        used_s += others_s - others_before_s
    item.user_properties.append(("cpu_s", f"{used_s:.2f}"))
    report = yield
    mark = item.get_closest_marker("costs")
    most_s = SLOWER * (MOST_CPU_S if mark is None else mark.args[0])
    if report.passed and used_s > most_s:
        report.outcome = "failed"
        report.longrepr = f"{used_s:.1f} s of processor time, at most {most_s:.0f} s: make it less"
    return report
