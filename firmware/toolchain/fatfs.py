"""Fetch ChaN's FatFs once, check it, and say where its sources are.

The sources come from the PyPI sdist `fatfs` 0.1.2 (FatFs R0.15, BSD-style
licence), because PyPI is reachable wherever pip is. Only the files that are
compiled are unpacked: the ffconf.h of the sdist would shadow ours in
firmware/storage, since ff.h looks for it beside itself first.

Run as a program it prints the folder.
"""

from __future__ import annotations

import argparse
import hashlib
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "build" / "fatfs-0.1.2"
DOWNLOADS = ROOT / ".cache" / "downloads"

REQUIREMENT = "fatfs==0.1.2"
ARCHIVE = "fatfs-0.1.2.tar.gz"
ARCHIVE_SHA256 = "824c7679bc6d25c462b465faf177f81009711cff9bf3001b2a91f9c5bfa5c589"
MEMBERS = ("ff.c", "ff.h", "diskio.h")
_IN_ARCHIVE = "fatfs-0.1.2/foreign/fatfs/source/"


class FetchError(Exception):
    """FatFs could not be fetched, or is not the archive it should be."""


def ensure(*, python: str = sys.executable) -> Path:
    """Return the folder with ff.c, ff.h and diskio.h, fetching them if need be.

    Parameters
    ----------
    python : str
        The interpreter whose pip fetches the archive.

    Returns
    -------
    Path
        Folder inside the clone's build folder.

    Raises
    ------
    FetchError
        If pip fails or the SHA-256 differs.
    """
    if all((SOURCES / name).is_file() for name in MEMBERS):
        return SOURCES
    archive = DOWNLOADS / ARCHIVE
    if not archive.is_file():
        _download(python)
    found = hashlib.sha256(archive.read_bytes()).hexdigest()
    if found != ARCHIVE_SHA256:
        archive.unlink()
        raise FetchError(f"{ARCHIVE}: SHA-256 is {found}, expected {ARCHIVE_SHA256}; removed it")
    SOURCES.mkdir(parents=True, exist_ok=True)
    with tarfile.open(archive) as tar:
        for name in MEMBERS:
            member = tar.extractfile(_IN_ARCHIVE + name)
            if member is None:
                raise FetchError(f"{ARCHIVE}: {name} is not a file")
            # Written beside and renamed: two builds may run at the same time.
            with tempfile.NamedTemporaryFile(dir=SOURCES, delete=False) as part:
                part.write(member.read())
            Path(part.name).replace(SOURCES / name)
    return SOURCES


def _download(python: str) -> None:
    DOWNLOADS.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=DOWNLOADS) as folder:
        command = [python, "-m", "pip", "download", "--quiet", "--disable-pip-version-check"]
        command += ["--no-deps", "--no-binary", "fatfs", "--dest", folder, REQUIREMENT]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            tail = done.stderr.strip().splitlines()[-1:] or ["no message"]
            raise FetchError(f"pip cannot download {REQUIREMENT}: {tail[0]}")
        (Path(folder) / ARCHIVE).replace(DOWNLOADS / ARCHIVE)


def main() -> int:
    """Print the folder of the sources; 1 if they cannot be had."""
    parser = argparse.ArgumentParser(description="Fetch FatFs and print the folder of its sources.")
    parser.parse_args()
    try:
        print(ensure())
    except FetchError as error:
        print(f"fatfs: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
