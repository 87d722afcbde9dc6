"""Who may know whom: the table of rooms, held against every include and import.

The same functions run on the clone and on small trees with one planted breach
each, so that a rule that never bites is found out.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

STANDARD = {"<stdint.h>", "<stddef.h>", "<string.h>"}

# Folders below firmware/ (and protocol/generated) each room may include from, and single headers.
ROOMS: dict[str, tuple[set[str], set[str]]] = {
    "core": ({"core", "generated"}, STANDARD),
    "hal": (set(), STANDARD - {"<string.h>"}),
    "drivers": ({"core", "generated", "hal", "drivers"}, STANDARD),
    "storage": ({"core", "generated", "hal", "drivers", "storage"}, STANDARD),
    "app": ({"core", "generated", "hal", "drivers", "storage", "app"}, STANDARD),
    "imu": ({"core", "generated", "hal", "drivers", "imu"}, STANDARD),
}
# Folders of firmware/boards that boards with the same kind of chip share. They know no board.
SHARED_BOARDS = {"avr"}
CPP_SUFFIXES = {".h", ".cpp", ".c"}
INCLUDE = re.compile(r'^\s*#\s*include\s*(<[^>]+>|"[^"]+"|\S+)', re.MULTILINE)

# What the recording path does without: heap, virtual calls, exceptions, floats, the C++ library.
BANNED = re.compile(r"\b(virtual|new|malloc|calloc|realloc|throw|float|double)\b|\bstd::")
# Once a second, in slices, off the recording path: the solve of the learning.
WITH_FLOATS = Path("firmware/core/learning")
COMMENT = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.DOTALL)

OUTSIDE = {"tests", "protocol", "firmware", "hw", "simavr", "pytest", "hypothesis"}
# Python packages of this tree; a room names those it must not import.
FORBIDDEN_IMPORTS = {
    "host/src": {"studies", *OUTSIDE},
    "host/studies": OUTSIDE,
    "protocol": {"host", "tests", "firmware", "hw"},
    "hw": {"host", "tests", "firmware"},
    "firmware": {"host", "tests", "hw"},
    # A product of its own: it knows no image of ours, nor what flies them.
    "tests/simulator": {"host", "protocol", "flight", "imu", "hal", "devices", "replay"},
}
# Nor does it read what describes them.
OURS = re.compile(r"frames\.toml|pin_map|settings\.toml|\.pio\b")

# Rooms inside the host package, from the ground up: each may import those before it.
HOST_FLOORS: dict[str, tuple[str, ...]] = {
    "host": (
        *("files", "wire", "physical", "export", "original", "link", "log", "readers", "decode"),
        *("aircraft", "instrument", "bench_calibration", "twin", "sysid", "thesis"),
        *("planning", "control", "installation", "live", "preflight", "report", "fleet", "verbs"),
    ),
    "host.fleet": ("statistics", "sources", "tasks", "dataset", "pages", "runs"),
    "host.twin": ("faults", "testcard", "flight", "sensors", "ground", "recorder", "outcome"),
    "host.sysid": (
        *("expressions", "models", "numerics", "estimators", "aerodynamics", "conversion"),
        *("reconstruction", "maneuvers", "checks", "flight", "errors", "validation"),
        *("linear", "coefficients", "answer", "pipeline"),
    ),
}
# Length of a function of `host.verbs`, in lines without its docstring; and what only work needs.
VERB_BODY = 60
COMPUTING = {"numpy", "pandas", "scipy", "numba", "matplotlib"}
# Modules outside the rooms that start programs or give the package its names.
PROGRAMS = {"__init__", "__main__", "cli", "virtual"}
# Whatever the order above: the virtual flight and identification meet in `planning` and in the
# studies only, what is physics knows no test card.
HOST_NEVERS = (
    ("host.sysid", "host.twin"),
    ("host.twin.sensors", "host.twin.testcard"),
    ("host.sysid.linear", "host.sysid.coefficients"),
    ("host.sysid.coefficients", "host.sysid.linear"),
)

# Constants of physics and geometry with one owner, and how near to one a number is that means it.
CONSTANTS = "host/src/host/constants.py"
SYSID = "host/src/host/sysid"
KNOWN_NUMBERS = {
    "GRAVITY_MPS2": 9.80665,
    "DEG_PER_RAD": 180.0 / math.pi,
    "RAD_PER_DEG": math.pi / 180.0,
    "NORMAL_95": 1.96,
}
NEAR = 1e-3
# Names that a room of sysid offers; and imports of its modules by path from outside of sysid, by
# file and module: that number only falls, whoever leaves fewer lowers it.
MOST_FACE_NAMES = 12
INNER_IMPORTS = 290
# Files that every package may have.
COMMON_NAMES = {"__init__.py", "__main__.py"}


def include_breaches(root: Path) -> Iterator[str]:
    """Yield a line for every include of a firmware room that the table does not allow."""
    for room, (folders, headers) in ROOMS.items():
        for path in _files(root / "firmware" / room, CPP_SUFFIXES):
            for name in INCLUDE.findall(path.read_text(encoding="utf-8")):
                folder = name.strip('"').split("/")[0] if "/" in name else None
                if name in headers or (name.startswith('"') and folder in folders):
                    continue
                if path.name == "ffconf.h":
                    continue
                yield f"{path.relative_to(root)}: {room} may not include {name}"


def board_breaches(root: Path) -> Iterator[str]:
    """Yield a line for every board that includes another one; what boards share is not one."""
    for board in _folders(root / "firmware" / "boards"):
        for path in _files(board, CPP_SUFFIXES):
            for name in INCLUDE.findall(path.read_text(encoding="utf-8")):
                other = re.match(r'"boards/(\w+)/', name)
                if other and other[1] not in {board.name, *SHARED_BOARDS}:
                    yield f"{path.relative_to(root)}: {board.name} may not include {name}"


def word_breaches(root: Path) -> Iterator[str]:
    """Yield a line for every word the recording path does without."""
    for room in ROOMS:
        for path in _files(root / "firmware" / room, CPP_SUFFIXES):
            for number, line in enumerate(_code(path).splitlines(), start=1):
                place = path.relative_to(root)
                for found in BANNED.finditer(line):
                    if found[0] != "float" or WITH_FLOATS not in place.parents:
                        yield f"{place}:{number}: no {found[0]} in {room}"


def suite_breaches(root: Path) -> Iterator[str]:
    """Yield a line for every suite that uses more of doctest than check.h offers the AVR."""
    more = re.compile(
        r"\b(SUBCASE|TEST_SUITE\w*|TEST_CASE_\w+|CHECK_(?!EQ\b)[A-Z]\w*|REQUIRE_\w+|"
        r"WARN(_\w+)?|INFO|CAPTURE|FAIL(_CHECK)?|MESSAGE)\s*\(|\bdoctest\b"
    )
    for suite in _folders(root / "tests" / "firmware"):
        if suite.name.startswith("test_native_"):
            continue  # never built for the AVR
        for path in _files(suite, CPP_SUFFIXES):
            for number, line in enumerate(_code(path, keep_strings=True).splitlines(), start=1):
                found = more.search(line)
                if found:
                    yield f"{path.relative_to(root)}:{number}: {found[0]} is not in check.h"


def import_breaches(root: Path) -> Iterator[str]:
    """Yield a line for every Python import that crosses the table."""
    for folder, forbidden in FORBIDDEN_IMPORTS.items():
        for path in _files(root / folder, {".py"}):
            for number, module in _imports(path):
                if module.split(".")[0] in forbidden:
                    yield f"{path.relative_to(root)}:{number}: may not import {module}"


def floor_breaches(root: Path) -> Iterator[str]:
    """Yield a line for every room of the host package that imports one above it."""
    for package, floors in HOST_FLOORS.items():
        base = root / "host" / "src" / Path(*package.split("."))
        for path in _files(base, {".py"}):
            room = _room(path.relative_to(base))
            # A module outside the rooms (errors, resources) is the ground they stand on, but for
            # those that start programs.
            floor = floors.index(room) + 1 if room in floors else 0
            above = set(floors[floor:]) if room not in PROGRAMS else set()
            for number, module in _imports(path):
                rest = module.removeprefix(f"{package}.")
                if rest != module and rest.split(".")[0] in above:
                    yield f"{path.relative_to(root)}:{number}: {room} may not import {module}"


def never_breaches(root: Path) -> Iterator[str]:
    """Yield a line for every import between rooms that never know each other."""
    for reader, hidden in HOST_NEVERS:
        for path in _files(root / "host" / "src" / Path(*reader.split(".")), {".py"}):
            for number, module in _imports(path):
                if module == hidden or module.startswith(f"{hidden}."):
                    yield f"{path.relative_to(root)}:{number}: {reader} may not import {module}"


def link_breaches(root: Path) -> Iterator[str]:
    """Yield a line for every host file that names the chip simulator's library (GPL)."""
    for path in _files(root / "host" / "src", {".py"}):
        if "libsimavr" in path.read_text(encoding="utf-8"):
            yield f"{path.relative_to(root)}: the simulator is a program of its own, never linked"


