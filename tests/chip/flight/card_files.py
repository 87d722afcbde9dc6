"""A card image as a PC sees it: files through mtools, health through fsck.vfat, blocks of a log."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path

BLOCK = 512


def list_files(image: Path) -> list[str]:
    """Names of the files in the root folder.

    Raises
    ------
    AssertionError
        If mtools cannot read the folder.
    """
    done = subprocess.run(["mdir", "-b", "-i", str(image), "::"], capture_output=True, check=False)
    said = done.stderr.decode(errors="replace")
    if done.returncode != 0 and "File not found" not in said:
        raise AssertionError(f"{image.name} does not mount: {said.strip()}")
    lines = done.stdout.decode(errors="replace").splitlines()
    return [line.strip().removeprefix("::/") for line in lines if line.strip()]


def read_file(image: Path, name: str, target: Path) -> bytes:
    """Copy a file out, through directory and FAT, and give its content."""
    subprocess.run(
        ["mcopy", "-o", "-i", str(image), f"::{name}", str(target)], capture_output=True, check=True
    )
    return target.read_bytes()


def put_file(image: Path, name: str, content: bytes) -> None:
    """Copy a file onto the card as a PC does."""
    subprocess.run(
        ["mcopy", "-o", "-i", str(image), "-", f"::{name}"], input=content, check=True,
        capture_output=True,
    )  # fmt: skip


def findings(image: Path) -> str:
    """What `fsck.vfat -n` finds; empty if nothing."""
    done = subprocess.run(["fsck.vfat", "-n", str(image)], capture_output=True, check=False)
    return done.stdout.decode(errors="replace") if done.returncode else ""


def frames_of(block: bytes, sizes: dict[int, int]) -> Iterator[tuple[int, int]]:
    """Walk the frames of a block; gives time in us and size of each, none of a schema's block.

    Parameters
    ----------
    block : bytes
        512 bytes.
    sizes : dict
        Size of a frame with its id byte, by id.
    """
    used = int.from_bytes(block[24:26], "little")
    at = 28
    while block[26] == 0 and at < 28 + used:
        size = sizes[block[at]]
        yield int.from_bytes(block[at + 1 : at + 5], "little"), size
        at += size


def frame_sizes() -> dict[int, int]:
    """Size of every frame with its id byte, from the schema."""
    text = (
        Path(__file__).resolve().parents[3] / "protocol" / "generated" / "schema.json"
    ).read_text()
    widths = {"u8": 1, "i8": 1, "u16": 2, "i16": 2, "u32": 4, "i32": 4, "f32": 4, "char": 1}
    sizes = {}
    for frame in json.loads(text)["schema"]["frames"]:
        size = 1
        for _, kind, *_ in frame["fields"]:
            base, _, count = kind.partition("[")
            size += widths[base] * int(count.rstrip("]") or 1)
        sizes[frame["id"]] = size
    return sizes
