"""No test depends on time, on chance, or on how it was started.

Hypothesis draws the same cases, at any speed, every run. A shell that starts a job in the
background lets it ignore Ctrl-C, and so its children: those that are to end by Ctrl-C would hang.
The report of a run names the processor time of each case.
"""

import os
import signal
from collections.abc import Generator

import pytest
from hypothesis import settings

settings.register_profile("house", deadline=None, derandomize=True, database=None)
settings.load_profile("house")
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

_BEGUN = pytest.StashKey[float]()


def _processor_time_s() -> float:
    """Return what this process and those that it waited for have used."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Note when a case begins: before what it shares with later cases is made."""
    item.stash[_BEGUN] = _processor_time_s()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Write processor time into the report of the case, which the clock would not show."""
    if call.when == "teardown":
        item.user_properties.append(("cpu_s", f"{_processor_time_s() - item.stash[_BEGUN]:.2f}"))
    return (yield)
