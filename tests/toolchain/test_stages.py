"""The runner of `make test`: what it counts, what it runs after a failure, its exit code."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from concurrent.futures import Future
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]
RUNNER = ROOT / ".ci" / "stages.py"


@pytest.fixture
def runner(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Load the runner by its path and send its logs elsewhere."""
    spec = importlib.util.spec_from_file_location("stages", RUNNER)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "stages", module)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "LOGS", tmp_path)
    monkeypatch.setattr(module, "ROOT", tmp_path)
    return module


def python(code: str) -> tuple[str, ...]:
    return (sys.executable, "-c", code)


def test_cases_are_counted_and_a_skip_is_no_pass(runner: ModuleType, tmp_path: Path) -> None:
    report = tmp_path / "a.xml"
    report.write_text(
        "<testsuites><testsuite><testcase/><testcase><failure/></testcase>"
        "<testcase><error/></testcase><testcase><skipped/></testcase></testsuite></testsuites>"
    )
    assert runner.count_cases(report) == (1, 2)


def test_every_command_of_a_failed_stage_runs(runner: ModuleType, tmp_path: Path) -> None:
    commands = (python("raise SystemExit(3)"), python("print('second')"))
    outcome = runner.run(runner.Stage("a", "two commands", commands), {})
    assert (outcome.state, outcome.passed, outcome.failed) == ("FAILED", 0, 1)
    assert "second" in (tmp_path / "a.log").read_text()


def test_processor_time_is_that_of_all_processes_of_a_stage(runner: ModuleType) -> None:
    busy = "import time\nwhile time.process_time() < 0.3: pass"
    child = python(f"import subprocess, sys; subprocess.run([sys.executable, '-c', {busy!r}])")
    outcome = runner.run(runner.Stage("a", "works in a child", (child, python("pass"))), {})
    assert 0.3 < outcome.cpu_s < 3.0
    assert f"{outcome.cpu_s / 60:8.2f}" in runner.table([outcome], 1.0)


def test_a_case_is_listed_with_its_childs_processor_time_and_what_it_shares(
    runner: ModuleType, tmp_path: Path
) -> None:
    """Four tenths of a second are in the shared fixture, three in a child of the first case."""
    busy = "import time\nwhile time.process_time() < {}: pass"
    (tmp_path / "conftest.py").write_text((ROOT / "tests" / "conftest.py").read_text())
    (tmp_path / "test_two.py").write_text(
        "import subprocess, sys, pytest\n"
        "def work(s):\n"
        f"    subprocess.run([sys.executable, '-c', {busy!r}.format(s)])\n"
        "@pytest.fixture(scope='module')\n"
        "def shared():\n"
        "    work(0.4)\n"
        "def test_first(shared):\n"
        "    work(0.3)\n"
        "def test_second(shared):\n"
        "    pass\n"
    )
    report = tmp_path / "a.xml"
    command = (sys.executable, "-m", "pytest", "--numprocesses=1", f"--junit-xml={report}")
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    (first_s, first), (second_s, second) = runner.slowest_cases([report])
    assert first.endswith("test_first")
    assert 0.65 < first_s < 1.5  # seconds are reported by tenths
    assert second.endswith("test_second")
    assert second_s < 0.1


@pytest.mark.parametrize(("mark", "code"), [("", 1), ("@pytest.mark.costs(2, 'why')", 0)])
def test_a_case_beyond_its_processor_time_has_failed(tmp_path: Path, mark: str, code: int) -> None:
    text = (ROOT / "tests" / "conftest.py").read_text()
    (tmp_path / "conftest.py").write_text(text.replace("MOST_CPU_S = 10.0", "MOST_CPU_S = 0.1"))
    (tmp_path / "test_one.py").write_text(
        f"import pytest, time\n{mark}\ndef test_busy():\n"
        "    end_s = time.process_time() + 0.4\n"
        "    while time.process_time() < end_s: pass\n"
    )
    command = (sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider")
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == code
    assert ("s of processor time, at most 0 s" in done.stdout) == bool(code)


def test_a_process_of_an_earlier_case_costs_a_later_one_nothing(tmp_path: Path) -> None:
    text = (ROOT / "tests" / "conftest.py").read_text()
    (tmp_path / "conftest.py").write_text(text.replace("MOST_CPU_S = 10.0", "MOST_CPU_S = 0.2"))
    (tmp_path / "test_two.py").write_text(
        "import os, subprocess, sys, time\n"
        "BUSY = 'import time\\nwhile time.process_time() < 1.0: pass'\n"
        "LEFT = []\n"
        "def test_first():\n"
        "    LEFT.append(subprocess.Popen([sys.executable, '-c', BUSY]))\n"
        "    os.waitid(os.P_PID, LEFT[0].pid, os.WEXITED | os.WNOWAIT)  # ended, not waited for\n"
        "def test_second():\n"
        "    LEFT[0].wait()\n"
        "    time.sleep(1.0)  # long enough to have used all of it\n"
    )
    command = (sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider")
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_a_stage_without_its_report_has_failed(runner: ModuleType) -> None:
    stage = runner.Stage("a", "no cases", (python("pass"),), report=True)
    outcome = runner.run(stage, {})
    assert (outcome.state, outcome.failed) == ("FAILED", 1)


@pytest.mark.parametrize(("link", "state"), [("needs", "not run"), ("after", "ok")])
def test_what_follows_a_failed_stage(runner: ModuleType, link: str, state: str) -> None:
    first = runner.Stage("first", "fails", ())
    failed: Future[object] = Future()
    failed.set_result(runner.Outcome(first, "FAILED", 0.0, 0, 1))
    second = runner.Stage("second", "follows", (python("pass"),), **{link: ("first",)})
    assert runner.run(second, {"first": failed}).state == state


def test_an_unknown_stage_is_a_usage_error() -> None:
    done = subprocess.run(
        [sys.executable, str(RUNNER), "nonsense"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "no stage nonsense" in done.stderr


def test_a_stage_waits_only_for_stages_before_it(
    runner: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What comes behind it would not be waited for, and could hold up the workers."""
    monkeypatch.setattr(runner, "ROOT", ROOT)
    listed = [stage.name for stage in runner.stages()]
    assert len(set(listed)) == len(listed) > 15
    for stage in runner.stages():
        before = listed[: listed.index(stage.name)]
        assert set(stage.needs + stage.after) <= set(before), stage.name


def test_each_environment_builds_in_a_folder_of_its_own(runner: ModuleType) -> None:
    """PlatformIO empties a folder when the project changed, whoever is building there."""
    commands = [runner.unit_tests(name, name, "").commands[0] for name in ("native", "avr")]
    chosen = {word for command in commands for word in command if "BUILD_DIR=" in word}
    assert len(chosen) == 2
