"""A process that works for the session: the loop that receives asks it and never waits long.

It dies with its parent, and a mistake in it costs an answer, not the recording.
"""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Callable, Iterator
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection
from typing import Any

_ONE_THREAD = "OPENBLAS_NUM_THREADS"  # the matrices are small: threads only wait for each other
_NICER = 5


class WorkerEndedError(Exception):
    """The process is gone; the next question starts another."""


class WorkerProcess:
    """Starts a process, asks it, and takes its answers.

    Parameters
    ----------
    name : str
        For a list of processes.
    work : callable
        Function of a module, called in the process with a connection and `given`; it receives
        questions and sends answers until the connection ends.
    *given
        What can be sent to a process.
    """

    def __init__(self, name: str, work: Callable[..., None], *given: Any) -> None:
        self._name, self._work, self._given = name, work, given
        self._process: Any = None
        self._ours: Connection | None = None

    def start(self) -> None:
        """Start the process; it takes some seconds to know everything that it needs."""
        os.environ.setdefault(_ONE_THREAD, "1")
        context = get_context("spawn")
        self._ours, theirs = context.Pipe()
        self._process = context.Process(
            target=_run, args=(self._work, theirs, *self._given), daemon=True, name=self._name
        )
        with _without_ctrl_c():
            self._process.start()
        theirs.close()

    def ask(self, what: Any) -> None:
        """Send a question; starts the process where there is none."""
        if self._ours is None or not self._process.is_alive():
            self.start()
        assert self._ours is not None
        self._ours.send(what)

    def answer(self, timeout_s: float = 0.0) -> Any | None:
        """Return the next answer if there is one.

        Raises
        ------
        WorkerEndedError
            The process ended.
        """
        if self._ours is None:
            return None
        try:
            return self._ours.recv() if self._ours.poll(timeout_s) else None
        except (EOFError, OSError):
            self._ours = None
            raise WorkerEndedError(f"{self._name}: the process ended") from None

    def close(self) -> None:
        """End the process."""
        if self._process is not None and self._process.is_alive():
            self._process.terminate()
            self._process.join(timeout=2.0)
        self._ours = None


@contextlib.contextmanager
def _without_ctrl_c() -> Iterator[None]:
    """Hold Ctrl-C back, here for a moment; a process that starts meanwhile never gets it.

    It would else end in the middle of its imports with a traceback on the terminal.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    resource_tracker.ensure_running()  # its own start would let Ctrl-C through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _run(work: Callable[..., None], asked: Connection, *given: Any) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's
    if hasattr(os, "nice"):
        os.nice(_NICER)
    with contextlib.suppress(EOFError, OSError):  # the parent has gone
        work(asked, *given)
