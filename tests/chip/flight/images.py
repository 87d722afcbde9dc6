"""The images a user builds and uploads, by the commands a user types."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from compilers import CHOICE, TESTED

if TYPE_CHECKING:
    from simavr_bench.pty_bridge import PtyBridge

ROOT = Path(__file__).resolve().parents[3]
# Build folders of its own, one per compiler: other work may be building the same image.
BUILD = ROOT / "build" / "chip" / "flight" / "pio"


def _command(environment: str, *options: str) -> list[str]:
    return [str(Path(sys.executable).with_name("pio")), "run", "-e", environment, *options]


def _variables(compiler: str) -> dict[str, str]:
    return {**os.environ, "PLATFORMIO_BUILD_DIR": str(BUILD / compiler), CHOICE: compiler}


def usual_compiler() -> str:
    """Return the compiler of what is flown with one only: AVR_GCC, else the distribution's."""
    return os.environ.get(CHOICE) or TESTED[0]


def build_image(environment: str, compiler: str | None = None) -> Path:
    """Build the image that `pio run` makes, once in a process.

    Parameters
    ----------
    environment : str
        Environment of platformio.ini: ``mega2560`` or ``arduimu``.
    compiler : str, optional
        One of ``compilers.TESTED``; the usual one if none is named.

    Returns
    -------
    Path
        The ELF.

    Raises
    ------
    RuntimeError
        If the build fails; the text is its last lines.
    """
    return _built(environment, compiler or usual_compiler())


@cache
def _built(environment: str, chosen: str) -> Path:
    done = subprocess.run(
        _command(environment),
        cwd=ROOT,
        env=_variables(chosen),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        said = f"{done.stdout[-2000:]}{done.stderr}"
        raise RuntimeError(
            f"building the image {environment} with avr-gcc {chosen} failed:\n{said}"
        )
    return BUILD / chosen / environment / "firmware.elf"


def upload(environment: str, bridge: PtyBridge) -> str:
    """Run PlatformIO's upload to the terminal of a chip and give what it says."""
    with subprocess.Popen(
        _command(environment, "-t", "upload", "--upload-port", bridge.path),
        cwd=ROOT,
        env=_variables(usual_compiler()),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    ) as running:
        try:
            bridge.serve(lambda: running.poll() is not None, limit_s=240.0)
        except BaseException:
            os.killpg(running.pid, signal.SIGKILL)  # avrdude too, which would run on alone
            raise
        said: str = running.communicate()[0]
        assert running.returncode == 0, said
    return said
