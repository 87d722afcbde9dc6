"""A card image as a PC sees it: files through mtools, health through fsck.vfat, blocks of a log."""

from __future__ import annotations

import json
import mmap
import re
import struct
import subprocess
from collections.abc import Iterator
from pathlib import Path

from host.wire.extents import data_extents

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


def copy_out(image: Path, name: str, target: Path) -> Path:
    """Copy a file out through directory and FAT as mtools reads them; holes of the image stay.

    mcopy filled them: the firmware prepares 128 MB for a flight, of which a case writes one.

    Raises
    ------
    subprocess.CalledProcessError
        If mtools finds no such file.
    """
    stem, _, extension = name.partition(".")
    listed = re.search(rf"^{stem:<8} {extension:<3} +(\d+) ", _said("mdir", image, name), re.M)
    if listed is None:
        raise AssertionError(f"mdir gives no size of {name}")
    size = int(listed[1])
    with image.open("rb", buffering=0) as card, target.open("wb", buffering=0) as out:
        cluster_blocks, reserved, fats = struct.unpack_from("<BHB", boot := card.read(BLOCK), 13)
        first_lba = reserved + fats * int.from_bytes(boot[36:40], "little") - 2 * cluster_blocks
        done, filled = 0, data_extents(card, image.stat().st_size)
        for run in re.finditer(r"<(\d+)(?:-(\d+))?>", _said("mshowfat", image, name)):
            first, last = int(run[1]), int(run[2] or run[1])
            begin, end = ((first_lba + at * cluster_blocks) * BLOCK for at in (first, last + 1))
            for start, stop in filled:
                if (low := max(start, begin)) < (high := min(stop, end)):
                    card.seek(low)
                    out.seek(done + low - begin)
                    out.write(card.read(high - low))
            done += end - begin
        out.truncate(size)
    return target


def _said(program: str, image: Path, name: str) -> str:
    """Return what a program of mtools says of a file."""
    command = [program, "-i", str(image), f"::{name}"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def read_file(image: Path, name: str, target: Path) -> bytes | mmap.mmap:
    """Copy a file out and give its content."""
    if copy_out(image, name, target).stat().st_size == 0:
        return b""
    with target.open("rb") as file:
        return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)


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