def simulator_breaches(root: Path) -> Iterator[str]:
    """Yield a line where the simulator names a file that describes our images."""
    for path in _files(root / "tests" / "simulator", {".py", ".c", ".h"}):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            if found := OURS.search(line):
                yield f"{path.relative_to(root)}:{number}: the simulator may not know {found[0]}"


def verb_breaches(root: Path) -> Iterator[str]:
    """Yield a line for every verb that works: a long body, or a library that computes."""
    for path in _files(root / "host" / "src" / "host" / "verbs", {".py"}):
        tree, name = ast.parse(path.read_text(encoding="utf-8")), path.relative_to(root)
        for node in ast.walk(tree):
            if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                continue
            body = node.body[1:] if ast.get_docstring(node) is not None else node.body
            size = (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0
            if size > VERB_BODY:
                more = f"{size} lines of body, at most {VERB_BODY}: arguments and printing only"
                yield f"{name}:{node.lineno}: {node.name} has {more}"
        for number, module in _imports(path):
            if module.split(".")[0] in COMPUTING:
                yield f"{name}:{number}: a verb does no work: may not import {module}"


def basename_breaches(root: Path) -> Iterator[str]:
    """Yield a line for every file of package and studies whose name another room has too."""
    first: dict[str, Path] = {}
    for path in _files(root / "host", {".py"}):
        if path.name in COMMON_NAMES:
            continue
        if path.name in first:
            other = first[path.name].relative_to(root)
            yield f"{path.relative_to(root)}: {other} has the same name; say which each is"
        else:
            first[path.name] = path


def constant_breaches(root: Path) -> Iterator[str]:
    """Yield a line for every number that `host.constants` has, typed again."""
    for path in _files(root / "host", {".py"}) + _files(root / "tests" / "bench", {".py"}):
        name = str(path.relative_to(root))
        if name == CONSTANTS:
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.expr):
                for constant in _constants_in(node):
                    yield f"{name}:{node.lineno}: host.constants has {constant}"


