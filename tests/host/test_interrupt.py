"""Ctrl-C at any instant from our first line on is one line and exit code 130, never a traceback.

The instant is a count of function calls, not a time: a profiler that is there before the program
presses Ctrl-C at the n-th call. What comes before the first line of `host` is the interpreter's.
"""

import os
import random
import subprocess
import sys
from pathlib import Path

import pytest

from tests.host.logs import flight, written

# Python runs this module of a folder on its path before the program.
PRESS = """
import os, signal, sys
at = int(os.environ["PRESS_AT"])
count = 0
begun = False

def watch(frame, event, argument):
    global count, begun
    code = frame.f_code
    if not begun:  # from the first line of host.__main__.run on
        begun = code.co_name == "run" and code.co_filename.endswith("host/__main__.py")
        return
    count += 1
    if count == at:
        sys.setprofile(None)
        signal.raise_signal(signal.SIGINT)
    elif event == "return" and code.co_name == "run" and not at:
        sys.setprofile(None)
        os.write(2, b"calls %d" % count)

sys.setprofile(watch)
"""
SCRIPT = ("-c", "import sys; from host.__main__ import run; sys.exit(run())")  # what pip writes
MODULE = ("-m", "host")


def pressed(folder: Path, at: int, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the program and press Ctrl-C at one of its calls."""
    hook = folder / "hook"
    hook.mkdir(exist_ok=True)
    (hook / "sitecustomize.py").write_text(PRESS)
    return subprocess.run(
        [sys.executable, *arguments],
        env={**os.environ, "PYTHONPATH": str(hook), "PRESS_AT": str(at)},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("program", [SCRIPT, MODULE], ids=["script", "module"])
@pytest.mark.parametrize(
    ("verb", "instants"), [(("info", "flight.bin"), 14), (("decode", "flight.bin"), 6)]
)
def test_ctrl_c_at_any_call(
    program: tuple[str, ...], verb: tuple[str, ...], instants: int, tmp_path: Path
) -> None:
    (tmp_path / "flight.bin").write_bytes(written(*flight(0.5)))
    whole = pressed(tmp_path, 0, *program, *verb)
    assert whole.returncode == 0, whole.stderr
    calls = int(whole.stderr.rsplit("calls ", 1)[1])
    # The first calls one by one, where the program has not begun; the others drawn, each program
    # its own.
    drawn = random.Random(14 + len(program[1])).sample(range(8, calls - 4), instants - 4)
    for at in (1, 2, 3, 5, *drawn):
        done = pressed(tmp_path, at, *program, *verb)
        said = f"call {at} of {calls}: {done.returncode} {done.stderr}"
        assert done.returncode == 130, said
        assert done.stderr.strip().splitlines()[-1] == "host: interrupted", said
        assert "Traceback" not in done.stderr, said
        assert "Exception ignored" not in done.stderr, said
