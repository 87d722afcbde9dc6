"""The wheel of ./host, alone in an empty environment outside the clone, decodes a log.

Only the wheel is installed there (`--no-deps`); the dependencies are lent by the interpreter of the
tests through a path file, so that the test needs no 60 MB of downloads. Nothing of the clone is
reachable: the environment, the log and the working folder are elsewhere.
"""

import re
import shutil
import subprocess
import sys
import sysconfig
import venv
from email import message_from_string
from pathlib import Path
from zipfile import ZipFile

from host.twin.recorder import recorder_build

from tests.host.logs import ROOT
from tests.protocol.flights import simple_log


def run(*command: str | Path, cwd: Path, path: str = "/usr/bin:/bin") -> str:
    done = subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
        env={"PATH": path, "HOME": str(cwd), "PIP_DISABLE_PIP_VERSION_CHECK": "1"} | pip_settings(),
    )
    assert done.returncode == 0, done.stderr + done.stdout
    return done.stdout


def pip_settings() -> dict[str, str]:
    """Keep what tells pip where packages come from, and its cache."""
    import os

    cache = Path.home() / ".cache/pip"
    kept = {name: value for name, value in os.environ.items() if name.startswith("PIP_")}
    return {"PIP_CACHE_DIR": str(cache)} | kept


def test_wheel_decodes_a_log_outside_the_clone(tmp_path: Path) -> None:
    run(
        *(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", "dist"),
        ROOT / "host",
        cwd=tmp_path,
    )
    (wheel,) = (tmp_path / "dist").glob("*.whl")
    with ZipFile(wheel) as packed:
        names = packed.namelist()
        pages = {name.rpartition("/")[2] for name in names if "/live/page/" in name}
        assert pages >= {"index.html", "style.css", "main.js", "plots.js", "icon.svg"}
        charts = ROOT / "build" / "uplot"  # fetched by this build, or an earlier one
        for file in charts.glob("*"):
            assert packed.read(f"host/data/uplot/{file.name}") == file.read_bytes()
        if shutil.which("npm", path="/usr/bin:/bin"):
            assert b"MIT" in packed.read("host/data/uplot/LICENSE")
        (metadata,) = (name for name in names if name.endswith("METADATA"))
        needs = message_from_string(packed.read(metadata).decode()).get_all("Requires-Dist", [])
        for name, place in (
            ("host/data/schema.json", "protocol/generated/schema.json"),
            ("host/data/packets.json", "protocol/generated/packets.json"),
            ("host/data/released/ed9c9547.json", "protocol/released/ed9c9547.json"),
            ("host/data/default.toml", "hw/calibration/default.toml"),
            ("host/data/settings.toml", "firmware/settings.toml"),
        ):
            assert packed.read(name) == (ROOT / place).read_bytes()
        for source in recorder_build._all_sources(ROOT):  # which a user's compiler builds
            place = source.relative_to(ROOT).as_posix()
            assert packed.read(f"host/data/recorder/{place}") == source.read_bytes()
    # All that an answer and its pictures need, and nothing larger: 454 MB as pip leaves it.
    core = {re.split(r"[<>=]", need)[0] for need in needs if "extra ==" not in need}
    assert core == {"numpy", "pandas", "scipy", "matplotlib", "construct", "pyserial"}
    env = tmp_path / "env"
    venv.create(env, with_pip=False)
    scripts = env / ("Scripts" if sys.platform == "win32" else "bin")
    run(
        *(sys.executable, "-m", "pip", "--python", scripts / "python", "install", "--quiet"),
        *("--no-deps", "--no-index", wheel),
        cwd=tmp_path,
    )
    place = "import sysconfig; print(sysconfig.get_paths()['purelib'])"
    site = run(scripts / "python", "-c", place, cwd=tmp_path).strip()
    (Path(site) / "lent.pth").write_text(sysconfig.get_paths()["purelib"])
    (tmp_path / "flight.bin").write_bytes(simple_log(2.0).data())
    where = run(scripts / "python", "-c", "import host; print(host.__file__)", cwd=tmp_path)
    assert Path(where.strip()).is_relative_to(env)
    said = run(scripts / "host", "decode", "flight.bin", cwd=tmp_path)
    assert "losses       none" in said
    assert len((tmp_path / "flight.csv").read_text().splitlines()) == 201
    said = run(scripts / "host", "identify", "--method", "list", cwd=tmp_path)
    assert "hopfield-line-search" in said  # plugged in by an entry point


def test_a_clone_without_npm_is_installed_and_its_page_says_what_is_missing(tmp_path: Path) -> None:
    """Built where nothing was fetched before, with an empty PATH; asked before any work."""
    clone = tmp_path / "clone"
    tracked = run("git", "-C", ROOT, "ls-files", "-z", "host", "protocol", "hw/calibration",
                  "firmware", cwd=tmp_path)  # fmt: skip
    for name in filter(None, tracked.split("\0")):
        (clone / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, clone / name)
    run(
        *(sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", "there"),
        clone / "host",
        cwd=tmp_path,
        path="/nowhere",
    )
    assert not (tmp_path / "there/host/data/uplot").exists()
    asked = "import sys; sys.path.insert(0, 'there'); from host import chart_library as c;"
    asked += (
        " from host.cli import main; c._PACKAGE = 'nowhere'; sys.exit(main(['live', 'sim:demo']))"
    )
    done = subprocess.run(
        [sys.executable, "-c", asked], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2, done.stderr
    (line,) = done.stderr.splitlines()
    assert "needs uPlot" in line and "pip install --no-deps uplot-python==1.1.1" in line
