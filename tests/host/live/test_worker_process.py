"""Ctrl-C while a worker still starts: it is the parent's, and nothing is printed."""

import os
import signal
import sys
from multiprocessing.connection import Connection

import pytest
from host.live.worker_process import WorkerProcess


def echo(asked: Connection) -> None:
    while True:
        asked.send(asked.recv())


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_at_its_start_leaves_it_at_work(capfd: pytest.CaptureFixture[str]) -> None:
    worker = WorkerProcess("echo", echo)
    worker.start()
    os.kill(worker._process.pid, signal.SIGINT)
    worker.ask("all the same")
    try:
        assert worker.answer(60.0) == "all the same"
    finally:
        worker.close()
    assert capfd.readouterr().err == ""
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())
