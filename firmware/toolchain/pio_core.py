"""Make `pio` work where PlatformIO's registry cannot be reached.

Asks the registry once. If it answers, nothing is written (an earlier
platformio.local.ini is removed) and PlatformIO installs its own packages. If
not, fills a core folder inside the clone with two small local platforms and
a bridge to PyPI's SCons, and writes the untracked platformio.local.ini that
points there. The user's own PlatformIO folder is neither read nor written.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import urllib.request
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SHIPPED = Path(__file__).resolve().parent / "pio"
CORE = ROOT / ".cache" / "platformio"
LOCAL_INI = ROOT / "platformio.local.ini"

REGISTRY = "https://api.registry.platformio.org/v3/packages/platformio/platform/native"
REGISTRY_TIMEOUT_S = 5

LOCAL_INI_TEXT = """\
; Written by firmware/toolchain/pio_core.py: PlatformIO's registry did not answer.
; Delete this file to use the registry.
[platformio]
core_dir = {core}
; Named as well, because the variable PLATFORMIO_CORE_DIR overrules core_dir.
platforms_dir = {core}/platforms
packages_dir = {core}/packages

[env:native]
; Debian's doctest header instead of the registry's library.
test_framework = custom
"""

# With an expired check PlatformIO waits 61 s for its registry after each command.
STATE = {
    "settings": {
        "check_platformio_interval": 36500,
        "check_prune_system_threshold": 0,
        "enable_telemetry": False,
    }
}


def registry_answers() -> bool:
    """Ask for one known package; False after REGISTRY_TIMEOUT_S at the latest.

    A child process asks, because looking up a name has no timeout of its own.
    """
    ask = [sys.executable, __file__, "--ask"]
    try:
        done = subprocess.run(ask, timeout=REGISTRY_TIMEOUT_S, capture_output=True, check=False)
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def ask_registry() -> int:
    """Return 0 if the registry names the package asked for, else 1."""
    try:
        with urllib.request.urlopen(REGISTRY, timeout=REGISTRY_TIMEOUT_S) as reply:
            answer = json.load(reply)
    except (OSError, ValueError):
        return 1
    return 0 if isinstance(answer, dict) and answer.get("name") == "native" else 1


def pio_version(scons_version: str) -> str:
    """Write a SCons version as PlatformIO's registry does: 4.11.1 becomes 4.41101.0."""
    major, minor, patch = (int(part) for part in scons_version.split("."))
    return f"{major}.{major}{minor:02d}{patch:02d}.0"


def fill_core() -> None:
    """Copy the local platforms and the SCons bridge, each with the note of its owner.

    Raises
    ------
    SystemExit
        If PlatformIO wants another SCons than the one installed.
    """
    for source in sorted((SHIPPED / "platforms").iterdir()):
        manifest = json.loads((source / "platform.json").read_text(encoding="utf-8"))
        _install(source, CORE / "platforms" / source.name, "platform", manifest["version"])

    scons = pio_version(version("scons"))
    target = CORE / "packages" / "tool-scons"
    _install(SHIPPED / "tool-scons", target, "tool", scons)
    package = target / "package.json"
    package.write_text(package.read_text(encoding="utf-8").replace("VERSION", scons))
    _require_accepted(scons)

    state = CORE / "appstate.json"
    known = json.loads(state.read_text(encoding="utf-8")) if state.is_file() else {}
    state.write_text(json.dumps(known | STATE))


def _install(source: Path, target: Path, kind: str, package_version: str) -> None:
    if target.exists():
        shutil.rmtree(target)
    shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
    # Without this note the package has no owner, and PlatformIO asks the registry for it.
    spec = dict.fromkeys(("id", "requirements", "uri")) | {
        "owner": "platformio",
        "name": target.name,
    }
    note = {"type": kind, "name": target.name, "version": package_version, "spec": spec}
    (target / ".piopm").write_text(json.dumps(note))


def _require_accepted(scons: str) -> None:
    from platformio.dependencies import get_core_dependencies
    from semantic_version import SimpleSpec, Version

    wanted = get_core_dependencies()["tool-scons"]
    if Version(scons) not in SimpleSpec(wanted):
        sys.exit(
            f"platformio {version('platformio')} wants tool-scons {wanted}, "
            f"found SCons {version('scons')} ({scons}): "
            "pin the matching pair in .ci/requirements.txt"
        )


def main() -> int:
    """Decide between the registry and the local core folder, and say which."""
    parser = argparse.ArgumentParser(description="Make pio work with or without its registry.")
    parser.add_argument("--ask", action="store_true", help="only ask the registry: exit 0 or 1")
    if parser.parse_args().ask:
        return ask_registry()

    if registry_answers():
        LOCAL_INI.unlink(missing_ok=True)
        print("PlatformIO: its registry answers; it will fetch its own packages")
        return 0
    CORE.mkdir(parents=True, exist_ok=True)
    fill_core()
    LOCAL_INI.write_text(LOCAL_INI_TEXT.format(core=CORE.as_posix()), encoding="utf-8")
    print(f"PlatformIO: no registry; local packages in {CORE.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
