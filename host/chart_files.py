"""Build hook: uPlot's script, style sheet and licence out of npm's package, into the wheel.

Without npm, or out of its registry's reach, the wheel is made without them; a page with charts says
then what to install. What was fetched once stays in the clone's build folder.
"""

from __future__ import annotations

import shutil
import subprocess
import tarfile
import tempfile
from hashlib import sha512
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PACKAGE = "uplot@1.6.16"
SHA512 = (
    "461d16b4582d65d624ef42a7bb55726586f0971e46ba820505ecd9b87c251148"
    "9112c22338aa5edc25cb5cb68a73bff8f59ed7850fdb6b3805fdfd737ab73183"
)
FILES = {
    "uPlot.iife.js": "package/dist/uPlot.iife.min.js",
    "uPlot.min.css": "package/dist/uPlot.min.css",
    "LICENSE": "package/LICENSE",
}
PATIENCE_S = 60


class ChartFiles(BuildHookInterface):  # type: ignore[misc]
    """Puts the files into host/data/uplot."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Fetch what is not there yet; never end a build."""
        del version
        kept = Path(self.root).parent / "build" / "uplot"
        try:
            if not all((kept / name).is_file() for name in FILES):
                fetch(kept)
        except (OSError, subprocess.SubprocessError, tarfile.TarError, KeyError) as error:
            self.app.display_warning(f"without uPlot, pages have no charts: {error}")
            return
        for name in FILES:
            build_data["force_include"][str(kept / name)] = f"host/data/uplot/{name}"


def fetch(into: Path) -> None:
    """Let npm fetch its package, and keep three of its files.

    Raises
    ------
    OSError
        Where there is no npm, or the package is another one.
    """
    npm = shutil.which("npm")  # npm.cmd on Windows
    if npm is None:
        raise OSError("no npm found")
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(
            [npm, "pack", PACKAGE, "--silent", "--fetch-retries=1", "--pack-destination", folder],
            cwd=folder, check=True, timeout=PATIENCE_S, capture_output=True,
        )  # fmt: skip
        (packed,) = Path(folder).glob("*.tgz")
        if sha512(packed.read_bytes()).hexdigest() != SHA512:
            raise OSError(f"npm's {PACKAGE} has another hash than the one that was looked at")
        with tarfile.open(packed) as archive:
            found = {name: archive.extractfile(place) for name, place in FILES.items()}
            texts = {name: file.read() for name, file in found.items() if file is not None}
    into.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (into / name).write_bytes(text)
