"""Try many endings of one run, each in a child process that starts from the state reached."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


class ForkError(RuntimeError):
    """The child ended without a result; the text is what it raised."""


def in_fork(call: Callable[[], T]) -> T:
    """Run a function in a child process and give back what it returns.

    Everything the parent has (chips, devices, cards in memory) is in the child as it was, and what
    the child does to it is forgotten: power cuts at hundreds of instants need one boot.

    Parameters
    ----------
    call : callable
        Runs in the child; its result must be picklable.

    Returns
    -------
    T
        The result.

    Raises
    ------
    ForkError
        If the call raised or the child died.
    """
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        status = 1
        try:
            os.close(reader)
            try:
                answer: tuple[bool, object] = (True, call())
            except BaseException as error:
                answer = (False, f"{type(error).__name__}: {error}")
            with os.fdopen(writer, "wb") as pipe:
                pickle.dump(answer, pipe)
            status = 0
        finally:
            os._exit(status)  # no clean-up of what belongs to the parent
    os.close(writer)
    with os.fdopen(reader, "rb") as pipe:
        data = pipe.read()
    _, status = os.waitpid(child, 0)
    if status != 0 or not data:
        raise ForkError(f"the child ended with status {status}")
    good, result = pickle.loads(data)
    if not good:
        raise ForkError(str(result))
    value: T = result
    return value
