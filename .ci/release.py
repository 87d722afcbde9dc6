"""`make release`: the wheel, the images of both compilers, a list of parts, and their hashes.

They stand in build/release. The version is the one of host/pyproject.toml; a tree with changes that
are not committed is refused, for nobody could build the same again.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
OUT, TOOLS = ROOT / "build" / "release", ROOT / "build" / "release-tools"
SCRIPTS = Path(sys.executable).parent
COMPILERS = ("7.3.0", "5.4.0")  # what users of PlatformIO get, and Debian's
IMAGES = ("mega2560", "arduimu")


def run(*command: str | Path, **more: str) -> str:
    """Run a command in the clone; return what it printed.

    Raises
    ------
    SystemExit
        With its last lines, if it fails.
    """
    done = subprocess.run(
        [str(word) for word in command], cwd=ROOT, env={**os.environ, **more}, text=True,
        encoding="utf-8", stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
    )  # fmt: skip
    if done.returncode != 0:
        sys.exit(f"release: {' '.join(map(str, command))} failed:\n{done.stdout[-2000:]}")
    return done.stdout


def main() -> int:
    """Build everything; print what is there."""
    if run("git", "status", "--porcelain"):
        sys.exit("release: the tree has changes; commit them, or stash them")
    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    project = tomllib.loads((ROOT / "host" / "pyproject.toml").read_text(encoding="utf-8"))
    version = project["project"]["version"]
    for compiler in COMPILERS:
        environments = [word for name in IMAGES for word in ("-e", name)]
        run(SCRIPTS / "pio", "run", *environments, AVR_GCC=compiler)
        for name in IMAGES:
            made = ROOT / ".pio" / "build" / name / "firmware.hex"
            shutil.copyfile(made, OUT / f"{name}-{version}-gcc{compiler}.hex")
    run(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "./host", "-w", OUT)
    _list_of_parts(OUT / f"parts-{version}.cdx.json")
    files = sorted(path for path in OUT.iterdir() if path.is_file())
    sums = [f"{sha256(path.read_bytes()).hexdigest()}  {path.name}" for path in files]
    (OUT / "SHA256SUMS").write_text("\n".join(sums) + "\n", encoding="utf-8")
    commit = run("git", "rev-parse", "--short", "HEAD").strip()
    print(f"version {version} of {commit}, in {OUT.relative_to(ROOT)}:", *sums, sep="\n")
    return 0


def _list_of_parts(target: Path) -> None:
    """Write what the environment of this clone has installed, by name, version and licence."""
    python = TOOLS / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    if not python.is_file():
        run(sys.executable, "-m", "venv", TOOLS)
    run(python, "-m", "pip", "install", "--quiet", "-r", ROOT / ".ci" / "requirements-release.txt")
    run(python, "-m", "cyclonedx_py", "environment", sys.executable, "-o", target)


if __name__ == "__main__":
    sys.exit(main())
