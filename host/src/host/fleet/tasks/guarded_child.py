"""A child process for one flight after another, killed if a flight exceeds its limits.

Dask cannot stop a task that runs, and its workers may have no children by `multiprocessing`. So
each worker starts a program of its own (`child_program`), gives it flights over a pipe, watches its
memory and its time, and starts another where it had to be killed. Nothing here is of POSIX only.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess
import sys
import threading
import time
from typing import IO, Any

import psutil

from host.fleet.flight_task import TaskLimits, set_aside

# The matrices are small: threads of BLAS and of compiled loops only wait for each other.
ONE_THREAD = dict.fromkeys(
    (
        "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS",
        "NUMEXPR_NUM_THREADS", "NUMBA_NUM_THREADS",
    ),
    "1",
)  # fmt: skip
_LOOK_S = 0.05  # between two looks at a child's memory
_START_S = 300.0  # to import everything on a computer that is busy
_END_S = 5.0  # until a process that closed its pipes has ended, too
_TRIES = 2  # of a flight whose child ended by itself
_KEEP_SHARE = 0.5  # share of the memory limit beyond which a child is replaced between flights
_MEGABYTE = 1e6


class _EndedError(Exception):
    """The child ended by itself."""


class _ExceededError(Exception):
    """The child had to be killed."""


class GuardedChild:
    """The child of a worker, started when it is first needed."""

    def __init__(self, work: str) -> None:
        self._work = work
        self._process: subprocess.Popen[bytes] | None = None
        self._lines: queue.Queue[bytes] = queue.Queue()
        self._lock = threading.Lock()  # a worker may have been given several threads

    def row(self, task: dict[str, Any], limits: TaskLimits) -> dict[str, Any]:
        """Return the row of a flight, or one that says why there is none.

        Parameters
        ----------
        task : dict
            Values of a `FlightTask`.
        limits : TaskLimits
        """
        with self._lock:
            for _ in range(_TRIES):
                try:
                    answer = self._asked(task, limits)
                except _EndedError as error:
                    why = str(error)
                except _ExceededError as error:
                    return set_aside(task, str(error))
                else:
                    return answer["row"] if "row" in answer else set_aside(task, answer["refused"])
            return set_aside(task, f"{why}, {_TRIES} times")

    def close(self) -> None:
        """End the child."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout):
                if stream is not None:
                    stream.close()

    def _asked(self, task: dict[str, Any], limits: TaskLimits) -> dict[str, Any]:
        process = self._running()
        watched = psutil.Process(process.pid)
        began_s, before_s = time.monotonic(), _processor_s(watched)
        assert process.stdin is not None
        try:
            process.stdin.write(json.dumps(task).encode() + b"\n")
            process.stdin.flush()
        except OSError:
            self._lost()
        while True:
            try:
                line = self._lines.get(timeout=_LOOK_S)
            except queue.Empty:
                self._within(watched, limits, began_s, before_s)
                continue
            if not line:
                self._lost()
            answer: dict[str, Any] = json.loads(line)
            if _memory_mb(watched) > _KEEP_SHARE * limits.memory_mb:
                self.close()
            return answer

    def _within(
        self, watched: psutil.Process, limits: TaskLimits, began_s: float, before_s: float
    ) -> None:
        """Kill the child if it exceeds a limit."""
        try:
            memory_mb, used_s = _memory_mb(watched), _processor_s(watched) - before_s
        except psutil.NoSuchProcess:
            return  # its last line is an empty one
        waited_s = time.monotonic() - began_s
        if memory_mb > limits.memory_mb:
            why = f"needs more than {limits.memory_mb:g} MB of memory"
        elif used_s > limits.processor_s:
            why = f"needs more than {limits.processor_s:g} s of processor time"
        elif waited_s > limits.waiting_s:
            why = f"hangs: no answer after {limits.waiting_s:g} s, {used_s:.0f} s of them at work"
        else:
            return
        self.close()
        raise _ExceededError(f"{why} (--most-seconds, --most-memory)")

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is not None and self._process.poll() is None:
            return self._process
        self.close()
        self._lines = queue.Queue()
        process = subprocess.Popen(
            [sys.executable, "-m", "host.fleet.tasks.child_program", self._work],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, **ONE_THREAD},
        )
        assert process.stdout is not None
        self._process = process
        threading.Thread(target=_read, args=(process.stdout, self._lines), daemon=True).start()
        try:
            first = self._lines.get(timeout=_START_S)
        except queue.Empty:
            first = b""
        if not first:
            self._lost()
        return process

    def _lost(self) -> None:
        process, code = self._process, None
        if process is not None:
            with contextlib.suppress(subprocess.TimeoutExpired):  # its pipes end before it does
                code = process.wait(timeout=_END_S)
        self.close()
        raise _EndedError("the process of this flight ended" + (f" ({code})" if code else ""))


def _read(stream: IO[bytes], lines: queue.Queue[bytes]) -> None:
    """Hand on lines, and an empty one behind the last."""
    try:
        for line in stream:
            lines.put(line)
    except (OSError, ValueError):  # closed
        pass
    lines.put(b"")


def _memory_mb(process: psutil.Process) -> float:
    try:
        return float(process.memory_info().rss) / _MEGABYTE
    except psutil.NoSuchProcess:
        return 0.0


def _processor_s(process: psutil.Process) -> float:
    try:
        used = process.cpu_times()
    except psutil.NoSuchProcess:
        return 0.0
    return float(used.user + used.system)
