"""Whether the header of the pilot's settings is that of settings.toml, asked before a build.

A build runs no generator: what a pilot changed in settings.toml and did not generate would
otherwise be uploaded as it was before, without a word.
"""

import subprocess
from pathlib import Path

MISTAKE, OLD = 2, 6  # exit codes of generate_settings.py --check


def complaint(firmware: Path, *, python: str) -> str:
    """Return what is wrong with the settings, in one line; empty if nothing is.

    Parameters
    ----------
    firmware : Path
        The folder that holds generate_settings.py.
    python : str
        The interpreter. One too old for the generator (before 3.11) finds nothing wrong.

    Returns
    -------
    str
        The generator's own words.
    """
    command = [python, str(firmware / "generate_settings.py"), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.stderr.strip() if done.returncode in (MISTAKE, OLD) else ""