def face_breaches(root: Path) -> Iterator[str]:
    """Yield a line for every face that offers too many names, or one that a module hides."""
    for path in sorted((root / SYSID).glob("*/__init__.py")):
        names = _offered(ast.parse(path.read_text(encoding="utf-8")))
        place = path.relative_to(root)
        if len(names) > MOST_FACE_NAMES:
            yield f"{place}: offers {len(names)} names, at most {MOST_FACE_NAMES}"
        for name in names:
            if (path.parent / f"{name}.py").is_file():
                yield f"{place}: {name} is a module too, which hides it once it is imported"


def inner_imports(root: Path) -> set[tuple[str, str]]:
    """Return file and module of every import from outside of sysid that passes a face by."""
    found = set()
    for folder in ("host/src", "host/studies", "tests"):
        for path in _files(root / folder, {".py"}):
            if (root / SYSID) in path.parents or "host.sysid." not in path.read_text("utf-8"):
                continue
            for _, module in _imports(path):
                inside = module.split(".")[2:4] if module.startswith("host.sysid.") else []
                if len(inside) == 2 and (root / SYSID / inside[0] / f"{inside[1]}.py").is_file():
                    found.add((str(path.relative_to(root)), ".".join(inside)))
    return found


RULES = (
    face_breaches,
    basename_breaches,
    constant_breaches,
    verb_breaches,
    include_breaches,
    board_breaches,
    word_breaches,
    suite_breaches,
    import_breaches,
    floor_breaches,
    never_breaches,
    link_breaches,
    simulator_breaches,
)


