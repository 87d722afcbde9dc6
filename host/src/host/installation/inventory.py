"""Inventory of libraries, ports, caches and settings, each setting with its origin."""

from __future__ import annotations

import os
import platform
import re
import sys
from dataclasses import asdict, dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any

from host.chart_library import chart_folder, chart_hint, chart_licence
from host.compiled import generated_folders
from host.errors import HostError
from host.extras import install_hint
from host.link.serial import serial_ports
from host.physical.calibration import load_calibration
from host.resources import CLONE, resource, user_cache
from host.twin.recorder import recorder_build

DISTRIBUTION = "flight-test-host"
# Environment variable -> default without it.
VARIABLES = {
    "HOST_SITL": "the recorder's library, see below",
    "HOST_ELF": ".pio/build/mega2560/firmware.elf of a clone, for simulate --firmware avr",
    "HOST_REPLAY": "tests/chip/replay.py of a clone, for simulate --firmware avr",
    "HOST_TRACEBACK": "unset: an internal error is one line",
    "CXX": "c++, g++, clang++ or ziglang, the first that is there",
    "OPENBLAS_NUM_THREADS": "1 in identify, predict, maneuvers, convert",
    "NUMBA_CACHE_DIR": "next to the source, else in the user's cache",
    "XDG_CACHE_HOME": "~/.cache",
    "LOCALAPPDATA": "unset: XDG_CACHE_HOME or ~/.cache",
    "NO_COLOR": "unset: a terminal gets colours, a pipe none",
}


@dataclass(frozen=True, slots=True)
class Library:
    """A library of ours, the extra it belongs to, its version or how to get it."""

    name: str
    extra: str
    version: str
    install: str


@dataclass(frozen=True, slots=True)
class Setting:
    """A setting in force and its origin: the environment, a clone, the package, or none."""

    name: str
    value: str
    origin: str


@dataclass(slots=True)
class Inventory:
    """The whole inventory.

    Attributes
    ----------
    missing : list of str
        Libraries without which nothing works: a broken installation.
    """

    versions: dict[str, str] = field(default_factory=dict)
    libraries: list[Library] = field(default_factory=list)
    compilers: list[str] = field(default_factory=list)
    ports: list[str] = field(default_factory=list)
    caches: dict[str, int] = field(default_factory=dict)
    charts: list[str] = field(default_factory=list)
    settings: list[Setting] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)

    def document(self) -> dict[str, Any]:
        """Return the inventory as plain data."""
        return asdict(self)


def inventory() -> Inventory:
    """Return the inventory of this installation."""
    found = Inventory()
    found.versions = {
        "host": _version(DISTRIBUTION) or "run from its sources",
        "Python": f"{platform.python_version()} ({sys.executable})",
        "system": platform.platform(),
    }
    found.libraries = list(_libraries())
    found.missing = [one.name for one in found.libraries if not (one.extra or one.version)]
    found.compilers = [
        "ziglang" if "ziglang" in command else " ".join(command)
        for command in recorder_build.compilers()
    ]
    found.charts = _charts()
    found.ports = [f"{port.device}  {port.looks_like or port.description}"
                   for port in serial_ports()]  # fmt: skip
    found.caches = {str(place): _size_bytes(place) for place in _caches()}
    found.settings = [*_files(), *_variables()]
    return found


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""


def _libraries() -> list[Library]:
    try:
        wanted = metadata.requires(DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        wanted = []
    found = []
    for one in wanted:
        name = re.split(r"[^\w.-]", one)[0]
        extra = re.search(r"extra == ['\"]([\w-]+)", one)
        if extra and extra[1] == "all":  # it repeats the others
            continue
        version = _version(name)
        hint = "" if version else install_hint(name)
        found.append(Library(name, extra[1] if extra else "", version, hint))
    return found


def _charts() -> list[str]:
    """Return where uPlot and its licence are, or how to get what is missing."""
    folder = chart_folder()
    if folder is None:
        return ["uPlot missing", chart_hint()]
    licence = chart_licence(folder)
    return [f"uPlot {folder}", f"its licence {licence}" if licence else "its licence is missing"]


def _caches() -> list[Path]:
    own = user_cache()
    return [*generated_folders(), *([own] if own is not None else [])]


def _size_bytes(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def _files() -> list[Setting]:
    """Return the files that every verb uses."""
    settings = []
    for name in ("default.toml", "schema.json"):
        path = resource(name)
        settings.append(Setting(name, str(path), _place(path)))
    settings.append(Setting("default calibration", load_calibration().name, _place(path)))
    try:
        library = recorder_build.existing_library()
    except HostError as error:
        return [*settings, Setting("recorder", str(error), "environment")]
    if library is not None:
        origin = "environment" if os.environ.get("HOST_SITL") else _place(library)
        return [*settings, Setting("recorder", str(library), origin)]
    sources = recorder_build.sources()
    said = "no sources: install again" if sources is None else f"built on first use from {sources}"
    return [*settings, Setting("recorder", said, "default")]


def _place(path: Path) -> str:
    if path.is_relative_to(Path(__file__).parents[1]):
        return "package"
    own = user_cache()
    if own is not None and path.is_relative_to(own):
        return "cache"
    return "clone" if path.is_relative_to(CLONE) else "file"


def _variables() -> list[Setting]:
    return [
        Setting(name, os.environ[name], "environment")
        if os.environ.get(name)
        else Setting(name, usual, "default")
        for name, usual in VARIABLES.items()
    ]


def inventory_lines(found: Inventory) -> list[str]:
    """Return the inventory as lines."""
    lines = [f"{name:<13}{text}" for name, text in found.versions.items()]
    for extra in dict.fromkeys(one.extra for one in found.libraries):
        own = [one for one in found.libraries if one.extra == extra]
        said = ", ".join(f"{one.name} {one.version or 'missing'}" for one in own)
        lines.append(f"{f'[{extra}]' if extra else 'libraries':<13}{said}")
        lines += [f"{'':<13}{one.install}" for one in own if one.install]
    lines += [f"{'' if k else 'charts':<13}{one}" for k, one in enumerate(found.charts)]
    lines.append(f"{'compilers':<13}{', '.join(found.compilers) or 'none'}")
    lines += [f"{'port':<13}{port}" for port in found.ports] or [f"{'ports':<13}none"]
    lines += [f"{'cache':<13}{path}  {size / 1e6:.1f} MB" for path, size in found.caches.items()]
    lines += [f"{'setting':<13}{one.name:<22}{one.origin:<12}{one.value}" for one in found.settings]
    return lines
