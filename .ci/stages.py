"""Run every check and test of the clone and end with a table of minutes per stage.

    .venv/bin/python .ci/stages.py               all stages
    .venv/bin/python .ci/stages.py lint native   these only
    .venv/bin/python .ci/stages.py --list        their names

A failed stage does not stop the others, except those that need its result. The
output of each goes to build/logs; its end is shown where a stage fails. The
last line counts test cases, and one for each stage that has none.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

ROOT = Path(__file__).resolve().parent.parent
LOGS = ROOT / "build" / "logs"
BIN = Path(sys.executable).parent
PYTHON = sys.executable

# A stage keeps one core busy and waits now and then, for a device's silence or a bus in real time.
# Four at a time at the most: each may take 0.7 GB, types 2.2.
WORKERS = min(4, 1 + (os.cpu_count() or 1))
TAIL_LINES = 40
SLOWEST = 20
GENERATOR = re.compile(r"/generate(_\w+)?\.py$")

PYTHON_FOLDERS = ("host/src", "host/studies", "protocol", "tests", "hw", "firmware", ".ci")
CPP_FOLDERS = ("firmware", "tests", "protocol")


@dataclass(frozen=True, slots=True)
class Stage:
    """One line of the table: what to run, and what must have run before."""

    name: str
    title: str
    commands: tuple[tuple[str, ...], ...]
    needs: tuple[str, ...] = ()  # not run if one of these failed
    after: tuple[str, ...] = ()  # waits for these, whatever came of them
    report: bool = False  # leaves the result of each case in build/logs/<name>.xml


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a stage."""

    stage: Stage
    state: str  # "ok", "FAILED" or "not run"
    duration_s: float
    passed: int
    failed: int
    cpu_s: float = 0.0  # processor time, which other work on the machine hardly changes


def report_path(name: str) -> Path:
    """Return where a stage leaves the results of its cases (JUnit XML)."""
    return LOGS / f"{name}.xml"


def sources(folders: Sequence[str], suffixes: Sequence[str]) -> list[str]:
    """List our own files below the folders; what a generator wrote has its own format."""
    found = (path for folder in folders for path in (ROOT / folder).rglob("*"))
    return sorted(
        str(path.relative_to(ROOT))
        for path in found
        if path.suffix in suffixes and "generated" not in path.parts
    )


def stages() -> list[Stage]:
    """Describe every stage, in the order in which they start."""
    cpp = sources(CPP_FOLDERS, (".h", ".cpp", ".c"))
    python = sources(PYTHON_FOLDERS, (".py",))
    pio = str(BIN / "pio")
    ruff = str(BIN / "ruff")
    generators = sorted({"protocol/generate.py", *(f for f in python if GENERATOR.search(f))})
    found = [
        Stage(
            "format",
            "clang-format and ruff format",
            (
                (str(BIN / "clang-format"), "--dry-run", "-Werror", *cpp),
                (ruff, "format", "--check", "--no-cache", *python),
            ),
        ),
        Stage("lint", "ruff", ((ruff, "check", "--no-cache", *python),)),
        Stage("types", "mypy --strict", ((PYTHON, "-m", "mypy", *python),)),
        Stage(
            "generated",
            "committed generated files are current",
            tuple((PYTHON, f, "--check") for f in generators),
        ),
        Stage("mega", "image of the Mega", ((pio, "run"),)),
        Stage(
            "library",
            "the firmware as a library for this computer",
            ((PYTHON, "firmware/toolchain/build_sitl.py"),),
        ),
        unit_tests("native", "native", "firmware unit tests on this computer"),
        unit_tests("avr", "simavr", "the same unit tests on a simulated ATmega2560"),
        *pytest_stages(),
    ]
    # What others need first, then the longest: the last to end is a short one.
    first = ("mega", "library", "sysid", "host", "answers", "chip", "types", "native", "avr")
    return sorted(found, key=lambda stage: (*first, "sitl", stage.name).index(stage.name))