def _offered(tree: ast.Module) -> list[str]:
    """Return the names in `__all__` of a package."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return list(ast.literal_eval(node.value))
    return []


def _constants_in(node: ast.expr) -> Iterator[str]:
    """Yield the constant that a number (or its thousandth) or a quotient with pi repeats."""
    if isinstance(node, ast.Constant) and isinstance(node.value, float) and node.value != 0.0:
        for name, value in KNOWN_NUMBERS.items():
            decades = round(math.log10(abs(node.value) / value))
            if decades in (-3, 0, 3) and abs(abs(node.value) / value / 10.0**decades - 1.0) < NEAR:
                yield name
    elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div):
        for above, below in ((node.left, node.right), (node.right, node.left)):
            if _is_pi(above) and isinstance(below, ast.Constant) and below.value == 180:
                yield "DEG_PER_RAD" if above is node.right else "RAD_PER_DEG"


def _is_pi(node: ast.expr) -> bool:
    return isinstance(node, ast.Attribute) and node.attr == "pi"


def _files(folder: Path, suffixes: set[str]) -> list[Path]:
    return sorted(p for p in folder.rglob("*") if p.suffix in suffixes and p.is_file())


def _folders(folder: Path) -> list[Path]:
    return sorted(p for p in folder.iterdir() if p.is_dir()) if folder.is_dir() else []


def _code(path: Path, *, keep_strings: bool = False) -> str:
    """Blank out comments and strings, keeping the line numbers."""

    def blank(found: re.Match[str]) -> str:
        if keep_strings and found[0].startswith('"'):
            return found[0]
        return "\n" * found[0].count("\n")

    return COMMENT.sub(blank, path.read_text(encoding="utf-8"))


def _room(inside: Path) -> str:
    """Return the folder or module a file is, seen from its package."""
    return inside.parts[0].removesuffix(".py")


def _imports(path: Path) -> tuple[tuple[int, str], ...]:
    """Return line and module of every import: in functions, relative ones and those by name too."""
    return _imports_in(path.read_text(encoding="utf-8"), path)


@cache  # four rules ask for those of the package
def _imports_in(text: str, path: Path) -> tuple[tuple[int, str], ...]:
    return tuple(_found_imports(ast.parse(text), path))


def _found_imports(tree: ast.Module, path: Path) -> Iterator[tuple[int, str]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, name.name) for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            if node.level:
                inside = path.parts.index("src") + 1 if "src" in path.parts else len(path.parts)
                folders = path.parts[inside:-1]
                kept = folders[: len(folders) - node.level + 1]
                module = ".".join((*kept, *filter(None, [module])))
            yield from ((node.lineno, f"{module}.{name.name}") for name in node.names)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else node.func
            name = called.id if isinstance(called, ast.Name) else called
            if name in ("import_module", "__import__"):
                yield node.lineno, str(node.args[0].value)


def test_rooms_of_sysid_are_entered_by_their_faces() -> None:
    assert len(inner_imports(ROOT)) <= INNER_IMPORTS, "import what a face offers from the face"


def test_an_import_that_passes_a_face_by_is_counted(tmp_path: Path) -> None:
    models = tmp_path / SYSID / "models"
    models.mkdir(parents=True)
    (models / "maneuver.py").write_text("from host.sysid.models.maneuver import Maneuver")
    study = tmp_path / "host/studies/flown.py"
    study.parent.mkdir()
    study.write_text("from host.sysid.models import Maneuver\nimport host.sysid.models")
    assert inner_imports(tmp_path) == set()
    for text in ("from host.sysid.models.maneuver import A, B", "import host.sysid.models.maneuver",
                 "from host.sysid.models import maneuver"):  # fmt: skip
        study.write_text(text)
        assert inner_imports(tmp_path) == {("host/studies/flown.py", "models.maneuver")}


def test_a_face_of_too_many_names_or_of_a_module_is_found(tmp_path: Path) -> None:
    face = tmp_path / SYSID / "models/__init__.py"
    face.parent.mkdir(parents=True)
    (face.parent / "maneuver.py").touch()
    face.write_text(f"__all__ = {[f'a{k}' for k in range(13)]}")
    assert "offers 13 names" in "".join(face_breaches(tmp_path))
    face.write_text('__all__ = ["maneuver"]')
    assert "maneuver is a module too" in "".join(face_breaches(tmp_path))


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_clone_keeps_the_table(rule: object) -> None:
    assert callable(rule)
    assert "\n".join(rule(ROOT)) == ""


PLANTED = [
    (constant_breaches, "host/src/host/twin/sensors/imu.py", "G = 9.81"),
    (constant_breaches, "host/src/host/twin/sensors/imu.py", "MG = 9.80665e-3"),
    (constant_breaches, "host/src/host/sysid/answer/verdict.py", "x = f'{1.0 * 57.29578:.1f}'"),
    (constant_breaches, "host/src/host/sysid/answer/verdict.py", "half = -1.959964 * 0.1"),
    (constant_breaches, "host/studies/coefficients.py", "half = 1.96 * 0.1"),
    (constant_breaches, "tests/bench/identification.py", "half = 1.96 * 0.1"),
    (constant_breaches, "host/src/host/aircraft/air.py", "turn = 180 / np.pi"),
    (constant_breaches, "host/src/host/aircraft/air.py", "turn = math.pi / 180.0"),
    (include_breaches, "firmware/core/relay.h", '#include "hal/relay.h"'),
    (include_breaches, "firmware/core/relay.h", "#include <avr/io.h>"),
    (include_breaches, "firmware/core/relay.h", '#include "failsafe.h"'),
    (include_breaches, "firmware/core/deep/relay.cpp", "  #  include <vector>"),
    (include_breaches, "firmware/core/relay.h", "#include SOME_MACRO"),
    (include_breaches, "firmware/hal/clock.h", '#include "core/time.h"'),
    (include_breaches, "firmware/drivers/bmp085.h", '#include "app/recorder.h"'),
    (include_breaches, "firmware/drivers/sd_card.h", '#include "ff.h"'),
    (include_breaches, "firmware/storage/volume.cpp", '#include "app/recorder.h"'),
    (include_breaches, "firmware/app/recorder.cpp", '#include "ff.h"'),
    (include_breaches, "firmware/app/recorder.cpp", '#include "boards/mega2560/pins.h"'),
    (include_breaches, "firmware/imu/unit.cpp", '#include "app/text_out.h"'),
    (include_breaches, "firmware/imu/unit.cpp", "#include <avr/io.h>"),
    (include_breaches, "firmware/core/imu/node.cpp", '#include "drivers/mpu6000.h"'),
    (include_breaches, "firmware/core/imu/console.cpp", '#include "imu/unit.h"'),
    (board_breaches, "firmware/boards/sitl/clock.cpp", '#include "boards/mega2560/pins.h"'),
    (board_breaches, "firmware/boards/avr/eeprom.cpp", '#include "boards/mega2560/board.h"'),
    (word_breaches, "firmware/core/relay.h", "virtual void tick();"),
    (word_breaches, "firmware/app/recorder.cpp", "uint8_t* ring = new uint8_t[512];"),
    (word_breaches, "firmware/app/recorder.cpp", "const float alpha_rad = 0;"),
    (word_breaches, "firmware/core/learning/solve.cpp", "const float a = 0; double b = a;"),
    (suite_breaches, "tests/firmware/test_relay/test_relay.cpp", 'SUBCASE("late") {}'),
    (suite_breaches, "tests/firmware/test_relay/test_relay.cpp", "CHECK_FALSE(late);"),
    (suite_breaches, "tests/firmware/test_relay/test_relay.cpp", "#include <doctest/doctest.h>"),
    (import_breaches, "host/src/host/decode.py", "from tests.sitl import demo"),
    (import_breaches, "host/src/host/decode.py", "def f():\n    import protocol.generate"),
    (import_breaches, "protocol/generate.py", "import host.wire.schema"),
    (floor_breaches, "host/src/host/wire/blocks.py", "from host.physical.table import rows"),
    (
        floor_breaches,
        "host/src/host/sysid/models/state_space_model.py",
        "import host.sysid.maneuvers.maneuver_detection",
    ),
    (
        floor_breaches,
        "host/src/host/aircraft/air.py",
        "def f():\n    from host.twin.flight import fly",
    ),
    (floor_breaches, "host/src/host/aircraft/trim.py", "from host.instrument import errors"),
    (
        floor_breaches,
        "host/src/host/instrument/instrument_errors.py",
        "from host.sysid import Maneuver",
    ),
    (
        floor_breaches,
        "host/src/host/twin/flight/fly.py",
        "import host.sysid.models.state_space_model",
    ),
    (floor_breaches, "host/src/host/twin/flight/fly.py", "from ...sysid.models import model"),
    (floor_breaches, "host/src/host/twin/flight/fly.py", 'import_module("host.sysid.models")'),
    (
        floor_breaches,
        "host/src/host/sysid/linear/linear_estimator.py",
        "from host.planning import card_planning",
    ),
    (floor_breaches, "host/src/host/errors.py", "from host.aircraft.file import AircraftError"),
    (
        never_breaches,
        "host/src/host/sysid/aerodynamics/varying_airspeed.py",
        "def f():\n    if True:\n        from host.twin.flight.fly import fly",
    ),
    (
        never_breaches,
        "host/src/host/sysid/answer/truth_comparison.py",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from host import twin",
    ),
    (never_breaches, "host/src/host/sysid/models/state_space_model.py", "from ... import twin"),
    (
        never_breaches,
        "host/src/host/sysid/models/state_space_model.py",
        'importlib.import_module("host.twin")',
    ),
    (
        never_breaches,
        "host/src/host/twin/sensors/imu.py",
        "from host.twin.testcard.cards import Sensors",
    ),
    (
        import_breaches,
        "host/src/host/sysid/linear/linear_estimator.py",
        "from studies import linear",
    ),
    (import_breaches, "host/studies/linear.py", "from tests.host import logs"),
    (
        floor_breaches,
        "host/src/host/log/head.py",
        "from host.sysid.models.state_space_model import Term",
    ),
    (floor_breaches, "host/src/host/log/head.py", "from host.decode.log_summary import summarise"),
    (import_breaches, "tests/simulator/simavr_bench/relay.py", "from flight.rig import make_card"),
    (simulator_breaches, "tests/simulator/speed.py", 'PINS = "hw/pin_map.toml"'),
    (
        verb_breaches,
        "host/src/host/verbs/identify.py",
        'def run(args):\n    """Run."""\n' + "    print()\n" * 61,
    ),
    (verb_breaches, "host/src/host/verbs/plan.py", "def run(args):\n    import numpy as np"),
    (link_breaches, "host/src/host/twin/recorder/mega.py", 'LIBRARY = "libsimavr.so"'),
]


@pytest.mark.parametrize(("rule", "name", "text"), PLANTED)
def test_planted_breach_is_found(tmp_path: Path, rule: object, name: str, text: str) -> None:
    assert callable(rule)
    (tmp_path / name).parent.mkdir(parents=True)
    (tmp_path / name).write_text(f"{text}\n", encoding="utf-8")
    found = list(rule(tmp_path))
    assert len(found) == 1
    assert found[0].startswith(name)


def test_a_name_that_two_rooms_have_is_found(tmp_path: Path) -> None:
    for room in ("models", "coefficients"):
        for name in ("__init__.py", "fit.py"):
            (tmp_path / "host/src/host/sysid" / room).mkdir(parents=True, exist_ok=True)
            (tmp_path / "host/src/host/sysid" / room / name).touch()
    (tmp_path / "host/studies").mkdir()
    (tmp_path / "host/studies/fit.py").touch()
    inside, study = basename_breaches(tmp_path)
    assert inside.startswith("host/src/host/sysid/models/fit.py: host/src/host/sysid/coefficients/")
    assert study.startswith("host/studies/fit.py: host/src/host/sysid/coefficients/")


ALLOWED = [
    (CONSTANTS, "GRAVITY_MPS2 = 9.80665"),
    ("host/src/host/physical/columns.py", 'NOTE = "level at rest -9.81"\nHALF = np.pi / 2.0'),
    ("firmware/core/relay.h", '#include <stdint.h>\n#include "core/time.h"  // no virtual, no new'),
    ("firmware/core/framing.h", '#include "generated/frames.h"\n/* float and\n double */'),
    ("firmware/core/learning/solve.cpp", "const float share = 0.5F;"),
    ("firmware/storage/volume.cpp", '#include <string.h>\n#include "drivers/sd_card.h"'),
    ("firmware/app/recorder.cpp", '#include "storage/volume.h"\nconst char* kText = "new";'),
    ("firmware/boards/sitl/clock.cpp", '#include <vector>\n#include "boards/sitl/clock.h"'),
    ("firmware/boards/arduimu/clock.cpp", '#include "boards/avr/awake.h"'),
    ("tests/firmware/test_a/test_a.cpp", 'TEST_CASE("INFO") { CHECK_EQ(1, 1); REQUIRE(true); }'),
    (
        "host/src/host/sysid/linear/linear_estimator.py",
        "from host.sysid.models.state_space_model import Term",
    ),
    ("host/src/host/decode.py", "import numpy\nfrom host.wire.schema import load"),
    (
        "host/src/host/verbs/info.py",
        'def run(args):\n    """Run."""\n' + "    print()\n" * 60,
    ),
    (
        "host/src/host/planning/card_planning.py",
        "from host.twin.virtual import a\nimport host.sysid.models.maneuver",
    ),
    (
        "host/src/host/sysid/models/state_space_model.py",
        "from . import result\nfrom host.aircraft import file",
    ),
    (
        "host/studies/linear.py",
        "from host.twin.virtual import a\nimport studies.gusts",
    ),
]


@pytest.mark.parametrize(("name", "text"), ALLOWED)
def test_what_the_table_allows_is_not_reported(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).parent.mkdir(parents=True)
    (tmp_path / name).write_text(f"{text}\n", encoding="utf-8")
    assert [line for rule in RULES for line in rule(tmp_path)] == []
