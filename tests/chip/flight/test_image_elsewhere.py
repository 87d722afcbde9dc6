"""A clone in another folder builds the same image, hash and all."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from both_images import each_image_once
from image_hash import held_hash

ROOT = Path(__file__).resolve().parents[3]
# What a build reads; the local ini names this clone's core folder by its full path.
BUILT_FROM = ("firmware", "protocol", "platformio.ini", "platformio.local.ini")


@pytest.mark.costs(20, "an image is built anew")
@pytest.mark.parametrize("flight_elf", each_image_once([()]), indirect=True)
def test_a_clone_elsewhere_builds_the_same_image(
    flight_elf: Path, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    clone = tmp_path / "another" / "clone"
    clone.mkdir(parents=True)
    for name in filter(lambda name: (ROOT / name).exists(), BUILT_FROM):
        source = ROOT / name
        ignore = shutil.ignore_patterns("__pycache__")
        if source.is_dir():
            shutil.copytree(source, clone / name, ignore=ignore)
        else:
            shutil.copy(source, clone)
    shutil.copytree(ROOT / "tests/firmware", clone / "tests/firmware")
    done = subprocess.run(
        [str(Path(sys.executable).with_name("pio")), "run", "-e", "mega2560"],
        cwd=clone,
        env={
            **os.environ,
            "AVR_GCC": request.node.callspec.params["flight_elf"],
            "PLATFORMIO_BUILD_DIR": str(clone / ".pio" / "build"),
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    built = clone / ".pio" / "build" / "mega2560" / "firmware.elf"
    assert f"{held_hash(built):08x}" == f"{held_hash(flight_elf):08x}"
