"""What to install where an optional library is missing."""

from __future__ import annotations

import sys

from host.terminal import command_line


def install_hint(library: str | None) -> str:
    """Return the command that installs a library next to this package.

    It names the library itself, which is the same for a wheel and in a clone. ``host[...]`` would
    ask the index for somebody else's package, and so would our own name: we are not on it.

    Parameters
    ----------
    library : str or None
        ``pyarrow``, ``matplotlib`` or ``numba``; its versions are those of our metadata.
    """
    if library is None or library.split(".")[0] == "host":
        return "this package is not whole; install it again"
    return f'{command_line(sys.executable, "-m", "pip", "install")} "{_requirement(library)}"'


def _requirement(library: str) -> str:
    import re
    from importlib import metadata

    try:
        listed = metadata.requires("flight-test-host") or []
    except metadata.PackageNotFoundError:  # run from its sources
        listed = []
    wanted = [one.split(";")[0].strip() for one in listed]
    named = [one for one in wanted if re.split(r"[^\w.-]", one)[0] == library]
    return named[0].replace(" ", "") if named else library