def unit_tests(name: str, environment: str, title: str) -> Stage:
    """Describe the unit tests of an environment.

    Each has a build folder of its own: PlatformIO empties one when the project changed, whoever
    else is building there.
    """
    test = (str(BIN / "pio"), "test", "-e", environment)
    folder = f"PLATFORMIO_BUILD_DIR={ROOT / 'build' / 'unit-tests' / name}"
    command = ("env", folder, *test, "--junit-output-path", str(report_path(name)))
    return Stage(name, title, (command,), report=True)


def pytest_stages() -> Iterator[Stage]:
    """Describe one stage per folder of tests/ that pytest can run, two for tests/host.

    Half of all processor time is in tests/host: in one process it would end long after all others.
    Its identification is the half of it. Each imports and collects what is its own.
    """
    needs = {"sitl": ("library",), "chip": ("mega",)}
    built = ("mega", "library")
    after = {"host": built, "sysid": built, "chip": ("library",), "layering": ("mega",)}
    folders = {path.relative_to(ROOT / "tests").parts[0] for path in _test_files()}
    parts: dict[str, tuple[str, ...]] = {
        name: (f"tests/{name}",) for name in folders - {"firmware"}
    }
    if "host" in parts:
        parts["sysid"] = ("tests/host/sysid",)
        parts["host"] += ("--ignore=tests/host/sysid",)
    for name, chosen in sorted(parts.items()):
        report = f"--junit-xml={report_path(name)}"
        yield Stage(
            name,
            f"pytest {chosen[0]}",
            ((PYTHON, "-m", "pytest", *chosen, report),),
            needs=needs.get(name, ()),
            after=after.get(name, ()),
            report=True,
        )


def _test_files() -> Iterator[Path]:
    return (ROOT / "tests").glob("*/**/test_*.py")


def run(stage: Stage, before: dict[str, Future[Outcome]]) -> Outcome:
    """Wait for what the stage needs, run it, say how it went."""
    earlier = {n: before[n].result() for n in (*stage.needs, *stage.after) if n in before}
    broken = [n for n in stage.needs if n in earlier and earlier[n].state != "ok"]
    if broken:
        say(f"{stage.name}: not run, it needs {', '.join(broken)}")
        return Outcome(stage, "not run", 0.0, 0, 1)

    say(f"{stage.name}: {stage.title} ...")
    report_path(stage.name).unlink(missing_ok=True)
    start_s = time.monotonic()
    log = LOGS / f"{stage.name}.log"
    with log.open("w", encoding="utf-8") as out:
        # Every command of a stage runs, so that one round shows all there is to mend.
        ended = [run_command(command, out) for command in stage.commands]
    duration_s = time.monotonic() - start_s
    ok = not any(code for code, _ in ended)
    passed, failed = count_cases(report_path(stage.name)) if stage.report else (int(ok), 0)
    if stage.report and passed + failed == 0:
        ok = False  # a suite that ran nothing has shown nothing
    if not ok:
        failed = max(failed, 1)
    elif failed:
        ok = False
    say(f"{stage.name}: {'ok' if ok else 'FAILED'} after {duration_s:.0f} s")
    if not ok:
        show_tail(log)
    cpu_s = sum(used_s for _, used_s in ended)
    return Outcome(stage, "ok" if ok else "FAILED", duration_s, passed, failed, cpu_s)


def run_command(command: tuple[str, ...], out: TextIO) -> tuple[int, float]:
    """Run a command; give its exit code and the processor seconds of all its processes."""
    child = subprocess.Popen(command, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=out, stderr=out)
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    return child.returncode, used.ru_utime + used.ru_stime


def count_cases(path: Path) -> tuple[int, int]:
    """Count passed and failed cases in a JUnit file; a skipped case has not passed."""
    if not path.is_file():
        return 0, 0
    cases = list(ElementTree.parse(path).getroot().iter("testcase"))
    failed = sum(1 for case in cases if any(case.find(t) is not None for t in ("failure", "error")))
    skipped = sum(1 for case in cases if case.find("skipped") is not None)
    return len(cases) - failed - skipped, failed


