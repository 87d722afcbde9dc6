"""Fetching FatFs: only the archive whose SHA-256 is known gets into a build."""

from __future__ import annotations

import hashlib
import io
import tarfile
from pathlib import Path

import fatfs
import pytest


@pytest.fixture
def clone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Point the module at an empty clone that already has a downloaded archive."""
    monkeypatch.setattr(fatfs, "SOURCES", tmp_path / "build")
    monkeypatch.setattr(fatfs, "DOWNLOADS", tmp_path)
    with tarfile.open(tmp_path / fatfs.ARCHIVE, "w:gz") as tar:
        for name in (*fatfs.MEMBERS, "ffconf.h"):
            member = tarfile.TarInfo(f"fatfs-0.1.2/foreign/fatfs/source/{name}")
            member.size = len(name)
            tar.addfile(member, io.BytesIO(name.encode()))
    return tmp_path


def test_a_changed_archive_is_refused_and_removed(clone: Path) -> None:
    with pytest.raises(fatfs.FetchError, match="SHA-256"):
        fatfs.ensure()
    assert not (clone / fatfs.ARCHIVE).exists()
    assert not (clone / "build").exists()


def test_only_what_is_compiled_is_unpacked(clone: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    digest = hashlib.sha256((clone / fatfs.ARCHIVE).read_bytes()).hexdigest()
    monkeypatch.setattr(fatfs, "ARCHIVE_SHA256", digest)
    folder = fatfs.ensure()
    # An ffconf.h beside ff.h would win over ours in firmware/storage.
    assert sorted(p.name for p in folder.iterdir()) == sorted(fatfs.MEMBERS)
    assert (folder / "ff.c").read_text() == "ff.c"


def test_a_failed_download_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fatfs, "SOURCES", tmp_path / "build")
    monkeypatch.setattr(fatfs, "DOWNLOADS", tmp_path / "downloads")
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path))
    with pytest.raises(fatfs.FetchError, match=r"^pip cannot download fatfs==0\.1\.2: .+$"):
        fatfs.ensure()
