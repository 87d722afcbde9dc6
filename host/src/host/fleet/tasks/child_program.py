"""A child process that works on one flight after another, and that may be killed at any moment.

    python -m host.fleet.tasks.child_program MODULE:FUNCTION

Requests come as lines of JSON on stdin, answers go as lines of JSON to stdout. The end of stdin
means that the worker is gone; the child then ends at once.
"""

from __future__ import annotations

import importlib
import json
import os
import queue
import signal
import sys
import threading
from collections.abc import Callable
from typing import Any

from host.errors import HostError

Row = dict[str, Any]


def main(work: str) -> None:
    """Answer requests until stdin ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the worker's to answer
    # Text that a library prints must not get between the answers.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    requests: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests,), daemon=True).start()
    module, _, name = work.partition(":")
    function: Callable[[Row], Row] = getattr(importlib.import_module(module), name)
    _say(answers, {"ready": True})
    while True:
        _say(answers, _answered(function, json.loads(requests.get())))


def _listen(requests: queue.SimpleQueue[str]) -> None:
    for line in sys.stdin:
        requests.put(line)
    os._exit(0)


def _answered(function: Callable[[Row], Row], request: Row) -> Row:
    try:
        return {"row": function(request)}
    except HostError as error:
        return {"refused": str(error)}
    except MemoryError:
        return {"refused": "out of memory"}
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        return {"refused": f"{where}{error.strerror or error}"}
    except Exception as error:  # one bad log must not end the others
        return {"refused": f"internal error: {type(error).__name__}: {error}; please report it"}


def _say(answers: Any, document: Row) -> None:
    answers.write(json.dumps(document) + "\n")
    answers.flush()


if __name__ == "__main__":
    main(sys.argv[1])