def slowest_cases(reports: Sequence[Path]) -> list[tuple[float, str]]:
    """List processor seconds and name of each case that says them, most first.

    The first case of a file pays what its later ones share: see tests/conftest.py.
    """
    found = []
    for path in reports:
        if not path.is_file():
            continue
        for case in ElementTree.parse(path).getroot().iter("testcase"):
            used = case.find("properties/property[@name='cpu_s']")
            if used is not None:
                name = f"{case.get('classname')}.{case.get('name')}"
                found.append((float(used.get("value", "0")), name))
    return sorted(found, reverse=True)


def say(text: str) -> None:
    """Print at once, also into a pipe."""
    print(text, flush=True)


def show_tail(log: Path) -> None:
    """Show the end of a log, indented."""
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    shown = "\n".join(f"    {line}" for line in lines[-TAIL_LINES:])
    say(f"{shown}\n    (all of it: {log.relative_to(ROOT)})")


def table(outcomes: Sequence[Outcome], wall_s: float) -> str:
    """Lay out minutes by the clock and of processor time, cases and state of each stage."""
    lines = [f"{'stage':<12}{'minutes':>8}{'cpu':>8}{'passed':>8}{'failed':>8}  state"]
    lines += [
        f"{o.stage.name:<12}{o.duration_s / 60:>8.2f}{o.cpu_s / 60:>8.2f}"
        f"{o.passed:>8}{o.failed:>8}  {o.state}"
        for o in outcomes
    ]
    cpu_s = sum(o.cpu_s for o in outcomes)
    lines.append(f"{'wall clock':<12}{wall_s / 60:>8.2f}{cpu_s / 60:>8.2f}")
    return "\n".join(lines)


def main() -> int:
    """Run the stages asked for; 0 if all are ok, 6 if not, 2 for an unknown name."""
    parser = argparse.ArgumentParser(description="Run the checks and tests of this clone.")
    parser.add_argument("names", nargs="*", help="stages to run; none means all")
    parser.add_argument("--list", action="store_true", help="print the names and stop")
    asked = parser.parse_args()
    known = stages()
    if asked.list:
        print("\n".join(f"{stage.name:<12}{stage.title}" for stage in known))
        return 0
    strange = set(asked.names) - {stage.name for stage in known}
    if strange:
        names = ", ".join(stage.name for stage in known)
        print(f"no stage {', '.join(sorted(strange))}; there are {names}", file=sys.stderr)
        return 2
    chosen = [stage for stage in known if not asked.names or stage.name in asked.names]

    LOGS.mkdir(parents=True, exist_ok=True)
    # A shell that forbids it has each of hundreds of short processes compile the host anew.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    start_s = time.monotonic()
    futures: dict[str, Future[Outcome]] = {}
    # A stage waits only for stages before it in the list, so two workers cannot block each other.
    with ThreadPoolExecutor(WORKERS) as pool:
        for stage in chosen:
            futures[stage.name] = pool.submit(run, stage, dict(futures))
    outcomes = [future.result() for future in futures.values()]
    say("\n" + table(outcomes, time.monotonic() - start_s))
    slowest = slowest_cases([report_path(stage.name) for stage in chosen])
    if slowest:
        say(f"\n{'cpu s':>8}  slowest cases")
        say("\n".join(f"{cpu_s:>8.1f}  {name}" for cpu_s, name in slowest[:SLOWEST]))
    passed = sum(outcome.passed for outcome in outcomes)
    failed = sum(outcome.failed for outcome in outcomes)
    last = f"tests: {passed} passed, {failed} failed"
    (LOGS / "result.txt").write_text(last + "\n", encoding="utf-8")
    say(last)
    return 0 if all(outcome.state == "ok" for outcome in outcomes) else 6


if __name__ == "__main__":
    sys.exit(main())
